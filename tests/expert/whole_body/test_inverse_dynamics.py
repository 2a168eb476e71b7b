"""Joint torques put back into the full rigid-body dynamics: they do what was asked."""

import numpy as np
import pytest

from experts.robot_model import RobotModel
from experts.whole_body.inverse_dynamics import joint_torques
from experts.whole_body.request import STANCE_DAMPING
from go1_mtl_gym import robot

STANCES = [(True,) * 4, (True, False, False, True), (True, True, True, False), (False,) * 4]


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


def request(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Gentle forces (4, 3) and swing accelerations (4, 3)."""
    forces = rng.normal(0, 5, (4, 3)) + [0, 0, 40.0]
    return forces, rng.normal(0, 10, (4, 3))


@pytest.mark.parametrize("stance", STANCES, ids=lambda s: "".join("_X"[foot] for foot in s))
def test_torques_give_the_feet_the_accelerations_asked_for(model, trotting, stance):
    rng, stance = np.random.default_rng(0), np.array(stance)
    for state in trotting.states:
        dynamics = model.dynamics(state)
        forces, swing = request(rng)
        torque, joint_acceleration = joint_torques(dynamics, forces, stance, swing)
        assert (np.abs(torque) < robot.TORQUE_LIMIT).all(), "not saturated"
        push = dynamics.jacobian.T @ np.where(stance[:, None], forces, 0.0).ravel()
        vdot = np.linalg.solve(dynamics.mass_matrix, np.r_[np.zeros(6), torque] + push - dynamics.bias)
        np.testing.assert_allclose(vdot[6:], joint_acceleration, atol=1e-6)
        feet = (dynamics.jacobian @ vdot).reshape(4, 3) + dynamics.drift
        np.testing.assert_allclose(feet[~stance], swing[~stance], atol=1e-6)
        np.testing.assert_allclose(feet[stance], -STANCE_DAMPING * dynamics.feet_velocity_w[stance], atol=1e-6)


def test_base_accelerates_as_newton_says(model, standing):
    """Without swing feet the total momentum changes by the ground forces and gravity alone."""
    dynamics = model.dynamics(standing)
    forces = np.tile([2.0, -1.0, 40.0], (4, 1))
    torque, _ = joint_torques(dynamics, forces, np.ones(4, bool), np.zeros((4, 3)))
    push = dynamics.jacobian.T @ forces.ravel()
    vdot = np.linalg.solve(dynamics.mass_matrix, np.r_[np.zeros(6), torque] + push - dynamics.bias)
    momentum_rate = dynamics.mass_matrix[:3] @ vdot  # at rest and level: of the total linear momentum
    np.testing.assert_allclose(momentum_rate, forces.sum(axis=0) - [0, 0, robot.MASS * 9.81], atol=1e-6)


def test_weight_on_four_legs_gives_the_statics_torques(model, standing):
    dynamics = model.dynamics(standing)
    forces = np.tile([0.0, 0.0, robot.MASS * 9.81 / 4], (4, 1))
    torque, acceleration = joint_torques(dynamics, forces, np.ones(4, bool), np.zeros((4, 3)))
    calf = 0.213 * np.sin(0.9) * (robot.MASS * 9.81 / 4)  # lever of the foot behind the knee
    assert torque[[2, 5, 8, 11]] == pytest.approx(calf, rel=0.05)
    assert np.abs(acceleration).max() < 10


@pytest.mark.parametrize("size", [500.0, 1e5])
def test_torques_stay_within_the_limits(model, trotting, size):
    rng = np.random.default_rng(1)
    for state in trotting.states:
        dynamics = model.dynamics(state)
        torque, _ = joint_torques(dynamics, rng.normal(0, size, (4, 3)), np.array([1, 0, 0, 1], bool), np.zeros((4, 3)))
        assert (np.abs(torque) <= robot.TORQUE_LIMIT).all()
        assert (np.abs(torque) == robot.TORQUE_LIMIT).any()


def test_forces_in_the_air_and_accelerations_on_the_ground_do_not_matter(model, trotting):
    stance = np.array([True, False, False, True])
    dynamics = model.dynamics(trotting.states[2])
    forces, swing = request(np.random.default_rng(2))
    expected = joint_torques(dynamics, forces, stance, swing)
    forces[~stance], swing[stance] = 1e6, -1e6
    for ours, theirs in zip(joint_torques(dynamics, forces, stance, swing), expected):
        np.testing.assert_array_equal(ours, theirs)
