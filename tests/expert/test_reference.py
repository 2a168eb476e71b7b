"""The body reference: commands integrated from the present, plus the nominal motion; no memory."""

from dataclasses import replace

import numpy as np
import pytest

from experts.nominal import nominal_motion
from experts.reference import BodyReference, body_reference
from go1_mtl_gym import GAITS
from go1_mtl_gym.state import RobotState

HEIGHT, DT, STEPS = 0.28, 0.025, 16


def turned(state: RobotState, yaw: float) -> RobotState:
    return replace(state, quat_wxyz=np.array([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]))


def reference(state: RobotState, com=(1.0, 2.0, 0.25), gait="trot", dt=DT, steps=STEPS) -> BodyReference:
    state = replace(state, gait=GAITS[gait])
    return body_reference(state, np.array(com), nominal_motion(GAITS[gait], 0.127, 0.394), HEIGHT, dt, steps)


def test_straight_ahead_by_hand(standing):
    ref = reference(replace(standing, command=np.array([0.5, -0.1, 0.0])))
    np.testing.assert_allclose(ref.com_w[:, 0], 1.0 + 0.5 * 0.025 * np.arange(17))
    np.testing.assert_allclose(ref.com_w[:, 1], 2.0 - 0.1 * 0.025 * np.arange(17))
    np.testing.assert_allclose(ref.velocity_w[:, :2], np.tile([0.5, -0.1], (17, 1)))
    assert not ref.rpy[:, 2].any() and ref.states.shape == (17, 12)
    np.testing.assert_allclose(ref.com_w[:, 2], HEIGHT, atol=1e-3)  # a trot's nominal motion is level


def test_commands_are_in_the_heading_frame(standing):
    ref = reference(replace(turned(standing, np.pi / 2), command=np.array([0.5, 0.2, 0.0])))
    np.testing.assert_allclose(ref.velocity_w[:, :2], np.tile([-0.2, 0.5], (17, 1)), atol=1e-12)


def test_turning_walks_a_circle(standing):
    state = replace(standing, command=np.array([0.5, 0.0, 1.0]))
    ref = reference(state)
    time = DT * np.arange(17)
    circle = np.stack([1.0 + 0.5 * np.sin(time), 2.0 + 0.5 * (1 - np.cos(time))], axis=1)  # radius v / omega
    np.testing.assert_allclose(ref.rpy[:, 2], time, atol=1e-12)
    np.testing.assert_allclose(ref.com_w[:, :2], circle, atol=3e-5)
    np.testing.assert_allclose(ref.omega_w[:, 2], 1.0)


@pytest.mark.parametrize("gait", GAITS)
def test_velocity_is_the_derivative_of_position(standing, gait):
    state = replace(turned(standing, 0.4), command=np.array([0.5, 0.2, 0.8]), phase=0.3)
    ref = reference(state, gait=gait, dt=5e-4, steps=800)
    numeric = np.diff(ref.com_w, axis=0) / 5e-4
    middle = (ref.velocity_w[1:] + ref.velocity_w[:-1]) / 2
    np.testing.assert_allclose(numeric[:, :2], middle[:, :2], atol=1e-9)
    np.testing.assert_allclose(numeric[:, 2], middle[:, 2], atol=0.05)


@pytest.mark.parametrize("gait", GAITS)
def test_omega_is_the_nominal_rate_turned_by_the_yaw(standing, gait):
    state = replace(turned(standing, 0.4), command=np.array([0.0, 0.0, 0.8]), phase=0.3)
    ref = reference(state, gait=gait)
    motion = nominal_motion(GAITS[gait], 0.127, 0.394)
    deviation, rate = motion.at(0.3 + DT * np.arange(17) / GAITS[gait].period)
    np.testing.assert_allclose(ref.rpy[:, :2], deviation[:, :2])
    yaw = 0.4 + 0.8 * DT * np.arange(17)
    axes = np.stack([np.stack([np.cos(yaw), np.sin(yaw)], 1), np.stack([-np.sin(yaw), np.cos(yaw)], 1)], 1)
    np.testing.assert_allclose(ref.omega_w[:, :2], np.einsum("ki,kij->kj", rate[:, :2], axes), atol=1e-12)


def test_reference_begins_where_the_robot_is(standing):
    ref = reference(turned(standing, -2.5), com=(7.0, -3.0, 0.2))
    np.testing.assert_allclose([*ref.com_w[0, :2], ref.rpy[0, 2]], [7.0, -3.0, -2.5])
    assert ref.com_w[0, 2] == pytest.approx(HEIGHT, abs=1e-3), "the height does not start from the robot's"


def test_moving_and_turning_the_robot_moves_and_turns_the_reference(standing):
    state = replace(standing, command=np.array([0.4, 0.1, 0.3]))
    here, there = reference(state, com=(0, 0, 0.28)), reference(turned(state, 1.1), com=(5, 6, 0.28))
    cos, sin = np.cos(1.1), np.sin(1.1)
    R = np.array([[cos, -sin], [sin, cos]])
    np.testing.assert_allclose(there.com_w[:, :2], here.com_w[:, :2] @ R.T + [5, 6], atol=1e-12)
    np.testing.assert_allclose(there.velocity_w[:, :2], here.velocity_w[:, :2] @ R.T, atol=1e-12)
    np.testing.assert_allclose(there.omega_w[:, :2], here.omega_w[:, :2] @ R.T, atol=1e-12)


def test_the_present_velocity_leaves_no_trace(standing):
    fast = replace(standing, linear_velocity_w=np.array([1.0, 1, 1]), angular_velocity_b=np.ones(3))
    np.testing.assert_array_equal(reference(fast).states, reference(standing).states)
