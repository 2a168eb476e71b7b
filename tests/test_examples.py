"""The examples as a visitor runs them; the short ones in this process, the main job in processes of its own."""

import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from go1_mtl_gym import BUILT_IN_TASKS, env_id
from trainers.utils.cli import interpreter

ROOT = Path(__file__).parent.parent
SMOKE_TASKS = ("bound", "walk")
"""Half of the gaits, in half of the time."""
CLOSED_LOOP = {"survival_rate", "survival_s", "velocity_error", "step_rate", "success_rate"}
ONE_STEP = {"mse", "mae", "r2", "r2_joint_mean"}
IMPOSSIBLE = {
    "--control-hz": "300",
    "--device": "tpu",
    "--rounds": "-1",
    "--history": "0",
    "--seed": "-1",
    "--n-envs": "0",
}


def example(name: str) -> ModuleType:
    """The module of an example, loaded anew."""
    spec = importlib.util.spec_from_file_location(f"example_{name}", ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# -- Short ones --------------------------------------------------------------------------------------------------------


def test_quickstart_drives_the_policy_of_the_package(capsys):
    assert example("quickstart").run(["--task", "walk", "--seconds", "3", "--command", "0.3", "0", "0"]) == 0
    name, speed, asked = re.fullmatch(
        r"(\w+): still up, (\S+) m/s forward, \S+ m/s left, \S+ rad/s; asked for (\S+), 0, 0\n", capsys.readouterr().out
    ).groups()
    assert name == "walk" and float(asked) == 0.3 and float(speed) == pytest.approx(0.3, abs=0.15)


def test_quickstart_drives_a_policy_from_a_file(tmp_path, capsys):
    import trainers

    trainers.load_pretrained("phase_free").save(tmp_path / "policy.zip")
    assert example("quickstart").run([str(tmp_path / "policy.zip"), "--seconds", "1"]) == 0
    assert capsys.readouterr().out.startswith("trot: still up")


def test_the_expert_example_changes_gait(capsys):
    assert example("expert").run(["--task", "bound", "--then", "trot", "--seconds", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(",")[0] for line in lines] == ["bound: fallen False", "trot: fallen False"]


def test_a_custom_gait_walks(passing_tasks, capsys):
    assert example("custom_gait").run(["--seconds", "2"]) == 0
    assert "amble: fallen False" in capsys.readouterr().out


def test_a_custom_expert_nods_without_falling(capsys):
    assert example("custom_expert").run(["--seconds", "2"]) == 0
    pattern = r"100 rows in 1 episode, front left knee from (\S+) to (\S+) rad\n"
    low, high = map(float, re.fullmatch(pattern, capsys.readouterr().out).groups())
    assert high - low == pytest.approx(2 * 0.24, abs=0.03)


def test_a_new_gait_leaves_a_policy_that_quickstart_drives(passing_tasks, tmp_path, capsys):
    out = tmp_path / "policies" / "with_amble.zip"
    options = ["--seconds", "4", "--steps", "20", "--episodes", "1", "--out", str(out)]
    assert example("new_gait").run(options) == 0
    printed = capsys.readouterr().out
    assert "trot: success in 100 %" in printed and "amble: success in" in printed
    assert printed.endswith(
        "So little training is not enough to learn a gait; leave out --seconds and --steps to train in full.\n"
    )
    assert example("quickstart").run([str(out), "--task", "amble", "--seconds", "0.2"]) == 0


def test_a_policy_without_a_clock_is_made_and_saved(tmp_path, capsys):
    out = tmp_path / "phase_free.zip"
    assert example("phase_free").run(["--seconds", "1", "--steps", "10", "--episodes", "1", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "without one it sees     command, last_action, leg_kinematics and 10 frames" in printed
    assert "So little training is not enough to read the phase" in printed
    assert example("quickstart").run([str(out), "--seconds", "0.2"]) == 0


def test_ppo_goes_on_from_the_policy(tmp_path, capsys):
    out = tmp_path / "ppo.zip"
    assert example("ppo").run(["--steps", "1", "--critic-steps", "40", "--episodes", "1", "--out", str(out)]) == 0
    assert capsys.readouterr().out.count("success in 100 % of 1 episodes before") == len(BUILT_IN_TASKS)
    assert example("quickstart").run([str(out), "--seconds", "0.2"]) == 0


def test_rl_zoo_takes_its_settings_from_the_file(tmp_path, monkeypatch, capsys):
    zoo = pytest.importorskip("rl_zoo3.train")
    settings = ROOT / "examples" / "rl_zoo3_ppo.yml"
    small = ["n_envs:1", "n_steps:32", "batch_size:32", "n_epochs:1"]
    options = ["--algo", "ppo", "--env", "Go1Trot-v0", "--gym-packages", "go1_mtl_gym", "--conf-file", str(settings)]
    options += ["-f", str(tmp_path), "-n", "32", "--eval-freq", "-1", "--seed", "0", "--num-threads", "1"]
    monkeypatch.setattr(sys, "argv", ["train", *options, "--hyperparams", *small])
    zoo.train()
    (saved,) = tmp_path.glob("ppo/Go1Trot-v0_1/Go1Trot-v0.zip")
    assert "log_std_init=-3.0" in capsys.readouterr().out and saved.stat().st_size > 10_000


def test_rl_zoo_has_settings_for_every_environment():
    yaml = pytest.importorskip("yaml")
    settings = yaml.safe_load((ROOT / "examples" / "rl_zoo3_ppo.yml").read_text(encoding="utf-8"))
    assert set(settings) == {env_id(task).partition(":")[2] for task in (None, *BUILT_IN_TASKS)}


# -- Errors ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["quickstart", "dagger", "expert", "custom_gait", "custom_expert", "new_gait", "phase_free", "ppo"]
)
def test_help_says_what_the_options_are(name, capsys):
    with pytest.raises(SystemExit) as end:
        example(name).run(["--help"])
    assert end.value.code == 0 and " options" in capsys.readouterr().out.replace("\noptions:", " options")


def refused(name: str, arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The one line on stderr that an example ends with, after "error: "."""
    assert example(name).run(arguments) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.startswith("error: ") and printed.err.count("\n") == 1
    return printed.err


@pytest.mark.parametrize("option", IMPOSSIBLE)
def test_impossible_settings_are_refused_before_anything_is_written(option, tmp_path, capsys):
    out = tmp_path / "run"
    message = refused("dagger", ["--preset", "smoke", "--out", str(out), option, IMPOSSIBLE[option]], capsys)
    assert option[2:].replace("-", "_") in message and IMPOSSIBLE[option] in message and len(message) < 200
    assert not out.exists()


def test_a_folder_that_cannot_be_written_to_is_refused(tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    folders = [tmp_path / "file", tmp_path / "file" / "below", *([Path("/proc/run")] if Path("/proc").is_dir() else [])]
    for out in folders:
        assert str(out) in refused("dagger", ["--preset", "smoke", "--out", str(out)], capsys)
    assert (tmp_path / "file").read_text() == "mine"


def test_a_policy_that_is_none_is_refused(tmp_path, capsys):
    (tmp_path / "policy.zip").write_text("no policy")
    assert "policy.zip" in refused("quickstart", [str(tmp_path / "policy.zip")], capsys)
    assert "nowhere.zip" in refused("quickstart", ["nowhere.zip"], capsys)


def test_a_gait_that_the_policy_does_not_know_is_refused_with_those_that_it_knows(capsys):
    message = refused("quickstart", ["--task", "hop"], capsys)
    assert "'hop'" in message and all(f"'{task}'" in message for task in BUILT_IN_TASKS)


@pytest.mark.parametrize("value", ["nan", "inf", "-1", "0", "long"])
@pytest.mark.parametrize("name", ["quickstart", "expert", "custom_gait", "custom_expert", "new_gait", "phase_free"])
def test_an_impossible_duration_is_refused(name, value, capsys):
    with pytest.raises(SystemExit) as end:
        example(name).run([f"--seconds={value}"])
    assert end.value.code == 2
    assert f"argument --seconds: must be a finite number > 0, got '{value}'\n" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--steps=0", "--steps=-1", "--episodes=0", "--episodes=1.5"])
@pytest.mark.parametrize("name", ["new_gait", "phase_free", "ppo"])
def test_an_impossible_count_is_refused_before_training(name, option, tmp_path, capsys):
    option, _, value = option.partition("=")
    with pytest.raises(SystemExit) as end:
        example(name).run([f"{option}={value}", "--out", str(tmp_path / "runs" / "policy.zip")])
    assert end.value.code == 2 and not list(tmp_path.iterdir())
    assert f"argument {option}: must be a whole number > 0, got '{value}'\n" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["new_gait", "phase_free", "ppo"])
def test_a_file_that_cannot_be_written_is_refused_before_training(name, tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    places = [
        tmp_path,
        tmp_path / "file" / "policy.zip",
        *([Path("/proc/policy.zip")] if Path("/proc").is_dir() else []),
    ]
    for out in places:
        assert str(out) in refused(name, ["--out", str(out)], capsys)
    assert (tmp_path / "file").read_text() == "mine" and len(list(tmp_path.iterdir())) == 1


def test_the_interpreter_to_type_is_the_one_that_runs_if_it_is_near(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", str(tmp_path / "the venv" / "bin" / "python"))
    monkeypatch.chdir(tmp_path)
    assert interpreter() == "'the venv/bin/python'"
    monkeypatch.chdir(tmp_path.parent)
    assert interpreter().endswith("the venv/bin/python'")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert interpreter() == "python"


def test_a_command_beyond_the_limit_is_refused(capsys):
    assert "command" in refused("quickstart", ["--command", "9", "0", "0"], capsys)


# -- The main job ------------------------------------------------------------------------------------------------------


def start(*arguments: str) -> subprocess.Popen:
    command = [sys.executable, str(ROOT / "examples" / "dagger.py"), *arguments]
    return subprocess.Popen(
        command,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # tests in a background job ignore Ctrl-C
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def finish(process: subprocess.Popen) -> str:
    output, _ = process.communicate(timeout=600)
    assert process.returncode == 0, output[-4000:]
    return output


def interrupt(process: subprocess.Popen, once: Path) -> str:
    """Press Ctrl-C a second after a file is there; the output."""
    deadline = time.monotonic() + 300
    while not once.exists():
        assert process.poll() is None and time.monotonic() < deadline, process.communicate()[0][-4000:]
        time.sleep(0.1)
    time.sleep(1.0)
    os.killpg(process.pid, signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 130, output[-4000:]
    assert "Traceback" not in output, output[-4000:]
    return output


@pytest.fixture(scope="module")
def smoke(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A smoke run that was interrupted by Ctrl-C, once while collecting and once in a round, and taken up again."""
    out = tmp_path_factory.mktemp("job") / "run"
    arguments = ("--preset", "smoke", "--tasks", *SMOKE_TASKS, "--n-envs", "2", "--out", str(out))
    output = interrupt(start(*arguments), out / "demonstrations")
    assert f"interrupted; what is done is kept, go on with: --out {out}" in output
    output = interrupt(start(*arguments), out / "parts" / "cloned.zip")
    assert f"--out {out}" in output
    shards = {path: path.stat().st_mtime_ns for path in (out / "demonstrations").iterdir()}
    output = finish(start(*arguments))
    assert shards == {path: path.stat().st_mtime_ns for path in (out / "demonstrations").iterdir()}
    return out, output


@pytest.mark.slow
def test_smoke_writes_the_metrics_that_others_read(smoke):
    out, _ = smoke
    metrics = json.loads((out / "metrics.json").read_text())
    assert list(metrics["tasks"]) == list(SMOKE_TASKS)
    for learners in metrics["tasks"].values():
        assert set(learners["expert"]) >= CLOSED_LOOP
        for name in ("multi_head", "pooled", "paper_literal"):
            assert set(learners[name]) >= CLOSED_LOOP | ONE_STEP
        assert set(learners["phase_free"]) >= CLOSED_LOOP and not set(learners["phase_free"]) & ONE_STEP
        assert learners["expert"]["survival_rate"] == 1.0
    assert metrics["seed"] == 0 and metrics["config"]["preset"] == "smoke"
    assert {"demonstrations", "clone", "dagger", "phase_free", "baselines", "evaluation"} <= set(metrics["seconds"])
    assert metrics["versions"]["mujoco"]


@pytest.mark.slow
def test_smoke_prints_one_table_per_gait_and_leaves_its_files(smoke):
    out, output = smoke
    assert all(task in output for task in SMOKE_TASKS) and "R2" in output
    assert output.count("| the same without a clock") == len(SMOKE_TASKS)
    for name in ("policy.zip", "phase_free.zip", "metrics.json"):
        assert f"  {out / name}" in output
    assert f"{interpreter()} -m tensorboard.main --logdir {out / 'tensorboard'}" in output
    assert f"{interpreter()} examples/quickstart.py {out / 'policy.zip'}" in output
    assert "So little training gives a robot that falls" in output
    for name in ("policy.zip", "phase_free.zip", "joint_targets.png", "table.md", "config.json"):
        assert (out / name).stat().st_size > 0
    assert list((out / "tensorboard" / out.name).glob("events.*")), "TensorBoard names the run after its folder"


@pytest.mark.slow
@pytest.mark.gl
def test_smoke_films_every_gait(smoke):
    out, _ = smoke
    assert all((out / f"{name}.gif").stat().st_size > 10_000 for name in (*SMOKE_TASKS, "gaits"))
    log = EventAccumulator(str(out / "tensorboard" / out.name)).Reload()
    films, bounds = log.Images("film"), log.Scalars("certificate/lower_bound")
    assert len(films) == len(bounds) > 1 and [each.step for each in films] == [each.step for each in bounds]
    assert all(0.0 <= each.value < 1.0 for each in bounds)
    assert (films[0].width, films[0].height) == (320, 120), "two gaits side by side"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["policy.zip", "phase_free.zip"])
def test_the_saved_policies_drive_their_environments(smoke, name):
    import trainers

    policy = trainers.load(smoke[0] / name)
    env = trainers.make_env("bound", **policy.env_kwargs)
    obs, _ = env.reset(seed=0)
    action, _ = policy.predict(obs, deterministic=True)
    assert env.action_space.contains(action)


@pytest.mark.slow
def test_the_phase_free_policy_is_the_policy_with_an_estimate_of_the_phase(smoke):
    import trainers

    student, phase_free = (trainers.load(smoke[0] / name) for name in ("policy.zip", "phase_free.zip"))
    kept, given = phase_free.student.state_dict(), student.state_dict()
    assert kept.keys() == given.keys() and all(bool((kept[name] == given[name]).all()) for name in given)
    assert "phase" not in phase_free.env_kwargs["channels"] and phase_free.env_kwargs["history"] == 10
    assert phase_free.correction < 1


@pytest.mark.slow
def test_a_finished_run_is_not_repeated_and_other_settings_are_refused(smoke):
    out, _ = smoke
    before = (out / "policy.zip").stat().st_mtime_ns, (out / "metrics.json").read_text()
    process = start("--preset", "smoke", "--tasks", *SMOKE_TASKS, "--out", str(out), "--seed", "1")
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 2 and "other settings (seed)" in output
    assert before == ((out / "policy.zip").stat().st_mtime_ns, (out / "metrics.json").read_text())
