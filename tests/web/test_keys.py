"""The page's keys are the desktop player's."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

controls = pytest.importorskip("trainers.play.controls")
SOURCES = Path(__file__).parents[2] / "web" / "src"
MEANINGS = {
    "P": "push", "T": "changePolicy", "SPACE": "pause", "N": "oneStep", "MINUS": "slower", "EQUAL": "faster",
    "R": "reset", "C": "changeCamera", "H": "help",
}  # fmt: skip
"""The page's names of what a key does in the player; the page has no ghost and nothing to quit."""
CODES = {"SPACE": "Space", "MINUS": "Minus", "EQUAL": "Equal"} | {
    name: f"Arrow{name.capitalize()}" for name in ("UP", "DOWN", "LEFT", "RIGHT")
}
"""`KeyboardEvent.code` by GLFW's names; letters are their own with "Key" before them."""


@pytest.fixture(scope="module")
def page():
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node")
    program = (
        f"import {{ STICK_KEYS }} from {json.dumps((SOURCES / 'stick.js').as_uri())};"
        f"import {{ ACTION_KEYS }} from {json.dumps((SOURCES / 'keyboard.js').as_uri())};"
        "console.log(JSON.stringify({ stick: STICK_KEYS, actions: ACTION_KEYS }));"
    )
    command = [node, "--no-warnings", "--input-type=module", "-e", program]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout)


def code(name):
    return CODES.get(name, f"Key{name}")


def test_the_stick_is_held_by_the_same_keys(page):
    assert page["stick"] == {code(name): [axis, int(end)] for name, (axis, end) in controls.STICK_KEYS.items()}


def test_keys_that_both_have_do_the_same(page):
    assert {code(name): page["actions"].get(code(name)) for name in MEANINGS} == {
        code(name): action for name, action in MEANINGS.items()
    }
    helped = " ".join(keys for keys, _ in controls.HELP)
    symbols = {"SPACE": "Space", "MINUS": "-", "EQUAL": "="}
    assert all(symbols.get(name, name) in helped for name in MEANINGS), "the player has them still"
