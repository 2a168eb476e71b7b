"""Geometry of the ground plane, by hand."""

import numpy as np

from experts.planar import carried, turned


def test_turning_by_a_right_angle_takes_x_to_y():
    np.testing.assert_allclose(turned(np.array([2.0, 0.0]), np.pi / 2), [0.0, 2.0], atol=1e-15)
    np.testing.assert_allclose(turned(np.array([0.0, 2.0]), np.pi / 2), [-2.0, 0.0], atol=1e-15)


def test_vectors_and_angles_are_broadcast_against_each_other():
    arms = np.array([[1.0, 0.0], [0.0, 1.0]])
    np.testing.assert_allclose(turned(arms, np.array([[0.0, 0.0], [np.pi, np.pi]])), [arms, -arms], atol=1e-15)


def test_a_point_ahead_of_a_body_that_turns_left_moves_left():
    np.testing.assert_allclose(carried(np.array([[0.5, 0.0], [0.0, 0.5]]), 2.0), [[0.0, 1.0], [-1.0, 0.0]])
