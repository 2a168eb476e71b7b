"""Frames of `RobotState`, worked by hand."""

import dataclasses

import mujoco
import numpy as np
import pytest

from go1_mtl_gym.gaits import GAITS
from go1_mtl_gym.sensing.state import RobotState


def state(rpy=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), omega_b=(0.0, 0.0, 0.0)) -> RobotState:
    roll, pitch, yaw = np.array(rpy) / 2
    quat = np.array([1.0, 0, 0, 0])
    for half, axis in ((yaw, 3), (pitch, 2), (roll, 1)):
        turn = np.zeros(4)
        turn[0], turn[axis] = np.cos(half), np.sin(half)
        product = np.empty(4)
        mujoco.mju_mulQuat(product, quat, turn)
        quat = product
    return RobotState(
        np.array([0, 0, 0.3]), quat, np.array(velocity), np.array(omega_b), np.zeros(12), np.zeros(12),
        np.ones(4, bool), GAITS["trot"], 0.0, np.zeros(3),
    )  # fmt: skip


def random_rpy(count: int) -> np.ndarray:
    return np.random.default_rng(0).uniform([-3, -1.5, -3], [3, 1.5, 3], (count, 3))


def test_rpy_round_trip():
    for rpy in random_rpy(50):
        np.testing.assert_allclose(state(rpy).rpy, rpy, atol=1e-9)


def test_rotation_is_mujocos_and_orthonormal():
    for rpy in random_rpy(50):
        here = state(rpy)
        expected = np.empty(9)
        mujoco.mju_quat2Mat(expected, here.quat_wxyz)
        np.testing.assert_allclose(here.rotation.ravel(), expected, atol=1e-12)
        np.testing.assert_allclose(here.rotation @ here.rotation.T, np.eye(3), atol=1e-12)


def test_pitching_the_nose_down_is_positive():
    down = state((0.0, 0.3, 0.0))
    np.testing.assert_allclose(down.rotation @ [1, 0, 0], [np.cos(0.3), 0, -np.sin(0.3)], atol=1e-12)
    np.testing.assert_allclose(down.gravity_b, [np.sin(0.3), 0, -np.cos(0.3)], atol=1e-12)


def test_gravity_ignores_yaw_and_follows_roll():
    np.testing.assert_allclose(state((0, 0, 1.2)).gravity_b, [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(state((0.2, 0, -2.0)).gravity_b, [0, -np.sin(0.2), -np.cos(0.2)], atol=1e-12)


def test_base_velocity_is_in_the_heading_frame():
    assert state((0, 0, np.pi / 2), velocity=(0, 1, 5)).base_velocity == pytest.approx([1, 0, 0])
    assert state((0, 0, np.pi / 2), velocity=(1, 0, 5)).base_velocity == pytest.approx([0, -1, 0])
    tilted = state((0.3, 0.4, 0.0), velocity=(0.7, 0.2, 0.0))
    assert tilted.base_velocity[:2] == pytest.approx([0.7, 0.2])


def test_yaw_rate_is_about_the_vertical():
    assert state((0, np.pi / 3, 0), omega_b=(0, 0, 2.0)).base_velocity[2] == pytest.approx(1.0)
    assert state((np.pi / 3, 0, 0), omega_b=(0, 2.0, 0)).base_velocity[2] == pytest.approx(np.sqrt(3))


def test_gimbal_lock_does_not_give_nan():
    for pitch in (np.pi / 2, -np.pi / 2):
        here = state((0.1, pitch, 0.2))
        assert np.isfinite(here.rpy).all() and here.rpy[1] == pytest.approx(pitch, abs=1e-6)


def test_state_cannot_be_reassigned_and_a_replaced_one_is_computed_afresh():
    here = state((0.0, 0.0, 0.5))
    with pytest.raises(dataclasses.FrozenInstanceError):
        here.phase = 0.3
    assert here.rpy[2] == pytest.approx(0.5)
    other = dataclasses.replace(here, quat_wxyz=np.array([1.0, 0, 0, 0]))
    assert other.rpy[2] == 0.0 and (other.rotation == np.eye(3)).all()
