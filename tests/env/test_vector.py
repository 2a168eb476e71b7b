"""Many environments at once: stable-baselines3's vector environments, made as the trainers make them."""

import numpy as np
import pytest

from go1_mtl_gym.env import Go1Env
from trainers.data.environments import make_venv


@pytest.mark.parametrize("subproc", [False, True], ids=["dummy", "subproc"])
def test_expert_action_of_every_environment_is_asked_for_by_name(subproc):
    tasks = ("trot", "walk")
    kwargs = {"channels": ("command", "phase"), "episode_s": 0.3}
    venv = make_venv(tasks, env_kwargs=kwargs, subproc=subproc)
    try:
        venv.seed(3)
        observations = venv.reset()
        singles = [Go1Env(task, **kwargs) for task in tasks]
        firsts = [env.reset(seed=3 + i)[0] for i, env in enumerate(singles)]
        np.testing.assert_array_equal(observations, firsts)
        for step in range(1, 18):
            actions = np.array(venv.env_method("expert_action"))
            np.testing.assert_array_equal(actions, [env.expert_action() for env in singles])
            observations, _, dones, infos = venv.step(actions)
            for i, env in enumerate(singles):
                single, _, _, truncated, info = env.step(actions[i])
                assert truncated == dones[i] == (step == 15) and info["task"] == tasks[i]
                if truncated:
                    np.testing.assert_array_equal(infos[i]["terminal_observation"], single)
                    assert infos[i]["TimeLimit.truncated"]
                    single, _ = env.reset()
                np.testing.assert_array_equal(observations[i], single)
    finally:
        venv.close()
