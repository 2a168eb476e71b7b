"""Collecting demonstrations: right labels, pure, resumable."""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest

from go1_mtl_gym import TASKS, DomainRandomization
from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import HIPS, SIZE, SPEED, THIGHS, StubEnv, make_stub
from trainers import CollectJob, Demonstrations, PerturbationConfig, ShardMismatchError, collect, collect_all, watch
from trainers.data.collection import CollectionError

LAYOUT = {"q": slice(6, 18), "command": slice(34, 37), "phase": slice(37, 39), "last_action": slice(39, 51)}


def trot_labels(obs: np.ndarray) -> np.ndarray:
    """The stub expert's answer in a trot, recomputed from what is seen."""
    offsets = np.array(StubEnv("trot").task.gait.offsets)
    sine, cosine = obs[:, LAYOUT["phase"]].T
    phase = np.arctan2(sine, cosine)[:, None] + 2 * np.pi * offsets
    labels = np.zeros((len(obs), 12))
    labels[:, HIPS] = obs[:, LAYOUT["command"]] / SPEED
    labels[:, THIGHS] = 0.9 * np.sin(phase)
    labels[:, 2::3] = -0.5 * obs[:, LAYOUT["q"]][:, 2::3]
    return labels


@pytest.mark.parametrize("perturbation", [None, PerturbationConfig(noise_rad=0.2)])
def test_labels_belong_to_the_state_seen(perturbation):
    demos = collect("trot", seed=4, seconds=5.0, perturbation=perturbation, make_env=make_stub)
    assert len(demos) == 250 and demos.control_hz == 50 and set(demos.task) == {0}
    np.testing.assert_allclose(demos.acts, trot_labels(demos.obs), atol=1e-5)
    executed, wanted = demos.obs[1:, LAYOUT["last_action"]], demos.acts[:-1]
    assert np.allclose(executed, wanted, atol=1e-6) == (perturbation is None)


def test_pure_function_of_its_arguments():
    one, same = (collect("jump", seed=7, seconds=2.0, make_env=make_stub) for _ in range(2))
    np.testing.assert_array_equal(one.obs, same.obs)
    other = collect("jump", seed=8, seconds=2.0, make_env=make_stub)
    assert not np.array_equal(one.obs, other.obs)


def test_command_is_kept_even_when_perturbed():
    perturbation = PerturbationConfig(command_interval=(0.2, 0.3))
    demos = collect("trot", (0.5, 0.0, 0.0), 0, 10.0, perturbation, make_env=make_stub)
    np.testing.assert_allclose(demos.obs[-1, LAYOUT["command"]], [0.5, 0, 0], atol=1e-3)


def test_rows_of_several_tasks_when_the_task_changes():
    perturbation = PerturbationConfig(task_interval=(0.5, 1.0))
    demos = collect("walk", seed=3, seconds=20.0, perturbation=perturbation, make_env=make_stub)
    assert set(demos.task) == {0, 1, 2, 3} and demos.tasks[demos.task[0]] == "walk"
    stays = np.diff(np.flatnonzero(np.diff(demos.task)))
    assert stays.min() >= 25 and stays.max() <= 51
    again = collect("walk", seed=3, seconds=20.0, perturbation=perturbation, make_env=make_stub)
    np.testing.assert_array_equal(demos.obs, again.obs)


def test_the_go1s_rows_of_several_tasks_have_the_new_tasks_labels():
    perturbation = PerturbationConfig(task_interval=(0.3, 0.6), corner_fraction=0.5, command_interval=(0.2, 0.4))
    kwargs = {"tasks": ("trot", "jump", "walk"), "channels": ("command", "phase"), "randomization": True}
    demos = collect("jump", None, 1, 3.0, perturbation, kwargs)
    assert len(demos) == 150 and set(demos.task) == {0, 1, 2} and demos.tasks[demos.task[0]] == "jump"
    spans = np.array([TASKS[name].command_range for name in demos.tasks])
    assert (np.abs(demos.obs[:, LAYOUT["command"]]) <= spans.max(axis=0)).all()
    assert json.loads(json.dumps(demos.meta["job"])) == demos.meta["job"]


def test_a_job_with_a_randomization_of_ones_own_is_found_again(tmp_path):
    kwargs = {"randomization": DomainRandomization(friction=(0.5, 0.6))}
    job = CollectJob("trot", 0, 1.0, env_kwargs=kwargs)
    first = collect_all([job], tmp_path, make_env=make_stub)[0].stat().st_mtime_ns
    assert collect_all([job], tmp_path, make_env=make_stub)[0].stat().st_mtime_ns == first
    other = dataclasses.replace(job, env_kwargs={"randomization": True})
    with pytest.raises(ShardMismatchError):
        collect_all([other], tmp_path, make_env=make_stub)


def test_end_before_a_fall_is_dropped():
    demos = collect("trot", seed=0, seconds=2.0, env_kwargs={"expert_falls_after_s": 1.0}, make_env=make_stub)
    assert len(demos) == 100
    lengths = [rows.stop - rows.start for rows in demos.episodes()]
    assert lengths == [39, 39, 22]  # 51 steps to the fall less 12
    assert demos.acts[:, 2].max() < 0.9


class Driver:
    """A policy of one frame that lifts legs as the clock says; it falls while the phase is beyond `falls_after`."""

    def __init__(self, falls_after: float = 1.0, **env_kwargs) -> None:
        self.falls_after, self.env_kwargs = falls_after, env_kwargs
        self.contract = StubEnv(**env_kwargs).contract

    def predict(self, obs, deterministic=False):
        assert obs.shape == (SIZE + 4,) and deterministic
        sine, cosine = obs[LAYOUT["phase"]]
        action = np.zeros(12, dtype=np.float32)
        action[1::3] = 0.5 * sine
        action[2] = np.arctan2(-sine, -cosine) / (2 * np.pi) + 0.5 > self.falls_after
        return action, None


def test_watching_records_what_the_driver_saw_and_did_and_asks_no_expert():
    made = []

    def make(*args, **kwargs):
        made.append(make_stub(*args, **kwargs))
        return made[-1]

    rows = watch(Driver(control_hz=100), "trot", 5, 2.0, PerturbationConfig(), 3, make_env=make)
    assert len(rows) == 200 and rows.control_hz == 100 and made[0].unwrapped.asked == 0
    slices = rows.contract.slices
    assert rows.contract.history == 3 and rows.obs.shape[1] == SIZE + 2 * 34 + 4
    np.testing.assert_allclose(rows.acts[:, 1], 0.5 * rows.obs[:, slices["phase"]][:, 0], atol=1e-7)
    executed = rows.obs[1:, slices["last_action"]]
    assert 0.0 < np.abs(executed - rows.acts[:-1]).max() < 0.5, "the world adds its noise to what the driver wants"
    older = rows.obs[:, slices["history"]]
    np.testing.assert_array_equal(older[2:], np.hstack([rows.obs[1:-1, :34], rows.obs[:-2, :34]]))


def test_watching_is_a_pure_function_of_its_arguments():
    one, same, other = (watch(Driver(), "jump", seed, 1.0, make_env=make_stub).obs for seed in (7, 7, 8))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


def test_a_driver_that_falls_is_watched_until_shortly_before():
    rows = watch(Driver(falls_after=0.93), "trot", 0, 1.0, make_env=make_stub)
    lengths = [episode.stop - episode.start for episode in rows.episodes()]
    assert set(lengths[:-1]) == {8} and sum(lengths) == 50  # 20 rows up to phase .95, less 12
    with pytest.raises(CollectionError, match="keeps falling"):
        watch(Driver(falls_after=0.5), "trot", 0, 1.0, make_env=make_stub)


def test_watching_refuses_a_driver_of_several_frames_and_no_time():
    with pytest.raises(InvalidInputError, match="sees 3 frames .*got 1"):
        watch(Driver(history=3), "trot", history=1, make_env=make_stub)
    with pytest.raises(InvalidInputError, match="seconds must be a finite number > 0"):
        watch(Driver(), "trot", 0, 0.0, make_env=make_stub)


def test_watching_refuses_a_driver_of_another_environment():
    with pytest.raises(InvalidInputError, match="the policy and the environment do not.*control_hz: 50 against 100"):
        watch(Driver(), "trot", make_env=make_stub, control_hz=100)


def test_expert_that_always_falls():
    with pytest.raises(CollectionError, match="keeps falling"):
        collect("trot", seconds=4.0, env_kwargs={"expert_falls_after_s": 0.1}, make_env=make_stub)


def test_resume_keeps_good_shards_and_remakes_damaged_ones(tmp_path):
    jobs = [CollectJob("trot", seed, 1.0) for seed in range(3)]
    jobs.append(CollectJob("walk", 0, 1.0, perturbation=PerturbationConfig()))
    paths = collect_all(jobs[:2], tmp_path, make_env=make_stub)
    stamps = [p.stat().st_mtime_ns for p in paths]
    paths[1].write_bytes(b"half")
    paths = collect_all(jobs, tmp_path, make_env=make_stub)
    assert [p.name for p in paths[:3]] == ["trot-clean-000000.npz", "trot-clean-000001.npz", "trot-clean-000002.npz"]
    assert paths[0].stat().st_mtime_ns == stamps[0]
    shards = [Demonstrations.load(p) for p in paths]
    assert [len(s) for s in shards] == [50] * 4 and shards[3].meta["job"] == jobs[3].as_dict()
    np.testing.assert_array_equal(shards[1].obs, collect("trot", seed=1, seconds=1.0, make_env=make_stub).obs)


def test_other_settings_in_the_same_folder(tmp_path):
    job = CollectJob("trot", 0, 1.0)
    collect_all([job], tmp_path, make_env=make_stub)
    with pytest.raises(ShardMismatchError, match="was made from"):
        collect_all([dataclasses.replace(job, seconds=2.0)], tmp_path, make_env=make_stub)


def test_jobs_must_differ(tmp_path):
    with pytest.raises(InvalidInputError, match="differ"):
        collect_all([CollectJob("trot", 0)] * 2, tmp_path, make_env=make_stub)


@pytest.mark.parametrize(
    ("second", "n_jobs", "message"),
    [
        (CollectJob("walk", 1, 1.0, (3.0, 0.0, 0.0)), 1, "walk"),
        (CollectJob("walk", 1, 0.001), 1, "at least a control period, 0.02 s, got 0.001"),
        (CollectJob("walk", 1, 1.0), 0, "n_jobs"),
    ],
)
def test_what_cannot_be_is_refused_before_the_first_shard(tmp_path, second, n_jobs, message):
    with pytest.raises(InvalidInputError, match=message):
        collect_all([CollectJob("trot", 0, 1.0), second], tmp_path, n_jobs, make_env=make_stub)
    assert not list(tmp_path.iterdir())


def test_worker_processes_make_the_same_shards(tmp_path):
    jobs = [CollectJob("trot", s, 1.0) for s in range(2)]
    here = collect_all(jobs, tmp_path / "here", make_env=make_stub)
    there = collect_all(jobs, tmp_path / "there", n_jobs=2, make_env=make_stub)
    for one, other in zip(here, there):
        np.testing.assert_array_equal(Demonstrations.load(one).obs, Demonstrations.load(other).obs)


@pytest.mark.parametrize(
    "kwargs",
    [
        {"noise_rad": -1},
        {"push_interval": 0},
        {"command_interval": (3, 1)},
        {"task_interval": (0, 1)},
        {"task_interval": 2.0},
        {"corner_fraction": 1.1},
    ],
)
def test_bad_perturbation(kwargs):
    with pytest.raises(InvalidInputError):
        PerturbationConfig(**kwargs)


def test_collecting_does_not_load_torch():
    forbidden = "{'torch', 'imitation', 'pinocchio', 'osqp'}"
    code = f"import sys, trainers.data.collection; assert not {forbidden} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
