"""Friction and damping that the expert is told of, by hand."""

from dataclasses import replace

import numpy as np

from experts.whole_body.joint_resistance import REVERSAL, joint_resistance

SPEED = np.array([0.0, REVERSAL, -REVERSAL, 10.0, -10.0, *[1.0] * 7])


def test_a_state_that_tells_of_none_gets_none(standing):
    assert not joint_resistance(standing, SPEED).any()


def test_friction_and_damping_by_hand(standing):
    told = replace(standing, joint_friction=0.8, joint_damping=0.5)
    # .8 tanh(1) + .5 x .5 and, where the joint is fast, .8 + .5 x 10.
    expected = [0.0, 0.8 * 0.76159 + 0.25, -(0.8 * 0.76159 + 0.25), 5.8, -5.8]
    np.testing.assert_allclose(joint_resistance(told, SPEED)[:5], expected, atol=1e-5)


def test_a_robot_with_less_than_its_model_is_helped_less(standing):
    np.testing.assert_allclose(joint_resistance(replace(standing, joint_damping=-0.1), SPEED), -0.1 * SPEED)
