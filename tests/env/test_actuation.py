"""The PD law, its inverse, the actuators in MuJoCo that apply it, and the map of actions."""

import mujoco
import numpy as np
import pytest

from go1_mtl_gym import robot
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sim.simulation import Simulation

GAINS = [PDGains(), PDGains(20.0, 0.5), PDGains(100.0, 5.0)]


def random_states(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joint positions, speeds and torques, uniform within the limits."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(robot.JOINT_LOWER, robot.JOINT_UPPER, (count, 12))
    v = rng.uniform(-robot.SPEED_LIMIT, robot.SPEED_LIMIT, (count, 12))
    tau = rng.uniform(-robot.TORQUE_LIMIT, robot.TORQUE_LIMIT, (count, 12))
    return q, v, tau


def test_pd_law_by_hand():
    gains = PDGains(kp=50.0, kd=2.0)
    tau = gains.torque(np.full(12, 0.3), np.full(12, 0.1), np.full(12, 0.5))
    np.testing.assert_allclose(tau, 50 * 0.2 - 2 * 0.5)
    np.testing.assert_allclose(gains.target(tau, np.full(12, 0.1), np.full(12, 0.5)), 0.3)


@pytest.mark.parametrize("gains", GAINS, ids=str)
def test_target_is_the_inverse_of_torque(gains):
    q, v, tau = random_states(100)
    np.testing.assert_allclose(gains.torque(gains.target(tau, q, v), q, v), tau, atol=1e-11)
    np.testing.assert_allclose(gains.target(gains.torque(q[::-1], q, v), q, v), q[::-1], atol=1e-12)


@pytest.mark.parametrize("gains", GAINS, ids=str)
def test_mujoco_applies_the_law_and_clips_it_at_the_torque_limits(gains):
    simulation = Simulation(gains)
    simulation.reset(robot.HOME_POSE)
    clipped = 0
    rng = np.random.default_rng(2)
    for q, v, _ in zip(*random_states(100, seed=1)):
        target = q + rng.normal(0.0, 1.0, 12)
        simulation.data.qpos[7:], simulation.data.qvel[6:], simulation.data.ctrl[:] = q, v, target
        mujoco.mj_forward(simulation.model, simulation.data)
        free = gains.torque(target, q, v)
        expected = np.clip(free, -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT)
        clipped += (expected != free).sum()
        np.testing.assert_allclose(simulation.data.actuator_force, expected, atol=1e-10)
        np.testing.assert_array_equal(simulation.torque, simulation.data.actuator_force)
        np.testing.assert_allclose(simulation.data.qfrc_actuator[6:], expected, atol=1e-10)
    assert 100 < clipped < 1200, "the draw should test both the linear and the clipped part"


def test_action_range_by_hand():
    action_map = ActionMap.for_gains(PDGains(50.0, 2.0))
    hip = (23.7 + 2 * 30.1) / 50  # 1.678 rad beyond the joint range, of hip and thigh
    calf = (35.55 + 2 * 20.06) / 50  # 1.5134 rad
    assert action_map.to_radians(np.zeros(12)).tolist() == [0.0, 0.9, -1.8] * 4
    expected = [0.863 + hip, 4.501 + hip - 0.9, -1.8 + 2.818 + calf]  # the calf's longer way is downwards
    np.testing.assert_allclose(action_map.half_range, expected * 4)
    np.testing.assert_allclose(action_map.half_range[:3], [2.541, 5.279, 2.5314])
    np.testing.assert_allclose(action_map.to_radians(np.ones(12))[1], 4.501 + hip)
    np.testing.assert_allclose(action_map.to_radians(-np.ones(12))[2], -2.818 - calf)


def test_the_action_map_of_version_0_1_by_hand():
    old = ActionMap.of_version_0_1(PDGains(50.0, 2.0))
    hip, calf = (23.7 + 2 * 30.1) / 50, (35.55 + 2 * 20.06) / 50
    np.testing.assert_allclose(old.center[:3], [0.0, (4.501 - 0.686) / 2, -(2.818 + 0.888) / 2])
    np.testing.assert_allclose(old.half_range[:3], [0.863 + hip, (4.501 + 0.686) / 2 + hip, (2.818 - 0.888) / 2 + calf])


@pytest.mark.parametrize("gains", GAINS, ids=str)
def test_every_torque_within_limits_has_an_action(gains):
    action_map = ActionMap.for_gains(gains)
    q, v, tau = random_states(2000, seed=2)
    target = action_map.to_radians(action_map.from_radians(gains.target(tau, q, v)))
    np.testing.assert_allclose(gains.torque(target, q, v), tau, atol=1e-9)


@pytest.mark.parametrize("gains", GAINS, ids=str)
def test_action_range_is_no_wider_than_it_must_be(gains):
    action_map = ActionMap.for_gains(gains)
    highest = action_map.from_radians(gains.target(robot.TORQUE_LIMIT, robot.JOINT_UPPER, robot.SPEED_LIMIT))
    lowest = action_map.from_radians(gains.target(-robot.TORQUE_LIMIT, robot.JOINT_LOWER, -robot.SPEED_LIMIT))
    np.testing.assert_allclose(np.maximum(highest, -lowest), np.ones(12), atol=1e-12)


def test_radians_round_trip_in_batches():
    action_map = ActionMap.for_gains(PDGains())
    actions = np.random.default_rng(3).uniform(-1, 1, (5, 7, 12))
    np.testing.assert_allclose(action_map.from_radians(action_map.to_radians(actions)), actions, atol=1e-14)


def test_targets_out_of_range_are_clipped_to_the_nearest_action():
    action_map = ActionMap.for_gains(PDGains())
    assert action_map.from_radians(np.full(12, 50.0)).tolist() == [1.0] * 12
    assert action_map.from_radians(np.full(12, -50.0)).tolist() == [-1.0] * 12


@pytest.mark.parametrize(
    ("kp", "kd", "words"),
    [
        (4.9, 2.0, r"kp.*\[5, 500\].*got 4.9"),
        (501.0, 2.0, "kp"),
        (float("nan"), 2.0, "kp.*nan"),
        (None, 2.0, "kp.*None"),
        (50.0, -0.1, r"kd.*\[0, 20\].*-0.1"),
        (50.0, float("inf"), "kd.*inf"),
    ],
)
def test_gains_out_of_range_are_refused(kp, kd, words):
    with pytest.raises(InvalidInputError, match=words):
        PDGains(kp, kd)
