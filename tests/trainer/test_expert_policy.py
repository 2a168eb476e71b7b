"""The environment's expert as a policy."""

import numpy as np
import pytest
from imitation.data import rollout
from stable_baselines3.common.vec_env import DummyVecEnv

from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import StubEnv, linear_expert, make_stub
from trainers import ExpertPolicy, make_venv


@pytest.mark.parametrize("subproc", [False, True])
def test_asks_every_environment(subproc):
    venv = make_venv(("trot", "walk"), per_task=1, subproc=subproc, make_env=make_stub)
    try:
        venv.seed(3)
        obs = venv.reset()
        policy = ExpertPolicy(venv)
        for _ in range(3):
            actions, state = policy.predict(obs)
            again, _ = policy.predict(obs)
            obs, *_ = venv.step(actions)
        assert actions.shape == (2, 12) and actions.dtype == np.float32 and state is None
        np.testing.assert_array_equal(actions, again)
        assert obs[:, -4:].argmax(1).tolist() == [0, 3]
        twins = [StubEnv("trot"), StubEnv("walk")]
        for i, twin in enumerate(twins):
            twin.reset(seed=3 + i)
            for _ in range(2):
                twin.step(linear_expert(twin.state))
        np.testing.assert_allclose(actions, [linear_expert(twin.state) for twin in twins], atol=1e-6)
    finally:
        venv.close()


def test_drives_imitations_rollouts():
    venv = DummyVecEnv([lambda: StubEnv(episode_s=0.2)])
    trajectories = rollout.generate_trajectories(
        ExpertPolicy(venv), venv, rollout.make_min_episodes(2), rng=np.random.default_rng(0)
    )
    assert [len(t) for t in trajectories] == [10, 10]


def test_part_of_the_environments():
    venv = DummyVecEnv([StubEnv, StubEnv])
    with pytest.raises(InvalidInputError, match="all 2"):
        ExpertPolicy(venv).predict(venv.reset()[:1])
