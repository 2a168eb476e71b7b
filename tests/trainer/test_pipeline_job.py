"""One job in a folder: whose it is, what stays on disk, and what is not done twice."""

import json

import pytest

from go1_mtl_gym import InvalidInputError
from trainers import Job, JobConfig
from trainers.pipeline.baselines import baseline_names
from trainers.pipeline.run_folder import RunFolder

TINY = JobConfig.from_preset(
    "smoke", tasks=("trot",), rounds=0, n_envs=1, clean_s=1.0, perturbed_s=0, held_out_s=1.0, shard_s=1.0, width=8,
    clone_steps=5, phase_free_s=0, episodes=1, episode_s=0.5, channels=(), history=1,
)  # fmt: skip


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """A job whose stages up to the metrics are done."""
    job = Job(TINY, tmp_path_factory.mktemp("jobs") / "run", command="python here.py")
    train, held_out = job.demonstrations()
    policy = job.dagger(job.clone(train, held_out), train, held_out)
    job.metrics = job.evaluate({"multi_head": policy} | job.phase_free(policy) | job.baselines(), held_out)
    return job


def test_the_metrics_hold_every_agent_the_settings_and_the_times(job):
    metrics = json.loads(job.folder.metrics.read_text())
    assert metrics == json.loads(json.dumps(job.metrics))
    assert set(metrics["tasks"]["trot"]) == {"multi_head", "expert", "pooled"}
    assert "r2" in metrics["tasks"]["trot"]["pooled"] and "r2" not in metrics["tasks"]["trot"]["expert"]
    assert metrics["config"] == TINY.as_dict() and metrics["command"] == "python here.py"
    assert set(metrics["seconds"]) == {"demonstrations", "clone", "baselines", "evaluation"}


def test_a_job_made_again_takes_what_is_there(job):
    before = {path: path.stat().st_mtime_ns for path in job.folder.parts.rglob("*.zip")}
    again = Job(TINY.with_options(n_envs=2), job.folder.path)
    train, held_out = again.demonstrations()
    policy = again.clone(train, held_out)
    again.baselines()
    metrics = again.evaluate({"multi_head": policy}, held_out)
    assert before == {path: path.stat().st_mtime_ns for path in job.folder.parts.rglob("*.zip")} and before
    assert metrics["tasks"]["trot"]["multi_head"] == job.metrics["tasks"]["trot"]["multi_head"]
    assert set(metrics["seconds"]) == set(job.metrics["seconds"]), "times of earlier runs are kept"


def test_a_folder_with_other_settings_is_refused_and_left_alone(job):
    before = {path: path.stat().st_mtime_ns for path in job.folder.path.rglob("*")}
    with pytest.raises(InvalidInputError, match=r"other settings \(seed, width\)"):
        Job(TINY.with_options(seed=1, width=16), job.folder.path)
    assert before == {path: path.stat().st_mtime_ns for path in job.folder.path.rglob("*")}


def test_impossible_environments_are_refused_before_anything_is_written(tmp_path):
    with pytest.raises(InvalidInputError, match="control_hz"):
        Job(TINY.with_options(control_hz=300), tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("text", ["{", "[1]", "null?"])
def test_a_folder_of_something_else_is_refused(tmp_path, text):
    (tmp_path / "config.json").write_text(text)
    with pytest.raises(InvalidInputError, match="training run"):
        RunFolder(tmp_path).claim(TINY)


def test_times_add_up_over_interruptions(tmp_path, monkeypatch):
    clock = iter([0.0, 2.0, 10.0, 13.5])
    monkeypatch.setattr("trainers.pipeline.run_folder.time.monotonic", lambda: next(clock))
    folder = RunFolder(tmp_path)
    folder.claim(TINY)
    with pytest.raises(KeyboardInterrupt), folder.stage("clone"):
        raise KeyboardInterrupt
    later = RunFolder(tmp_path)
    later.claim(TINY)
    with later.stage("clone"):
        pass
    assert later.seconds == {"clone": 5.5}


def test_the_paper_literal_baseline_is_left_out_where_it_would_be_the_policy_again():
    assert baseline_names(TINY) == ["pooled"]
    assert baseline_names(JobConfig()) == ["pooled", "paper_literal"]
