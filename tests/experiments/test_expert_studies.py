"""Studies of the expert: what is counted, when pushes come, and metrics of contacts and effort by hand."""

import dataclasses

import numpy as np
import pytest

from experiments.expert import lab as expert_lab
from experiments.expert import limits, steady, timing
from experiments.results import Results
from go1_mtl_gym import BUILT_IN_TASKS, TASKS, Gait, InvalidInputError, robot
from go1_mtl_gym.env import Go1Env
from tests.experiments.published import FOLDER

HOP = Gait("hop", period=0.4, duty=0.5, offsets=(0.0, 0.0, 0.0, 0.0))


class Faulty:
    """An expert whose third answer is NaN and whose fourth is an exception."""

    def __init__(self, gains, hold_s):
        self.counters = dataclasses.replace(expert_lab.experts.NMPCExpert().counters)
        self.calls = 0

    def reset(self, state):
        self.counters.iterations = 0

    def action(self, state):
        self.calls += 1
        self.counters.iterations += 7
        if self.calls == 4:
            raise ZeroDivisionError
        return robot.HOME_POSE * (np.nan if self.calls == 3 else 1.0)


def test_every_bad_answer_is_counted_and_the_walk_goes_on():
    lab = expert_lab.Lab(make_expert=Faulty)
    lab.begin("trot", (0.0, 0.0, 0.0))
    assert lab.walk(0.1)
    lab.begin("trot", (0.0, 0.0, 0.0), "again")
    assert lab.walk(0.1)
    ledger = lab.settle()
    counted = [ledger[name] for name in ("calls", "bad_actions", "unhandled", "iterations")]
    assert counted == [10, 1, 1, 70]
    assert lab.settle()["iterations"] == 70, "counted once"


def test_the_course_accepts_what_the_environment_refuses():
    fast = (2.4, 0.0, 0.0)
    with pytest.raises(InvalidInputError):
        Go1Env("trot").reset(seed=0, options={"command": fast})
    course = expert_lab.Course("trot")
    _, info = course.reset(seed=0, options={"command": fast})
    assert info["command"].tolist() == list(fast) and info["task"] == "trot"
    assert course.step(np.zeros(12))[4]["filtered_command"][0] > 0.0
    course.reset(seed=0)
    assert (np.abs(course.step(np.zeros(12))[4]["command"]) <= TASKS["trot"].command_range).all()


def test_a_search_for_the_largest_command_may_pass_the_environments_limit():
    beyond = 1.2 * TASKS["trot"].command_limit[0]
    errors = limits.episodes(expert_lab.Lab(), "trot", "vx", beyond, trials=1, seconds=2.5, seed=0)
    assert errors is not None and np.isfinite(errors).all()


def test_a_lab_that_was_used_before_gives_the_same_walk():
    fresh, used = expert_lab.Lab(), expert_lab.Lab()
    used.begin("jump", (0.2, 0.1, 0.3), "first")
    used.walk(0.5)
    ends = []
    for lab in (fresh, used):
        lab.begin("trot", (0.4, 0.0, 0.0), "second")
        assert lab.walk(0.5)
        ends.append(lab.env.simulation.snapshot())
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize(
    ("falls_from", "tracks_to", "survived", "tracked", "at_cap"),
    [(1.65, 1.25, 1.5, 1.1, False), (9.0, 9.0, 2.5, 2.5, True), (0.55, 0.35, 0.5, 0.3, False), (0.0, 0.0, 0, 0, False)],
)
def test_the_largest_command_is_found(monkeypatch, falls_from, tracks_to, survived, tracked, at_cap):
    def episodes(lab, task, axis, level, trials, seconds, seed):
        return None if level >= falls_from else (0.1 if level <= tracks_to else 0.2, 0.1)

    monkeypatch.setattr(limits, "episodes", episodes)
    study = limits.Limits(limits.LimitOptions(axes=("vx",)))
    (found,) = study.measure_in(None, "trot", 0)
    assert found["survived_to"] == pytest.approx(survived) and found["tracked_to"] == pytest.approx(tracked)
    assert found["at_cap"] == at_cap


def test_a_push_comes_at_its_phase_and_in_its_direction(monkeypatch):
    lab, pushes = expert_lab.Lab(), []
    monkeypatch.setattr(lab.env, "push", lambda delta: pushes.append((lab.env.state.phase, delta)))
    options = limits.PushOptions(before_s=0.2, after_s=0.02)
    for k in range(8):
        assert limits.survives(lab, "trot", "left", 0.5, k, options, 0)
    per_step = lab.env.control_s / TASKS["trot"].gait.period
    assert len(pushes) == 8 and all((phase - k / 8 + 1e-6) % 1.0 < per_step for k, (phase, _) in enumerate(pushes))
    for _, delta in pushes:
        np.testing.assert_allclose(delta, (0.0, 0.5, 0.0), atol=0.05)


def test_contacts_that_are_late_by_20_ms():
    phase = np.mod(np.arange(4000) / 400 + 1e-9, 1.0)
    contacts = HOP.stance(np.mod(phase - 20 / 400, 1.0))
    metrics = steady.contact_metrics(contacts, phase, HOP)
    assert metrics["touchdown_lag_s"] == metrics["liftoff_lag_s"] == pytest.approx(0.020)
    assert metrics["contact_agreement"] == pytest.approx(0.9)
    assert metrics["flight_fraction"] == metrics["planned_flight_fraction"] == pytest.approx(0.5)
    legs = steady.contact_intervals(contacts, phase, HOP, cycles=2)
    assert legs[0] == [[0.05, 0.55], [1.05, 1.55]] and len(legs) == 4


def test_effort_and_errors_of_a_made_up_walk():
    n = 1000
    series = {
        "torque": np.full((n, 12), 10.0),
        "joint_velocity": np.tile([1.0, -1.0], (n, 6)),
        "velocity": np.tile([0.5, 0.0, 0.1], (n, 1)),
        "wanted": np.tile([0.4, 0.0, 0.0], (n, 1)),
        "rpy": np.radians(np.linspace([-2.0, -3.0, 0.0], [4.0, 5.0, 0.0], n)),
        "height": np.full(n, 0.3),
    }
    series["torque"][: n // 2, 2] = robot.TORQUE_LIMIT[2]
    metrics = steady.body_metrics(series)
    assert metrics["saturated_fraction"] == pytest.approx(1 / 24)
    power = 120 + (robot.TORQUE_LIMIT[2] - 10) / 2
    assert metrics["power_w"] == pytest.approx(power)
    assert metrics["cost_of_transport"] == pytest.approx(power / (robot.MASS * robot.GRAVITY * 0.5))
    assert metrics["rms_velocity_error"] == pytest.approx(0.1) and metrics["rms_yaw_rate_error"] == pytest.approx(0.1)
    np.testing.assert_allclose(metrics["roll_deg"] + metrics["pitch_deg"], [-2, 4, -3, 5])


def test_the_recorder_sees_every_millisecond_and_leaves_no_trace():
    lab = expert_lab.Lab()
    lab.begin("trot", (0.0, 0.0, 0.0))
    with steady.Recorder(lab) as recorder:
        lab.step()
    series = recorder.series(0.0)
    assert series["torque"].shape == (20, 12) and series["contacts"].shape == (20, 4)
    assert series["phase"][-1] == pytest.approx(lab.env.state.phase)
    lab.step()
    assert len(recorder.series(0.0)["phase"]) == 20


def test_calls_are_timed_in_turns():
    order = []
    calls = {"a": lambda state: order.append(("a", state)), "b": lambda state: (order.append(("b", state)), 1.5)[1]}
    times = timing.interleaved(calls, [0, 1])
    assert order == [("a", 0), ("b", 0), ("a", 1), ("b", 1)]
    assert times["b"].tolist() == [1.5, 1.5] and (times["a"] < 1.0).all()
    assert timing.quantiles(times["b"]) == {"median_ms": 1500.0, "p99_ms": 1500.0}


@pytest.mark.parametrize("task", BUILT_IN_TASKS)
def test_the_environment_accepts_what_the_published_limits_say_is_survived(task):
    survived = {
        own["condition"]: own["survived_to"] for own in Results.read(FOLDER / "expert_limits.json").of(task=task)
    }
    ahead = min(survived["vx"], survived["-vx"])
    assert TASKS[task].command_limit == (ahead, survived["vy"], survived["yaw"])


@pytest.mark.parametrize("task", BUILT_IN_TASKS)
def test_an_operator_pushes_as_hard_as_the_published_results_say_is_survived(task):
    largest = {own["condition"]: own["largest"] for own in Results.read(FOLDER / "expert_pushes.json").of(task=task)}
    sideways = min(largest["left"], largest["right"])
    assert TASKS[task].push_limit == (largest["forward"], largest["backward"], sideways)
