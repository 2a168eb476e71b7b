"""VecNormalize around our policies: what it changed is refused, and what it changed it from is at hand."""

import numpy as np
import pytest
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize

from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import StubEnv
from trainers import MultiHeadPolicy, OriginalObs


def environments(n: int = 2) -> VecMonitor:
    venv = VecMonitor(DummyVecEnv([lambda: StubEnv(episode_s=0.4)] * n))
    venv.seed(0)
    return venv


@pytest.fixture
def normalized() -> VecNormalize:
    return VecNormalize(environments(), clip_obs=0.5)


@pytest.mark.parametrize("pooled", [False, True])
def test_normalized_observations_are_refused_and_the_way_out_is_named(normalized, pooled):
    spaces = normalized.observation_space, normalized.action_space
    policy = MultiHeadPolicy(*spaces, n_tasks=4, width=8, pooled=pooled, seed=0)
    with pytest.raises(InvalidInputError, match=r"one-hot task id, got .*VecNormalize.*norm_obs=False.*OriginalObs"):
        policy.predict(normalized.reset(), deterministic=True)


def test_a_learner_is_not_shown_normalized_observations(normalized):
    """Where the task id is constant, its largest entry would name another head."""
    model = PPO(MultiHeadPolicy, normalized, policy_kwargs={"n_tasks": 4, "width": 8}, n_steps=8, batch_size=8)
    with pytest.raises(InvalidInputError, match="VecNormalize"):
        model.learn(16)
    kept = VecNormalize(environments(), norm_obs=False)
    PPO(MultiHeadPolicy, kept, policy_kwargs={"n_tasks": 4, "width": 8}, n_steps=8, batch_size=8).learn(16)


def test_the_policy_is_shown_what_the_environments_gave(policy, normalized):
    plain, shown = environments(), OriginalObs(policy, normalized)
    obs, other = normalized.reset(), plain.reset()
    for _ in range(30):  # an episode has 20 steps
        actions, state = shown.predict(obs, deterministic=True)
        np.testing.assert_array_equal(actions, policy.predict(other, deterministic=True)[0])
        assert state is None and not np.array_equal(obs, other)
        obs, other = normalized.step(actions)[0], plain.step(actions)[0]


def test_evaluate_policy_earns_the_same(policy, normalized):
    normalized.norm_reward = False
    scores = [
        evaluate_policy(who, venv, n_eval_episodes=4)
        for who, venv in ((OriginalObs(policy, normalized), normalized), (policy, environments()))
    ]
    assert scores[0] == scores[1]


def test_observations_of_another_time_or_place_are_refused(policy, normalized):
    shown = OriginalObs(policy, normalized)
    with pytest.raises(InvalidInputError, match=r"was never reset: call its reset\(\) first"):
        shown.predict(np.zeros(2))
    before = normalized.reset()
    normalized.step(np.ones((2, 12), dtype=np.float32))
    for other, message in ((before, "got others of equal shape"), (before[:1], r"got some of shape \(1, ")):
        with pytest.raises(InvalidInputError, match=f"that VecNormalize gave last were expected, {message}"):
            shown.predict(other)
    with pytest.raises(InvalidInputError, match="VecNormalize was expected, got VecMonitor"):
        OriginalObs(policy, environments())
