"""Who drives in blocks, when the expert takes over, and what is recorded."""

import numpy as np
import pytest
from stable_baselines3.common.vec_env import DummyVecEnv

from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import SIZE, StubEnv
from tests.trainer.test_collection import LAYOUT, trot_labels
from trainers import BlockCollector, Learner
from trainers.algorithms.dagger_collector import StarvedCollectorError


def drive(collector: BlockCollector) -> list[np.ndarray]:
    """Step with the environments' own experts until all have their rows; the executed actions."""
    obs = collector.reset()
    executed = []
    while not collector.finished:
        obs, *_ = collector.step(np.stack(collector.venv.env_method("expert_action")))
        executed.append(obs[:, LAYOUT["last_action"]])
    return executed


class Student:
    """A policy made from a function of the observations."""

    def __init__(self, actions=lambda obs: np.full((len(obs), 12), 0.1)) -> None:
        self.actions = actions

    def predict(self, obs, deterministic=False):
        assert deterministic
        return self.actions(obs), None


def make_collector(venv, rows, beta=0.5, student=None, **kwargs) -> BlockCollector:
    learner, rng = Learner(student or Student()), np.random.default_rng(0)
    return BlockCollector(venv, learner, beta, "unused", rng, rows_per_env=rows, control_hz=50, **kwargs)


def test_blocks_are_long_and_both_drive():
    venv = DummyVecEnv([lambda: StubEnv(episode_s=100.0)])
    collector = make_collector(venv, 2000)
    learner_drove = np.array([np.allclose(a[0], 0.1) for a in drive(collector)])
    assert 0.3 < learner_drove.mean() < 0.7
    assert collector.learner_fraction == pytest.approx(learner_drove.mean(), abs=1e-3)
    changes = np.flatnonzero(np.diff(learner_drove.astype(int)))
    assert np.diff(changes).min() >= 15 and len(changes) > 10


@pytest.mark.parametrize(("beta", "share"), [(0.0, 1.0), (1.0, 0.0)])
def test_extremes_of_beta(beta, share):
    collector = make_collector(DummyVecEnv([StubEnv]), 100, beta)
    drive(collector)
    assert collector.learner_fraction == share


def test_finished_environments_are_not_recorded():
    venv = DummyVecEnv([StubEnv, lambda: StubEnv("walk")])
    collector = make_collector(venv, np.array([30, 90]), beta=0.0)
    executed = np.array(drive(collector))
    recorded = collector.recorded()
    assert recorded["obs"][:, SIZE:].sum(0).tolist() == [30, 0, 0, 90]
    by_learner = np.isclose(executed, 0.1).all(2).sum(0)
    assert by_learner.tolist() == [30, 90] and collector.learner_fraction == 1.0


def test_end_before_a_fall_is_dropped_and_time_limits_are_not():
    falls = make_collector(DummyVecEnv([lambda: StubEnv(expert_falls_after_s=1.0)]), 60, beta=1.0)
    drive(falls)
    recorded = falls.recorded()
    assert np.flatnonzero(recorded["starts"]).tolist() == [0, 39] and recorded["acts"][:, 2].max() < 0.9
    assert falls.falls == 1, "one in two episodes; the second has its rows before its fall"
    limited = make_collector(DummyVecEnv([lambda: StubEnv(episode_s=0.4)]), 60, beta=1.0)
    drive(limited)
    assert np.flatnonzero(limited.recorded()["starts"]).tolist() == [0, 20, 40]
    assert limited.falls == 0


def test_learner_that_always_falls():
    collector = make_collector(
        DummyVecEnv([StubEnv]), 100, beta=0.0, student=Student(lambda obs: np.ones((len(obs), 12)))
    )
    with pytest.raises(StarvedCollectorError, match="kept"):
        drive(collector)
    assert collector.falls > 100


def one_joint_off(obs: np.ndarray) -> np.ndarray:
    """The stub's expert in a trot, but for 0.2 in the last joint."""
    return trot_labels(obs) + 0.2 * np.eye(12)[11]


def test_takeover_by_the_distance_in_radians():
    half_range = StubEnv().action_map.half_range  # 1.6 rad per unit in the last joint
    distance = 0.2 * 1.6 / np.sqrt(12)
    for limit, share in ((1.02 * distance, 1.0), (0.98 * distance, 0.0)):
        student, safety = Student(one_joint_off), {"half_range": half_range, "takeover_rad": limit}
        collector = make_collector(DummyVecEnv([StubEnv]), 200, 0.0, student, **safety)
        drive(collector)
        assert collector.learner_fraction == share and (collector.takeovers > 0) == (share == 0.0)
    assert 200 / 50 <= collector.takeovers <= 200 / 15 + 1, "each lasts a block of 0.3 to 1 s"


class Clumsy:
    """The stub's expert in a trot; from 0.6 s of an episode on it falls at the first quarter of a cycle."""

    def predict(self, obs, state=None, episode_start=None, deterministic=False):
        count = np.where(episode_start, 0, np.zeros(len(obs), int) if state is None else state) + 1
        acts = trot_labels(obs)
        acts[(count > 30) & (obs[:, 37] > 0.99), 2] = 1.0
        return acts, count


def test_takeover_prevents_falls_and_keeps_the_labels():
    free = make_collector(DummyVecEnv([StubEnv, StubEnv]), 150, 0.0, Clumsy())
    drive(free)
    assert free.falls >= 6 and free.takeovers == 0 and free.learner_fraction == 1.0
    safety = {"half_range": StubEnv().action_map.half_range, "takeover_rad": 0.05}
    safe = make_collector(DummyVecEnv([StubEnv, StubEnv]), 150, 0.0, Clumsy(), **safety)
    drive(safe)
    assert safe.falls == 0 and safe.takeovers >= 2 and 0.2 < safe.learner_fraction < 0.9
    recorded = safe.recorded()
    assert recorded["starts"].sum() == 2
    np.testing.assert_allclose(recorded["acts"], trot_labels(recorded["obs"]), atol=1e-5)


@pytest.mark.parametrize("kwargs", [{"takeover_rad": 0.1}, {"takeover_rad": 0.0, "half_range": np.ones(12)}])
def test_takeover_without_a_scale_or_a_limit(kwargs):
    with pytest.raises(InvalidInputError, match="takeover_rad"):
        make_collector(DummyVecEnv([StubEnv]), 10, **kwargs)


class Counting:
    """A policy whose state is the number of observations of each environment's episode so far."""

    def __init__(self) -> None:
        self.counts = []

    def predict(self, obs, state=None, episode_start=None, deterministic=False):
        count = np.where(episode_start, 0, np.zeros(len(obs), int) if state is None else state) + 1
        self.counts.append(count)
        return np.full((len(obs), 12), 0.1), count


def test_a_state_advances_whoever_drives_and_is_reset_with_the_episode():
    venv = DummyVecEnv([lambda: StubEnv(episode_s=0.4), lambda: StubEnv(episode_s=0.6)])
    student = Counting()
    collector = make_collector(venv, 60, beta=0.7, student=student)
    drive(collector)
    assert 0 < collector.learner_fraction < 1
    steps = np.arange(60)
    np.testing.assert_array_equal(student.counts, np.column_stack([steps % 20 + 1, steps % 30 + 1]))
    collector.reset()
    collector.step(np.zeros((2, 12)))
    assert student.counts[-1].tolist() == [1, 1]
