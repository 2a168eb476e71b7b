"""Rotations, worked by hand and against each other."""

import mujoco
import numpy as np
import pytest

from go1_mtl_gym import rotations


def random_rpy(count: int) -> np.ndarray:
    return np.random.default_rng(0).uniform([-3, -1.5, -3], [3, 1.5, 3], (count, 3))


def test_roll_pitch_yaw_and_quaternion_are_each_others_inverse():
    for rpy in random_rpy(50):
        quat = rotations.quat_from_rpy(*rpy)
        np.testing.assert_allclose(rotations.rpy_from_quat(quat), rpy, atol=1e-12)
        expected = np.empty(4)
        mujoco.mju_euler2Quat(expected, rpy[::-1].copy(), "zyx")
        np.testing.assert_allclose(quat * np.sign(quat @ expected), expected, atol=1e-12)


def test_matrix_and_quaternion_are_each_others_inverse():
    for rpy in random_rpy(50):
        quat = rotations.quat_from_rpy(*rpy)
        again = rotations.quat_from_matrix(rotations.matrix_from_quat(quat))
        np.testing.assert_allclose(again * np.sign(again @ quat), quat, atol=1e-12)


def test_a_quarter_turn_about_an_axis():
    turn = rotations.matrix_from_vector(np.array([0.0, 0.0, np.pi / 2]))
    np.testing.assert_allclose(turn, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(rotations.yaw_matrix(np.pi / 2), turn[:2, :2], atol=1e-15)
    np.testing.assert_array_equal(rotations.matrix_from_vector(np.zeros(3)), np.eye(3))


def test_a_small_turn_is_the_cross_product_to_first_order():
    vector = np.array([1e-7, -2e-7, 3e-7])
    moved = rotations.matrix_from_vector(vector) @ [1.0, 2.0, 3.0]
    np.testing.assert_allclose(moved - [1.0, 2.0, 3.0], np.cross(vector, [1.0, 2.0, 3.0]), atol=1e-12)
    assert np.linalg.det(rotations.matrix_from_vector(1e3 * vector)) == pytest.approx(1.0)
