"""The options that make data as hardware would: two rates, noise on the estimate, delay."""

import json

import numpy as np

from experts import HARDWARE_LIKE
from go1_mtl_gym.env import Go1Env

SECONDS = 2


def test_a_trot_survives_the_hardware_like_options():
    env = Go1Env("trot", **HARDWARE_LIKE)
    env.reset(seed=1, options={"command": (0.4, 0.1, 0.2)})
    velocity = []
    for step in range(SECONDS * env.control_hz):
        action = env.expert_action()
        if step % 50 == 3:
            np.testing.assert_array_equal(env.expert_action(), action)
        *_, info = env.step(action)
        assert not info["fallen"]
        velocity.append(info["base_velocity"])
    np.testing.assert_allclose(np.mean(velocity[env.control_hz :], axis=0), [0.4, 0.1, 0.2], atol=0.1)
    counters = env._expert.counters
    # 100 Hz: every fifth step at 500 Hz, and the whole body at every call; a pushed state may take a second QP.
    assert SECONDS * 100 <= counters.solves <= 1.2 * SECONDS * 100
    assert counters.calls == SECONDS * env.control_hz + SECONDS * env.control_hz // 50
    assert counters.solver_failures == counters.bad_states == 0


def test_the_options_can_be_stored():
    assert json.loads(json.dumps(dict(HARDWARE_LIKE))) == dict(HARDWARE_LIKE)
