"""The checkers of gymnasium and stable-baselines3, with every warning made an error."""

import warnings

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3

from go1_mtl_gym import TASKS, env_id
from go1_mtl_gym.sensing.observation import CHANNELS

KWARGS = [
    {},
    {"channels": (), "tasks": tuple(TASKS)},
    {"channels": tuple(CHANNELS), "history": 3},
    {"noise": True, "control_hz": 100, "kp": 30.0, "kd": 1.0},
    {"friction": 0.5, "payload_kg": 2.0, "action_delay_s": 0.025, "estimator_noise": True},
    {"randomization": True},
    {"state_estimator": True, "noise": True},
]


@pytest.mark.parametrize("kwargs", KWARGS, ids=["default", "plain", "channels", "noise", "real", "random", "filtered"])
@pytest.mark.parametrize("task", [None, *TASKS])
def test_both_checkers_pass_without_a_warning(task, kwargs):
    env = gymnasium.make(env_id(task), disable_env_checker=True, **kwargs)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)  # the render check opens a window
        check_env_sb3(env.unwrapped, warn=True, skip_render_check=True)


@pytest.mark.gl
def test_sb3s_checker_renders_without_a_warning():
    env = gymnasium.make(env_id("trot"), disable_env_checker=True, render_mode="rgb_array", width=64, height=48)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env_sb3(env.unwrapped, warn=True, skip_render_check=False)
    env.close()


def test_the_passive_checker_of_make_is_silent():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(env_id("walk"))
        env.reset(seed=0)
        for _ in range(3):
            env.step(env.action_space.sample())
        env.close()
        env.close()
