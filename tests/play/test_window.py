"""The window on a virtual screen, with keys that come from the window system."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import trainers
from trainers.evaluation.episodes import EpisodeSetup
from trainers.play.session import Session

MISSING = [program for program in ("Xvfb", "xdotool") if shutil.which(program) is None]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)} (Debian packages xvfb, xdotool)"),
]
PATIENCE_S = 90.0
"""For something to appear in a window of a busy machine without a GPU [s]."""


@pytest.fixture(scope="module")
def screen() -> Iterator[str]:
    """The name of a virtual screen."""
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24", "-nolisten", "tcp"]
    process = subprocess.Popen(command, pass_fds=(write,), stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as pipe:
        number = pipe.readline().strip()
    if not number:
        pytest.skip("Xvfb does not start here")
    yield f":{number}"
    process.terminate()
    process.wait(timeout=30)


class Typist:
    """Types into a window that another process has opened, and reads what that says of itself."""

    def __init__(self, screen: str, picture: Path) -> None:
        self._environment = {**os.environ, "DISPLAY": screen, "PYTHONPATH": os.pathsep.join(sys.path)}
        command = [sys.executable, "-m", "tests.play.drive_window", str(picture)]
        self.process = subprocess.Popen(command, env=self._environment, stdout=subprocess.PIPE, text=True)
        self.wait(lambda said: True)
        self.do("search", "--sync", "--name", "go1-mtl-gym", "windowfocus", "--sync")

    def do(self, *words: str) -> None:
        subprocess.run(["xdotool", *words], env=self._environment, check=True, timeout=PATIENCE_S)

    def wait(self, seen: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Read on until something is seen."""
        end, said = time.monotonic() + PATIENCE_S, {}
        while time.monotonic() < end and (line := self.process.stdout.readline()):
            said = json.loads(line)
            if seen(said):
                return said
        raise AssertionError(f"never seen; last: {said}")


@pytest.fixture
def typist(screen, tmp_path) -> Iterator[Typist]:
    typist = Typist(screen, tmp_path / "window.png")
    yield typist
    if typist.process.poll() is None:
        typist.process.kill()
        typist.process.wait()


def test_a_person_drives(typist, tmp_path):
    assert typist.wait(lambda said: said["help"])["task"] == "trot"
    typist.do("keydown", "Up")
    typist.wait(lambda said: said["stick"] == [1.0, 0.0, 0.0] and said["speed"] > 0.8)
    typist.do("keydown", "a")
    typist.wait(lambda said: said["stick"] == [1.0, 0.0, 1.0])
    typist.do("keyup", "a", "keyup", "Up")
    typist.wait(lambda said: said["stick"] == [0.0, 0.0, 0.0] and said["speed"] < 0.2)
    for key, seen in (
        ("4", lambda said: said["task"] == "walk"),
        ("t", lambda said: said["driver"] == "expert"),
        ("t", lambda said: said["driver"] == "student"),
        ("g", lambda said: said["ghost"]),
        ("space", lambda said: said["paused"]),
        ("space", lambda said: not said["paused"]),
    ):
        typist.do("key", key)
        typist.wait(seen)
    azimuth = typist.wait(lambda said: True)["azimuth"]
    typist.do("mousemove", "100", "100", "mousedown", "1", "mousemove", "160", "100", "mouseup", "1")
    typist.wait(lambda said: abs(said["azimuth"] - azimuth) > 10)
    typist.do("mousemove", "45", "10", "click", "1")
    typist.wait(lambda said: said["task"] == "bound")
    typist.do("key", "Escape")
    typist.process.stdout.read()
    assert typist.process.wait(timeout=PATIENCE_S) == 0
    picture = np.asarray(Image.open(tmp_path / "window.png"))
    assert picture.shape == (180, 320, 3) and picture.std() > 20


def test_what_was_driven_in_a_window_goes_the_same_way_without_one(typist, tmp_path, student):
    for keys in (("keydown", "Up"), ("key", "5"), ("key", "p"), ("keydown", "q"), ("keyup", "Up")):
        steps = typist.wait(lambda said: True)["steps"]
        typist.do(*keys)
        typist.wait(lambda said: said["steps"] > steps + 20)  # noqa: B023
    typist.do("key", "Escape")
    typist.process.stdout.read()
    assert typist.process.wait(timeout=PATIENCE_S) == 0
    script = trainers.Script.read(tmp_path / "window.png.json")
    assert len(script.moves) >= 5 and any(move.push for move in script.moves)
    first = script.moves[0]
    with Session(student, EpisodeSetup(first.task, 3, script.seconds, command=first.command), script.drive) as session:
        while not session.ended:
            session.step()
        np.testing.assert_array_equal(session.go1.simulation.snapshot(), np.load(tmp_path / "window.png.npy"))
