"""Deep copies and pickles: they continue to the bit, and they are small."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest

from go1_mtl_gym.env import Go1Env

COPIERS = pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))],
                                  ids=["deepcopy", "pickle"])  # fmt: skip

REAL = {"friction": 0.6, "payload_kg": 1.0, "action_delay_s": 0.025, "estimator_noise": True}
RANDOM = {"randomization": True, "estimator_noise": True}
FILTERED = {"noise": True, "control_hz": 500, "state_estimator": True}


def walking(steps: int, **kwargs) -> Go1Env:
    """An environment in the middle of an episode that its expert drives."""
    env = Go1Env(None, channels=("phase", "command", "last_action"), history=3, **kwargs)
    env.reset(seed=11)
    for step in range(steps):
        env.step(env.expert_action())
        if step == steps // 2:
            env.set_command((0.2, 0.05, -0.1))
            env.set_task("walk")
    return env


def agree(one: Go1Env, two: Go1Env, steps: int, rng_seed: int = 0) -> None:
    """Both give the same bits under the same actions, over a change of task and a reset without a seed."""
    rng = np.random.default_rng(rng_seed)
    for step in range(steps):
        action = one.expert_action() + rng.uniform(-0.1, 0.1, 12)
        (a, reward_a, *_, info_a), (b, reward_b, *_, info_b) = one.step(action), two.step(action)
        np.testing.assert_array_equal(a, b)
        assert reward_a == reward_b and all(np.array_equal(info_a[key], info_b[key]) for key in info_a)
        if step == steps // 2:
            one.set_task("jump"), two.set_task("jump")
    np.testing.assert_array_equal(one.reset()[0], two.reset()[0])
    np.testing.assert_array_equal(one.step(np.zeros(12))[0], two.step(np.zeros(12))[0])


@COPIERS
@pytest.mark.parametrize("kwargs", [{}, {"noise": True, "control_hz": 100}, REAL, RANDOM, FILTERED],
                         ids=["exact", "noisy", "real", "random", "filtered"])  # fmt: skip
def test_a_copy_in_the_middle_of_an_episode_continues_to_the_bit(duplicate, kwargs):
    env = walking(20, **kwargs)
    agree(env, duplicate(env), 30)


@COPIERS
@pytest.mark.parametrize("kwargs", [{}, REAL, FILTERED], ids=["exact", "real", "filtered"])
def test_a_copys_expert_gives_the_same_labels(duplicate, kwargs):
    env = walking(20, **kwargs)
    twin = duplicate(env)
    for _ in range(10):
        action = env.expert_action()
        np.testing.assert_array_equal(action, twin.expert_action())
        env.step(action), twin.step(action)


@COPIERS
def test_a_copy_does_not_move_the_original(duplicate):
    env, reference = walking(5), walking(5)
    twin = duplicate(env)
    for _ in range(10):
        twin.step(np.ones(12))
    twin.set_command((0.0, 0.0, 0.5))
    twin.reset(seed=99)
    agree(env, reference, 5)


@COPIERS
def test_a_copy_before_the_first_reset(duplicate):
    env = Go1Env("trot", noise=True)
    twin = duplicate(env)
    np.testing.assert_array_equal(env.reset(seed=4)[0], twin.reset(seed=4)[0])
    agree(env, twin, 5)


def test_a_copy_of_a_copy_and_of_a_seeded_stream():
    env = Go1Env(None)
    env.reset(seed=3)
    twin = copy.deepcopy(pickle.loads(pickle.dumps(env)))
    for _ in range(4):
        (_, info), (_, other) = env.reset(), twin.reset()
        assert info["task"] == other["task"] and (info["command"] == other["command"]).all()


def test_a_pickle_is_small():
    assert len(pickle.dumps(Go1Env("trot"))) < 20_000
    assert len(pickle.dumps(walking(3))) < 100_000


@COPIERS
def test_a_copy_keeps_the_spec_and_draws_the_same_samples(duplicate):
    env = gymnasium.make("Go1Trot-v0", kp=40).unwrapped
    env.action_space.seed(3), env.observation_space.seed(4)
    env.action_space.sample(), env.observation_space.sample()
    twin = duplicate(env)
    assert twin.spec == env.spec and twin.spec.id == "Go1Trot-v0" and twin.spec.kwargs["kp"] == 40
    for _ in range(3):
        np.testing.assert_array_equal(twin.action_space.sample(), env.action_space.sample())
        np.testing.assert_array_equal(twin.observation_space.sample(), env.observation_space.sample())
    assert gymnasium.make(twin.spec).unwrapped.config == env.config
