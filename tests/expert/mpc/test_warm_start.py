"""What the expert's two remembering options remember."""

from dataclasses import replace

import numpy as np
import pytest

from experts.mpc.frame import WORLD, Frame
from experts.mpc.srbd import FORCE_UNIT
from experts.mpc.warm_start import Recall, Trajectory
from go1_mtl_gym import GAITS

TROT, DT = GAITS["trot"], 0.025
THROUGHOUT = np.ones((4, 4))
REFERENCE, NOMINAL = np.full((5, 12), -1.0), np.full((4, 12), -2.0)


def ramp(time_s: float = 1.0, gait=TROT) -> Trajectory:
    """Every state is its time since 1.0 in intervals, every input the number of its interval."""
    states, inputs = (np.tile(np.arange(float(count))[:, None], (1, 12)) for count in (5, 4))
    return Trajectory(time_s, gait, DT, states, inputs, THROUGHOUT)


@pytest.mark.parametrize(
    ("intervals", "states", "inputs"),
    [
        (0.0, [0, 1, 2, 3, 4], [0, 1, 2, 3]),
        (0.25, [0.25, 1.25, 2.25, 3.25, -1], [0, 1, 2, 3]),
        (0.75, [0.75, 1.75, 2.75, 3.75, -1], [1, 2, 3, -2]),
        (2.0, [2, 3, 4, -1, -1], [2, 3, -2, -2]),
        (9.0, [-1, -1, -1, -1, -1], [-2, -2, -2, -2]),
    ],
)
def test_shifting_by_hand(intervals, states, inputs):
    x, u = ramp().shifted(1.0 + intervals * DT, WORLD, REFERENCE, NOMINAL)
    np.testing.assert_allclose(x, np.tile(np.array(states, float)[:, None], (1, 12)), atol=1e-9)
    np.testing.assert_allclose(u, np.tile(np.array(inputs, float)[:, None], (1, 12)), atol=1e-9)


def test_shifting_leaves_the_trajectory_and_the_reference_alone():
    trajectory = ramp()
    trajectory.shifted(1.05, WORLD, REFERENCE, NOMINAL)
    np.testing.assert_array_equal(trajectory.states, ramp().states)
    assert (REFERENCE == -1).all() and (NOMINAL == -2).all()


@pytest.mark.parametrize(("seconds", "k"), [(0.0, 0), (0.024, 0), (0.025, 1), (0.06, 2), (0.5, 3), (-0.1, 0)])
def test_forces_are_those_of_the_interval(seconds, k):
    np.testing.assert_allclose(ramp().forces_w(1.0 + seconds), np.full((4, 3), k * FORCE_UNIT))


def test_a_foot_that_stands_for_a_part_of_the_interval_pushes_harder_meanwhile():
    """The impulse of the interval is the planned one, until so little is left of it that forces would be a blow."""
    contact = np.tile([1.0, 0.5, 0.1, 0.0], (4, 1))
    forces = replace(ramp(), contact=contact).forces_w(1.0 + 1.5 * DT)
    np.testing.assert_allclose(forces, FORCE_UNIT * np.tile([[1.0], [2.0], [4.0], [4.0]], 3))


def at(standing, time_s: float, gait="trot"):
    return replace(standing, time_s=time_s, gait=GAITS[gait])


def test_the_newest_earlier_trajectory_is_recalled(standing):
    recall, first, second = Recall(), ramp(1.0), ramp(1.02)
    assert recall.before(at(standing, 1.0)) is None
    recall.store(first)
    assert recall.before(at(standing, 1.0)) is None, "not one of the same time"
    assert recall.before(at(standing, 1.02)) is first
    recall.store(second)
    assert recall.before(at(standing, 1.02)) is first, "asked again at the same time: the same answer"
    assert recall.before(at(standing, 1.04)) is second
    recall.store(ramp(1.02))
    assert recall.before(at(standing, 1.02)) is first, "one of the same time takes the other's place"


def test_the_old_the_future_and_another_gaits_are_not_recalled(standing):
    recall = Recall()
    recall.store(ramp(1.0))
    assert recall.before(at(standing, 1.41)) is None, "older than a period"
    assert recall.before(at(standing, 0.5)) is None
    assert recall.before(at(standing, 1.02, "walk")) is None
    assert recall.at(at(standing, 1.02, "walk"), 0.1) is None


def test_a_plan_is_held_for_a_period(standing):
    recall, plan = Recall(), ramp(1.0)
    assert recall.at(at(standing, 1.0), 0.02) is None
    recall.store(plan)
    for time_s, held in ((1.0, True), (1.01, True), (1.019, True), (1.02, False), (1.5, False), (0.99, False)):
        assert (recall.at(at(standing, time_s), 0.02) is plan) == held, time_s


def test_a_trajectory_seen_from_elsewhere_is_the_same_in_the_world():
    plan = ramp()
    frame = Frame(np.array([1.0, 2.0, 0.0]), 0.7)
    states, inputs = plan.shifted(1.0, frame, REFERENCE, NOMINAL)
    np.testing.assert_allclose(WORLD.states(states, frame)[:-1], plan.states[:-1], atol=1e-12)
    seen = Trajectory(1.0, plan.gait, plan.dt, states, inputs, THROUGHOUT, frame)
    np.testing.assert_allclose(seen.forces_w(1.0), plan.forces_w(1.0), atol=1e-12)
