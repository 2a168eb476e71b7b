"""What the student's report measures: its searches by hand, and what is passed on to the evaluation."""

import dataclasses
import math
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import trainers
from go1_mtl_gym import TASKS, robot
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.sensing.observation import SensorNoise
from go1_mtl_gym.sensing.state_noise import EstimatorNoise
from trainers.evaluation.metrics import wilson_interval

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

from expert_report import limits as expert_limits  # noqa: E402
from student_report import lab as student_lab  # noqa: E402
from student_report import parts as student_parts  # noqa: E402
from student_report import pushes as student_pushes  # noqa: E402
from student_report import robustness as student_robustness  # noqa: E402

HOME = ActionMap.for_gains(PDGains()).from_radians(robot.HOME_POSE)


class Idle:
    """A policy that stands."""

    env_kwargs = {"tasks": ("trot", "walk"), "control_hz": 100}

    def predict(self, obs, deterministic=False):
        return HOME.astype(np.float32), None


def result(fallen, success, errors=None):
    """Closed loop with these episodes."""
    records = [
        trainers.EpisodeRecord(0, ((0.0, 0.0, 0.0),), 1.0, fell, error, 0.0, (0.0, 0.0, 0.0, 0.0), good)
        for fell, good, error in zip(fallen, success, errors or [0.1] * len(fallen))
    ]
    return trainers.ClosedLoopResult("trot", 1.0, tuple(records))


def test_the_summary_counts():
    found = student_lab.summary(
        result([False, False, True, False], [True, False, False, True], [0.1, 0.3, math.nan, 0.2])
    )
    assert (found["trials"], found["survived"], found["succeeded"]) == (4, 3, 2)
    assert (found["survival_rate"], found["success_rate"]) == (0.75, 0.5)
    assert found["velocity_error"] == pytest.approx(0.2)
    assert found["survival_interval"] == wilson_interval(3, 4) and found["success_interval"] == wilson_interval(2, 4)


def test_quantities_are_passed_on_one_by_one(monkeypatch):
    calls = []

    def evaluate(who, task, episodes, seconds, seed, **kwargs):
        calls.append((who, task, episodes, seconds, seed, kwargs))
        return result([False], [True])

    monkeypatch.setattr(trainers, "evaluate", evaluate)
    config = student_robustness.RobustnessConfig(episodes=3, every=2)
    found = student_robustness.robustness("expert", "walk", "friction", config, 7, kp=40.0)
    assert [own["value"] for own in found["levels"]] == [0.4, 0.7, 1.0]
    assert calls[1] == ("expert", "walk", 3, 10.0, 7, {"command_interval": 5.0, "kp": 40.0, "friction": 0.7})


def test_noise_is_the_sensors_or_the_estimators():
    assert student_robustness.world("noise", 1.0, Idle()) == {"noise": SensorNoise()}
    assert student_robustness.world("noise", 1.0, "expert") == {"estimator_noise": EstimatorNoise()}
    doubled = student_robustness.world("noise", 2.0, "expert")["estimator_noise"]
    assert (doubled.dq, doubled.height_bias, doubled.q_bias) == (0.5, 0.02, 0.0)
    none = student_robustness.world("noise", 0.0, Idle())["noise"]
    assert set(dataclasses.astuple(none)) == {0.0}


@pytest.mark.parametrize("quantity", student_robustness.QUANTITIES)
def test_the_environment_accepts_every_value(quantity):
    values = student_robustness.QUANTITIES[quantity].values
    assert len(values) == 5 and list(values) == sorted(set(values))
    for value in values:
        for who in (Idle(), "expert"):
            try:
                Go1Env("trot", **student_robustness.world(quantity, value, who)).close()
            except TypeError as error:
                pytest.skip(f"this environment knows no {quantity}: {error}")


def test_changes_of_gait_are_passed_on(monkeypatch):
    calls = []

    def evaluate_transition(who, first, second, trials=20, seed=1, **kwargs):
        calls.append((first, second, trials, seed, kwargs))
        return result([False] * 18 + [True] * 2, [True] * 15 + [False] * 5)

    monkeypatch.setattr(trainers, "evaluate_transition", evaluate_transition, raising=False)
    section = student_parts.SECTIONS["switching"]
    assert section.config.parts("walk", ("trot", "walk", "jump")) == ("trot", "jump")
    found = section.measure(Idle(), "walk", "trot", section.config, 3, kd=1.0)
    assert (found["trials"], found["survived"], found["succeeded"]) == (20, 18, 15)
    assert calls == [("walk", "trot", 20, 3, {"before_s": 2.0, "after_s": 6.0, "kd": 1.0})]


class Skittle:
    """An environment whose robot falls a while after a kick above a limit, which is lower in every tenth episode."""

    def __init__(self, limit, task, **kwargs):
        self.limit, self.kwargs, self.episodes, self.control_hz = limit, kwargs, 0, kwargs["control_hz"]
        self.unwrapped, self.state = self, SimpleNamespace(rpy=np.array([0.0, 0.0, np.pi / 2]))
        self.kicks, self.closed = [], False

    def reset(self, seed, options):
        self.episodes, self.steps, self.kicked_at = self.episodes + 1, 0, None
        assert options["command"] == (0.3, 0.0, 0.0)
        return np.zeros(1), {}

    def step(self, action):
        self.steps += 1
        fallen = self.kicked_at is not None and self.falls and self.steps > self.kicked_at + 20
        return np.zeros(1), 0.0, fallen, False, {}

    def push(self, delta):
        self.kicks.append((self.steps, delta))
        self.kicked_at, size = self.steps, np.linalg.norm(delta)
        self.falls = size > self.limit or (self.episodes % 10 == 0 and size > 0.5)

    def close(self):
        self.closed = True


@pytest.mark.parametrize(
    ("limit", "trials", "largest", "last"), [(1.1, 20, 1.0, 1.2), (9, 7, 0.4, 0.6), (0.1, 3, 0, 0.2)]
)
def test_the_largest_kick_is_below_the_first_that_too_few_survive(monkeypatch, limit, trials, largest, last):
    made = []
    monkeypatch.setattr(
        student_pushes, "make_env", lambda task, _, **kw: made.append(Skittle(limit, task, **kw)) or made[-1]
    )
    config = student_pushes.KickConfig(trials=trials)
    found = student_pushes.pushes(Idle(), "trot", "left", config, 0)
    assert found["largest"] == pytest.approx(largest) and not found["at_cap"] and made[0].closed
    assert [own["size"] for own in found["sizes"]] == pytest.approx(np.arange(1, round(last / 0.2) + 1) * 0.2)
    assert all(own["survived"] >= 0.9 * trials for own in found["sizes"][:-1])
    assert found["sizes"][-1]["survived"] < 0.9 * trials and made[0].episodes == trials * len(found["sizes"])


def test_kicks_come_at_random_phases_equal_for_all_sizes_and_in_the_heading_frame(monkeypatch):
    env = Skittle(9.0, "trot", control_hz=100)
    monkeypatch.setattr(student_pushes, "make_env", lambda *_, **__: env)
    config = student_pushes.KickConfig(trials=6, grid=2, after_s=0.1)
    found = student_pushes.pushes(Idle(), "trot", "left", config, 0)
    assert found["at_cap"] and found["largest"] == 0.4
    when = [steps for steps, _ in env.kicks]
    assert when[:6] == when[6:] and len(set(when)) > 2
    assert min(when) >= 150 and max(when) <= 150 + round(100 * TASKS["trot"].gait.period)
    np.testing.assert_allclose(env.kicks[0][1], (-0.2, 0.0, 0.0), atol=1e-12)  # left of a robot that looks along y


def test_a_fall_before_the_kick_is_no_survival(monkeypatch):
    env = Skittle(9.0, "trot", control_hz=100)
    monkeypatch.setattr(student_pushes, "make_env", lambda *_, **__: env)
    monkeypatch.setattr(env, "step", lambda action: (np.zeros(1), 0.0, True, False, {}))
    found = student_pushes.pushes(Idle(), "trot", "left", student_pushes.KickConfig(trials=2), 0)
    assert found == {"largest": 0.0, "at_cap": False, "sizes": [{"size": 0.2, "survived": 0, "trials": 2}]}
    assert not env.kicks


def test_a_stand_survives_a_nudge_and_no_blow():
    config = student_pushes.KickConfig(trials=1, step=0.1, grid=1, before_s=0.2, after_s=0.5)
    assert student_pushes.pushes(Idle(), "trot", "left", config, 0)["at_cap"]
    assert student_pushes.pushes(Idle(), "trot", "left", dataclasses.replace(config, step=9.0), 0)["largest"] == 0.0


def test_a_kick_to_the_left_goes_left():
    np.testing.assert_allclose(expert_limits.kick_w("left", 0.5, np.pi / 2), (-0.5, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(expert_limits.kick_w("backward", 2.0, 0.0), (-2.0, 0.0, 0.0), atol=1e-12)


def test_equal_seeds_give_equal_figures():
    config = student_robustness.RobustnessConfig(1, 2.5, 1.0, every=4)
    first, again, other = (student_robustness.robustness(Idle(), "trot", "noise", config, seed) for seed in (1, 1, 2))
    assert first == again and first["levels"][0]["velocity_error"] > 0.0
    assert first["levels"][0]["velocity_error"] != other["levels"][0]["velocity_error"]
