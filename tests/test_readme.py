"""README.md: its code runs, its commands and files exist, its figures are those of the code."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from experts import MPCConfig
from go1_mtl_gym import clock, episode, robot, termination
from go1_mtl_gym import env as environment
from trainers.evaluation import scoring

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PROSE = " ".join(README.split())


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.MULTILINE | re.DOTALL)


def first_line(code: str) -> str:
    """What names a snippet in a test's id: its last call."""
    return code.strip().splitlines()[-1][:40]


@pytest.mark.parametrize("code", blocks("python"), ids=first_line)
def test_snippets_run(code, tmp_path, monkeypatch, capsys, passing_tasks):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["snippet.py"])
    exec(compile(code, "README.md", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out or "print(" not in code


def test_links_lead_somewhere():
    published = (ROOT / "docs" / "results" / "metrics.json").is_file()
    targets = set(re.findall(r"\]\(([^)#:]+)\)", README))
    assert "docs/results/gaits.gif" in targets
    missing = [target for target in sorted(targets) if not (ROOT / target).exists()]
    assert not [target for target in missing if published or not target.startswith("docs/results")]


def test_named_files_exist():
    named = set(re.findall(r"`?((?:examples|experts|trainers|go1_mtl_gym|constraints)/[\w/.]+\.\w+)`?", README))
    assert len(named) > 10
    assert not [name for name in sorted(named) if not (ROOT / name).is_file()]


def test_make_targets_exist():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    commands = [*re.findall("`([^`\n]+)`", README), *"\n".join(blocks("bash")).splitlines()]
    targets = {target for command in commands for target in re.findall(r"\bmake ([a-z][a-z-]+)", command)}
    assert {"dagger", "test", "test-newest"} <= targets
    assert not [target for target in targets if not re.search(rf"^{target}[: ]", makefile, re.MULTILINE)]


def test_named_options_exist():
    source = (ROOT / "trainers" / "pipeline" / "command_line.py").read_text(encoding="utf-8")
    options = re.search(r"Options: `(.*?)`", PROSE)[1].split()
    assert "--preset" in options
    assert sorted(options) == sorted(re.findall(r'"(--[a-z-]+)"', source))


def test_figures_in_the_text_are_the_codes():
    assert f"N = {MPCConfig().steps} intervals" in PROSE
    assert f"at most {scoring.VELOCITY_TOLERANCE} m/s" in PROSE
    assert f"within {100 * scoring.STEP_RATE_TOLERANCE:.0f} % of the gait's" in PROSE
    assert f"after the first {scoring.SETTLE_S:g} s" in PROSE
    assert scoring.MIN_AIR_SHARE == 0.5 and "at least half of its planned swing" in PROSE
    assert f"trunk below {termination.FALLEN_HEIGHT} m" in PROSE
    tilt = np.degrees(np.arccos(termination.FALLEN_COSINE))
    assert f"tilted by more than {tilt:.0f} degrees" in PROSE
    assert f"time constant {episode.COMMAND_FILTER_S} s" in PROSE
    slew, turn = episode.COMMAND_SLEW[0], episode.COMMAND_SLEW[2]
    assert f"at most {slew:g} m/s and {turn:g} rad/s per second" in PROSE
    still, turn = clock.STAND_COMMAND[0], clock.STAND_COMMAND[2]
    assert f"below {still} m/s and {turn} rad/s" in PROSE
    hip, thigh, calf = robot.TORQUE_LIMIT[:3]
    assert f"torque limits of {hip}, {thigh} and {calf} N m" in PROSE


def test_the_table_of_options_lists_every_argument_with_its_default():
    defaults = environment.Go1Env.__init__.__kwdefaults__
    rows = re.findall(r"^\| (`[\w`, ]+`) \| ([^|]+) \|", README, re.MULTILINE)
    stated = {}
    for names, values in rows:
        names = re.findall(r"`(\w+)`", names)
        values = re.findall(r"`([^`]+)`", values) or ["all"]
        if set(names) <= set(defaults):
            stated |= dict(zip(names, values, strict=True))
    assert stated.pop("tasks") == "all"
    assert {name: eval(value) for name, value in stated.items()} == {
        name: value for name, value in defaults.items() if name != "tasks"
    }


def test_the_table_of_parts_agrees_with_the_layout():
    from go1_mtl_gym.sensing.observation import CHANNELS, PROPRIOCEPTION

    rows = re.findall(r"^\| `(\w+)` \| (\d+) \| (always|channel) \|", README, re.MULTILINE)
    assert {name: int(size) for name, size, there in rows if there == "always"} == dict(PROPRIOCEPTION)
    assert {name: int(size) for name, size, there in rows if there == "channel"} == dict(CHANNELS)
