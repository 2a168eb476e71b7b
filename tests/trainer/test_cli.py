"""The command line: light help, options that are the dataclasses', misspelled words, and the commands at work."""

import dataclasses
import inspect
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import trainers
from go1_mtl_gym import TASKS, InvalidInputError
from trainers.cli import certify, collect, evaluate, listing, play, train
from trainers.cli.options import values_of, with_number
from trainers.cli.program import COMMANDS, run
from trainers.evaluation.conditions import CONDITIONS
from trainers.pipeline.presets import PRESETS

HEAVY = {"torch", "mujoco", "pinocchio", "stable_baselines3", "imitation", "matplotlib", "numba", "tensorboard"}
"""What help must not wait for."""
ROOT = Path(__file__).resolve().parents[2]


def ended(words: list[str]) -> int:
    """The exit status of the program."""
    try:
        return run(words)
    except SystemExit as end:
        return int(end.code or 0)


# -- Help --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_loads_nothing_heavy(command):
    words = [*filter(None, [command]), "--help"]
    code = (
        "import json, sys\n"
        "from trainers.cli.program import run\n"
        "try:\n"
        f"    run({words!r})\n"
        "except SystemExit as end:\n"
        "    assert not end.code\n"
        "print(json.dumps(sorted({name.partition('.')[0] for name in sys.modules})))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("usage: go1-mtl-gym") and not done.stderr
    assert not HEAVY & set(json.loads(done.stdout.splitlines()[-1]))


def test_help_names_every_command_and_its_options(capsys):
    assert run([]) == run(["--help"]) == 0
    printed = capsys.readouterr().out
    assert all(f"\n  {name} " in printed for name in COMMANDS)
    for command in (certify, evaluate, play, train):
        name, kind = command.__name__.rpartition(".")[2], command.Options
        assert ended([name, "--help"]) == 0
        printed = capsys.readouterr().out
        options = [each.name for each in dataclasses.fields(kind) if each.name not in ("policy", "operator", "mirror")]
        assert all(f"--{option.replace('_', '-')}" in printed for option in options)


def test_the_help_of_a_preset_shows_its_values(capsys):
    assert ended(["train", "--preset", "smoke", "--help"]) == 0
    printed = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert f"Gradient steps of cloning. (default: {PRESETS['smoke']['clone_steps']})" in printed
    assert "Their damping [N m s/rad]." in printed, "what the docstring says"


def test_the_version_is_told(capsys):
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.startswith("go1-mtl-gym ")


def test_it_is_a_module_and_a_script():
    script = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert 'go1-mtl-gym = "trainers.cli.program:run"' in script
    command = [sys.executable, "-m", "trainers", "nothing"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2 and done.stderr.startswith("error: command must be one of 'list', 'play'")


# -- Misspelled --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["lsit"], "did you mean 'list'?"),
        (["train", "--preset", "smke"], "did you mean 'smoke'?"),
        (["train", "--preset=shiped"], "did you mean 'shipped'?"),
        (["train", "--tasks", "trto"], "did you mean 'trot'?"),
        (["train", "--channels", "fase"], "did you mean 'phase'?"),
        (["train", "--ronds", "3"], "--rounds"),
        (["train", "--operator.hodl", "3"], "--operator.hold"),
        (["certify", "clocked", "--out", "x", "--conditions", "frction"], "did you mean 'friction'?"),
        (["collect", "--out", "x", "--tasks", "wlak"], "did you mean 'walk'?"),
        (["evaluate", "--episods", "3"], "--episodes"),
        (["play", "--task", "trto"], "did you mean 'trot'?"),
        (["play", "--polcy", "expert"], "--policy"),
    ],
)
def test_a_misspelled_word_is_answered_by_the_one_that_was_meant(words, meant, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert ended(words) == 2
    printed = capsys.readouterr()
    assert meant in printed.err and not printed.out and not list(tmp_path.iterdir())


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_are_told_commands_options_and_words(shell, capsys):
    assert ended(["--tyro-print-completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(word in script for word in (*COMMANDS, *TASKS, *PRESETS, *CONDITIONS, "--round-steps", "--save-script"))


# -- Options -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", PRESETS)
def test_options_that_are_not_given_are_the_presets(preset):
    assert train.parse_job(["--preset", preset]) == (trainers.JobConfig.from_preset(preset), None)


def test_every_setting_of_the_job_is_an_option():
    assert [each.name for each in dataclasses.fields(train.Options)][:2] == ["preset", "out"]
    settings = {each.name for each in dataclasses.fields(trainers.JobConfig)}
    assert {each.name for each in dataclasses.fields(train.Options)} == settings | {"out"}
    words = "--preset smoke --operator.hold 9 --hard-push-interval None --no-mirror --task-interval 3 5 --kp 40"
    config, _ = train.parse_job(words.split())
    hands = dataclasses.replace(trainers.OperatorConfig(), hold=9.0)
    options = {"operator": hands, "hard_push_interval": None, "mirror": False, "task_interval": (3.0, 5.0), "kp": 40.0}
    assert config == trainers.JobConfig.from_preset("smoke", **options)
    assert type(config.tasks[0]) is str, "names are plain strings once they are read"


def test_what_cannot_be_is_refused_in_the_words_of_the_dataclass():
    with pytest.raises(InvalidInputError, match="rounds must be an integer of at least 0, got -1"):
        train.parse_job(["--rounds", "-1"])


def test_defaults_of_certify_are_those_of_the_function():
    defaults = {name: each.default for name, each in inspect.signature(trainers.certify).parameters.items()}
    given = {each.name: each.default for each in dataclasses.fields(certify.Options)}
    same = ("claim", "allowed_failures", "episodes", "seed", "reference")
    assert {name: given[name] for name in same} == {name: defaults[name] for name in same}
    told = inspect.getdoc(certify.Options)
    assert all(f"({defaults[name]:g} if not given)" in told for name in ("seconds", "tours", "tour_seconds"))
    others = {each.name: each.default for each in dataclasses.fields(evaluate.Options)}
    driven = {name: each.default for name, each in inspect.signature(trainers.evaluate).parameters.items()}
    same = ("episodes", "seconds", "seed", "command_interval", "corners")
    assert {name: others[name] for name in same} == {name: driven[name] for name in same}


def test_an_option_may_stand_without_its_number():
    assert with_number(["p", "--video"], "--video", 5) == ["p", "--video", "5"]
    assert with_number(["--video", "--out", "x"], "--video", 5) == ["--video", "5", "--out", "x"]
    assert with_number(["--video", "3"], "--video", 5) == ["--video", "3"]


def test_collect_describes_shards(tmp_path):
    options = collect.Options(out=tmp_path, tasks=("trot", "walk"), shards=2, seed=7, kp=40.0)
    jobs = collect.jobs_of(options)
    assert [(job.task, job.seed) for job in jobs] == [("trot", 7), ("walk", 7), ("trot", 8), ("walk", 8)]
    assert jobs[0].perturbation == trainers.PerturbationConfig() and jobs[0].env_kwargs["kp"] == 40.0
    assert collect.jobs_of(dataclasses.replace(options, clean=True))[0].perturbation is None
    hands = collect.jobs_of(dataclasses.replace(options, hands=True))[0].perturbation.operator
    assert hands == trainers.OperatorConfig() and values_of(options)["shards"] == 2
    alone = collect.jobs_of(dataclasses.replace(options, hands=True, tasks=("trot",)))[0].perturbation.operator
    assert alone.task_interval is None, "one gait cannot change"
    with pytest.raises(InvalidInputError, match="shards"):
        collect.jobs_of(dataclasses.replace(options, shards=0))


# -- At work -----------------------------------------------------------------------------------------------------------


def test_list_names_what_can_be_typed(capsys):
    assert run(["list"]) == 0
    printed = capsys.readouterr().out
    words = {line.split()[0] for line in printed.splitlines() if line.startswith("  ")}
    assert words >= {*TASKS, *PRESETS, *CONDITIONS, "clocked", "phase_free"}
    assert "go1_mtl_gym:Go1MultiGait-v0" in printed and len(printed.splitlines()) < 50
    assert {row[0] for row in listing.lists()["presets of `train`"]} == set(PRESETS)


def test_evaluate_drives_and_writes_every_episode(tmp_path, capsys):
    out = tmp_path / "scores.json"
    words = ["evaluate", "--tasks", "walk", "--episodes", "1", "--seconds", "3", "--command", "0.3", "0", "-0.1"]
    assert run([*words, "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert told.startswith("1 episodes of 3 s per gait, with the command 0.3 0 -0.1; seed 1\nwalk: ")
    assert re.search(r"walk: [01] of 1 episodes of 3 s succeed .*, 1 survive, ", told)
    scores = json.loads(out.read_text())
    assert scores["tasks"]["walk"]["episodes"][0]["commands"] == [[0.3, 0.0, -0.1]]
    assert scores["policy"]["name"] == "clocked"
    assert ended(["evaluate", str(tmp_path / "none.zip")]) == 2 and "none.zip" in capsys.readouterr().err
    file = str(tmp_path / "y.json")
    beyond_jump = ["evaluate", "--tasks", "pace", "jump", "--episodes", "1", "--command", "2", "0", "0", "--out", file]
    assert ended(beyond_jump) == 2
    told = capsys.readouterr()
    assert "'jump' must lie within" in told.err and not told.out, "before pace was measured"


def test_collect_makes_shards_once(tmp_path, capsys):
    words = ["collect", "--out", str(tmp_path), "--tasks", "trot", "--seconds", "0.5", "--clean", "--seed", "3"]
    assert run(words) == 0 and "1 shards, " in capsys.readouterr().out
    (shard,) = tmp_path.glob("*.npz")
    made = shard.stat().st_mtime_ns
    assert len(trainers.Demonstrations.load(shard)) == 25
    assert run(words) == 0 and shard.stat().st_mtime_ns == made
    assert ended(["collect", "--out", str(shard)]) == 2


def test_without_tyro_it_says_what_to_install(tmp_path):
    (tmp_path / "tyro.py").write_text("raise ModuleNotFoundError('No module named tyro', name='tyro')")
    variables = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    command = [sys.executable, "-m", "trainers", "list"]
    done = subprocess.run(command, env=variables, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "python -m pip install tyro" in done.stderr
