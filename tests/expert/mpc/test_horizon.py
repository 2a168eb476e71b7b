"""The MPC's problem of one state: posed where the robot stands, facing where it does."""

from dataclasses import replace

import numpy as np
import pytest

from experts.mpc.horizon import Horizon, pose_horizon
from experts.mpc.srbd import FORCE_UNIT
from experts.planning.footholds import FootholdRule
from experts.planning.nominal_motion import nominal_motion, standing_motion
from experts.robot_model import RobotModel
from go1_mtl_gym import robot
from go1_mtl_gym.sensing.state import RobotState

STEPS, HEIGHT = 16, 0.28
MODEL = RobotModel()


def posed(state: RobotState) -> Horizon:
    gait = state.gait
    motion = standing_motion(gait) if state.standing else nominal_motion(gait, (0.127, 0.394, 0.423), 0.257)
    velocity = state.linear_velocity_w[:2]
    return pose_horizon(state, MODEL.dynamics(state), motion, velocity, FootholdRule(), HEIGHT, STEPS)


def test_it_begins_at_the_origin_and_faces_ahead(driven):
    for state in driven.states:
        horizon = posed(state)
        np.testing.assert_allclose(horizon.x0[2:5], 0.0, atol=1e-12)
        np.testing.assert_allclose(horizon.reference[0, 2:5], 0.0, atol=1e-12)
        assert horizon.dt * STEPS == pytest.approx(state.gait.period)


def test_a_standing_robot_has_its_feet_under_it_and_a_quarter_of_its_weight_on_each(standing):
    facing = replace(standing, quat_wxyz=np.array([np.cos(0.5), 0, 0, np.sin(0.5)]))
    horizon = posed(facing)
    np.testing.assert_array_equal(horizon.contact, 1.0)
    np.testing.assert_allclose(horizon.feet[..., :2], np.tile(robot.NOMINAL_FOOT_B[:, :2], (STEPS, 1, 1)), atol=0.03)
    forces = horizon.nominal.reshape(STEPS, 4, 3) * FORCE_UNIT
    np.testing.assert_allclose(forces, np.tile([0, 0, robot.MASS * 9.81 / 4], (STEPS, 4, 1)), atol=1e-9)


def test_nominal_forces_carry_the_weight_and_feet_in_the_air_have_none(driven):
    for state in driven.states:
        horizon = posed(state)
        forces = horizon.nominal.reshape(STEPS, 4, 3) * FORCE_UNIT
        assert forces[..., 2].sum(axis=1).mean() == pytest.approx(robot.MASS * 9.81, rel=0.15)
        assert not forces[horizon.contact == 0].any()


def test_the_reference_turns_the_nominal_forces(driven):
    """Sideways forces point to the body's sides, wherever the commanded turn will have taken these."""
    state = replace(driven.states[-1], command=np.array([0.2, 0.0, 0.8]))
    straight = replace(state, command=np.array([0.2, 0.0, 0.0]))
    turned, ahead = (posed(s).nominal.reshape(STEPS, 4, 3)[..., :2] @ [1, 1j] for s in (state, straight))
    yaw = posed(state).reference[:-1, 2] - posed(straight).reference[:-1, 2]
    np.testing.assert_allclose(turned, ahead * np.exp(1j * yaw)[:, None], atol=1e-12)
    np.testing.assert_allclose(yaw, 0.8 * posed(state).dt * np.arange(STEPS), atol=1e-12)


def test_nominal_forces_carry_the_payload(standing):
    loaded = posed(replace(standing, payload_kg=3.0))
    lifting = loaded.nominal.reshape(STEPS, 4, 3)[:, :, 2].sum(axis=1) * FORCE_UNIT
    np.testing.assert_allclose(lifting, (robot.MASS + 3.0) * robot.GRAVITY, rtol=1e-3)
    assert loaded.mass == robot.MASS + 3.0
