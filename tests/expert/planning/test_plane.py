"""Geometry of the ground plane, by hand."""

import numpy as np

from experts.planning.plane import carried, to_complex, to_complex_array, turn


def test_horizontal_parts_become_complex():
    np.testing.assert_array_equal(to_complex_array(np.array([[1.0, 2.0], [-3.0, 0.5]])), [1 + 2j, -3 + 0.5j])
    assert to_complex(np.array([1.0, 2.0, 9.0])) == 1 + 2j


def test_turning_by_a_right_angle_takes_x_to_y():
    np.testing.assert_allclose(2.0 * turn(np.pi / 2), 2j, atol=1e-15)
    np.testing.assert_allclose(2j * turn(np.pi / 2), -2.0, atol=1e-15)


def test_vectors_and_angles_are_broadcast_against_each_other():
    arms = np.array([1.0, 1j])
    np.testing.assert_allclose(arms * turn(np.array([[0.0], [np.pi]])), [arms, -arms], atol=1e-15)


def test_a_point_ahead_of_a_body_that_turns_left_moves_left():
    np.testing.assert_allclose(carried(np.array([0.5, 0.5j]), 2.0), [1j, -1.0])


def test_carried_is_the_derivative_of_turning():
    arm, rate, step = 0.3 - 0.2j, 0.7, 1e-6
    numeric = (arm * turn(rate * step) - arm * turn(-rate * step)) / (2 * step)
    np.testing.assert_allclose(carried(np.array(arm), rate), numeric, atol=1e-9)
