"""The body reference: commands integrated from the present, plus the nominal motion; no memory."""

from dataclasses import replace

import numpy as np
import pytest

from experts.planning.body_reference import body_reference
from experts.planning.nominal_motion import NominalMotion, nominal_motion, standing_motion
from go1_mtl_gym import GAITS
from go1_mtl_gym.sensing.state import RobotState

HEIGHT, DT, STEPS = 0.28, 0.025, 16
RPY, COM, OMEGA, VELOCITY = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
TIME = DT * np.arange(STEPS + 1)


def motion(gait: str) -> NominalMotion:
    return nominal_motion(GAITS[gait], (0.127, 0.394, 0.423), 0.257)


def reference(state: RobotState, com=(1.0, 2.0, 0.25), gait="trot", yaw=0.0, dt=DT, steps=STEPS) -> np.ndarray:
    state = replace(state, gait=GAITS[gait])
    return body_reference(state, yaw, np.array(com), motion(gait), HEIGHT, dt, steps)


def test_straight_ahead_by_hand(standing):
    x = reference(replace(standing, command=np.array([0.5, -0.1, 0.0])))
    assert x.shape == (17, 12)
    np.testing.assert_allclose(x[:, 3], 1.0 + 0.5 * TIME, atol=1e-5)  # a trot's nominal motion is level
    np.testing.assert_allclose(x[:, 4], 2.0 - 0.1 * TIME, atol=1e-5)
    np.testing.assert_allclose(x[:, 9:11], np.tile([0.5, -0.1], (17, 1)), atol=1e-4)
    np.testing.assert_allclose(x[:, 5], HEIGHT, atol=1e-3)
    np.testing.assert_allclose(x[:, RPY], 0, atol=1e-3)


def test_commands_are_in_the_heading_frame(standing):
    x = reference(replace(standing, command=np.array([0.5, 0.2, 0.0])), yaw=np.pi / 2)
    np.testing.assert_allclose(x[:, 9:11], np.tile([-0.2, 0.5], (17, 1)), atol=1e-4)


def test_turning_walks_a_circle(standing):
    x = reference(replace(standing, command=np.array([0.5, 0.0, 1.0])))
    circle = np.stack([1.0 + 0.5 * np.sin(TIME), 2.0 + 0.5 * (1 - np.cos(TIME))], axis=1)  # radius v / omega
    np.testing.assert_allclose(x[:, 2], TIME, atol=1e-4)
    np.testing.assert_allclose(x[:, 3:5], circle, atol=3e-5)
    np.testing.assert_allclose(x[:, 8], 1.0, atol=5e-3)


@pytest.mark.parametrize("gait", GAITS)
def test_velocity_is_the_derivative_of_position(standing, gait):
    state = replace(standing, command=np.array([0.5, 0.2, 0.8]), phase=0.3)
    x = reference(state, gait=gait, yaw=0.4, dt=5e-4, steps=800)
    numeric = np.diff(x[:, COM], axis=0) / 5e-4
    middle = (x[1:, VELOCITY] + x[:-1, VELOCITY]) / 2
    np.testing.assert_allclose(numeric[:, 2], middle[:, 2], atol=0.05)  # nominal samples, interpolated linearly
    np.testing.assert_allclose(numeric[:, :2], middle[:, :2], atol=0.05)


@pytest.mark.parametrize("gait", GAITS)
def test_the_nominal_motion_is_turned_by_the_heading(standing, gait):
    phase = 0.3 + TIME / GAITS[gait].period
    still, moving = standing_motion(GAITS[gait]), motion(gait)
    state = replace(standing, command=np.array([0.3, 0.1, 0.8]), phase=0.3, gait=GAITS[gait])
    arguments = 0.4, np.array([1.0, 2.0, 0.25])
    level = body_reference(state, *arguments, still, HEIGHT, DT, STEPS)
    x = body_reference(state, *arguments, moving, HEIGHT, DT, STEPS)
    deviation = moving.at(phase)
    yaw = 0.4 + 0.8 * TIME
    heading = np.stack([np.stack([np.cos(yaw), np.sin(yaw)], 1), np.stack([-np.sin(yaw), np.cos(yaw)], 1)], 1)
    np.testing.assert_allclose(x[:, :2], deviation[:, :2], atol=1e-12)
    np.testing.assert_allclose(x[:, 2] - yaw, deviation[:, 2] - deviation[0, 2], atol=1e-12)
    np.testing.assert_allclose(x[:, 5], HEIGHT + deviation[:, 5], atol=1e-12)
    np.testing.assert_allclose(x[:, 11], deviation[:, 11], atol=1e-12)
    np.testing.assert_allclose(x[:, 8], 0.8 + deviation[:, 8], atol=1e-12)
    for at, parts in ((9, slice(9, 11)), (6, slice(6, 8))):
        turned = np.einsum("ki,kij->kj", deviation[:, parts], heading)
        np.testing.assert_allclose((x - level)[:, at : at + 2], turned, atol=1e-12)
    sway = np.einsum("ki,kij->kj", deviation[:, 3:5], heading)
    np.testing.assert_allclose((x - level)[:, 3:5], sway - sway[0], atol=1e-12)


def test_reference_begins_where_the_robot_is(standing):
    for gait in ("trot", "pace"):
        x = reference(standing, com=(7.0, -3.0, 0.2), yaw=-2.5, gait=gait)
        np.testing.assert_allclose(x[0, [3, 4, 2]], [7.0, -3.0, -2.5], atol=1e-12)
        assert x[0, 5] == pytest.approx(HEIGHT, abs=1e-3), "the height does not start from the robot's"


def test_moving_and_turning_the_robot_moves_and_turns_the_reference(standing):
    state = replace(standing, command=np.array([0.4, 0.1, 0.3]))
    here = reference(state, com=(0, 0, 0.28), gait="pace")
    there = reference(state, com=(5, 6, 0.28), yaw=1.1, gait="pace")
    cos, sin = np.cos(1.1), np.sin(1.1)
    R = np.array([[cos, -sin], [sin, cos]])
    np.testing.assert_allclose(there[:, 3:5], here[:, 3:5] @ R.T + [5, 6], atol=1e-12)
    for at in (6, 9):
        np.testing.assert_allclose(there[:, at : at + 2], here[:, at : at + 2] @ R.T, atol=1e-12)
    np.testing.assert_allclose(there[:, RPY], here[:, RPY] + [0, 0, 1.1], atol=1e-12)


def test_the_present_velocity_leaves_no_trace(standing):
    fast = replace(standing, linear_velocity_w=np.array([1.0, 1, 1]), angular_velocity_b=np.ones(3))
    np.testing.assert_array_equal(reference(fast), reference(standing))
