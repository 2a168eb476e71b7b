"""The frame of the MPC's problem against the world's."""

import numpy as np

from experts.mpc.frame import Frame


def test_a_frame_turns_there_and_back():
    here, there = Frame(np.array([3.0, -2.0, 0.3]), 3.0), Frame(np.array([-1.0, 4.0, 0.2]), -3.0)
    states = np.random.default_rng(0).normal(size=(5, 12))
    np.testing.assert_allclose(here.states(there.states(states, here), there), states, atol=1e-12)
    moved = there.states(states, here)
    np.testing.assert_allclose(moved[:, 2] - states[:, 2], 6.0 - 2 * np.pi, atol=1e-12)
    world = states[:, 3:6] @ here.rotation.T + here.origin_w
    np.testing.assert_allclose(there.points(world), moved[:, 3:6], atol=1e-12)
