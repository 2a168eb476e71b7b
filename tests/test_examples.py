"""The examples as a visitor runs them: from the command line, in a folder of their own."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from go1_mtl_gym import PAPER_TASKS

ROOT = Path(__file__).parent.parent
IMPOSSIBLE = [("--control-hz", "300"), ("--device", "tpu"), ("--rounds", "-1"), ("--history", "0"), ("--seed", "-1")]
CLOSED_LOOP = {"survival_rate", "survival_s", "velocity_error", "step_rate", "success_rate"}
ONE_STEP = {"mse", "mae", "r2", "r2_joint_mean"}


def start(*arguments: str, script: str = "dagger.py") -> subprocess.Popen:
    command = [sys.executable, str(ROOT / "examples" / script), *arguments]
    return subprocess.Popen(
        command,
        cwd=ROOT,
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


@pytest.mark.parametrize("option", IMPOSSIBLE, ids=lambda option: option[0])
def test_impossible_settings_are_refused_before_anything_is_written(option, tmp_path):
    process = start("--preset", "smoke", "--out", str(tmp_path / "run"), *option)
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 2 and "error: " in output and option[1] in output
    assert not (tmp_path / "run").exists()


@pytest.fixture(scope="module")
def smoke(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A smoke run that was interrupted by Ctrl-C after cloning and then taken up again."""
    out = tmp_path_factory.mktemp("job") / "run"
    arguments = ("--preset", "smoke", "--n-envs", "2", "--out", str(out))
    process = start(*arguments)
    deadline = time.monotonic() + 300
    while not (out / "parts" / "cloned.zip").is_file():
        assert process.poll() is None and time.monotonic() < deadline, process.communicate()[0][-4000:]
        time.sleep(0.1)
    time.sleep(1.0)
    os.killpg(process.pid, signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 130, output[-4000:]
    assert f"--out {out}" in output
    shards = {path: path.stat().st_mtime_ns for path in (out / "demonstrations").iterdir()}
    output = finish(start(*arguments))
    assert shards == {path: path.stat().st_mtime_ns for path in (out / "demonstrations").iterdir()}
    return out, output


@pytest.mark.slow
def test_smoke_writes_the_metrics_that_others_read(smoke):
    out, _ = smoke
    metrics = json.loads((out / "metrics.json").read_text())
    assert list(metrics["tasks"]) == list(PAPER_TASKS)
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
    assert all(task in output for task in PAPER_TASKS) and "R2" in output
    assert output.count("the same without a clock") == len(PAPER_TASKS)
    for name in ("policy.zip", "phase_free.zip", "joint_targets.png", "table.md", "config.json"):
        assert (out / name).stat().st_size > 0
    assert list((out / "tensorboard").glob("events.*"))


@pytest.mark.slow
@pytest.mark.gl
def test_smoke_films_every_gait(smoke):
    out, _ = smoke
    assert all((out / f"{name}.gif").stat().st_size > 10_000 for name in (*PAPER_TASKS, "gaits"))


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
def test_the_phase_free_student_is_the_student_with_an_estimate_of_the_phase(smoke):
    import trainers

    student, phase_free = (trainers.load(smoke[0] / name) for name in ("policy.zip", "phase_free.zip"))
    kept, given = phase_free.student.state_dict(), student.state_dict()
    assert kept.keys() == given.keys() and all(bool((kept[name] == given[name]).all()) for name in given)
    assert "phase" not in phase_free.env_kwargs["channels"] and phase_free.env_kwargs["history"] == 10
    assert phase_free.correction == 1.0


@pytest.mark.slow
def test_a_finished_run_is_not_repeated_and_other_settings_are_refused(smoke):
    out, _ = smoke
    before = (out / "policy.zip").stat().st_mtime_ns, (out / "metrics.json").read_text()
    process = start("--preset", "smoke", "--n-envs", "2", "--out", str(out), "--seed", "1")
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 2 and "other settings (seed)" in output
    assert before == ((out / "policy.zip").stat().st_mtime_ns, (out / "metrics.json").read_text())


@pytest.mark.slow
def test_the_report_goes_on_after_an_interruption(tmp_path):
    out, parts = tmp_path / "expert.json", tmp_path / "parts"
    arguments = ["--quick", "--tasks", "trot", "walk", "--sections", "survival", "transitions"]
    arguments += ["--n-jobs", "2", "--parts", str(parts), "--out", str(out)]
    process = start(*arguments, script="report_expert.py")
    deadline = time.monotonic() + 120
    while not list(parts.glob("survival-*.json")):
        assert process.poll() is None and time.monotonic() < deadline, process.communicate()[0][-4000:]
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 130 and "goes on from there" in output, output[-4000:]
    assert not out.exists()
    finished = {path: path.stat().st_mtime_ns for path in parts.glob("[!.]*.json")}
    output = finish(start(*arguments, script="report_expert.py"))
    assert finished and all(path.stat().st_mtime_ns == written for path, written in finished.items())
    scores = json.loads(out.read_text(encoding="utf-8"))
    assert list(scores["tasks"]) == ["trot", "walk"] and "| trot | 1/1 |" in output
    assert scores["report"]["transitions"]["trot"]["walk"]["trials"] == 1
    assert (tmp_path / "expert_transitions.png").is_file()
