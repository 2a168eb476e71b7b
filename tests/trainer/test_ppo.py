"""PPO that starts as a trained policy: the same actions, noise in radians, a critic that knows something."""

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv

from go1_mtl_gym import InvalidInputError
from tests.trainer.stub_env import StubEnv
from tests.trainer.test_policy import observations
from trainers import MultiHeadPolicy, ppo_from_policy
from trainers.algorithms.ppo import ActorCriticAdam

SMALL = {"n_steps": 16, "batch_size": 32, "n_epochs": 1}


class Paying(StubEnv):
    """A stub whose every step earns one, more or less by where its first hip is."""

    def step(self, action):
        obs, _, *rest = super().step(action)
        return obs, 1.0 + float(self.q[0]), *rest


def test_it_begins_as_the_policy_with_noise_in_radians(policy, venv):
    model = ppo_from_policy(policy, venv, exploration_rad=0.02, critic_steps=0, **SMALL)
    obs = observations([0, 1, 2, 3])
    np.testing.assert_array_equal(model.predict(obs, deterministic=True)[0], policy.predict(obs, deterministic=True)[0])
    std_rad = model.policy.log_std.detach().exp().numpy() * np.array(policy.contract.action_scale)
    np.testing.assert_allclose(std_rad, 0.02, rtol=1e-5)
    assert model.policy.contract == policy.contract


def test_the_critic_is_fitted_before_and_nothing_else_is_touched(policy):
    """One a step for ever is worth 1 / (1 - gamma)."""
    venv = DummyVecEnv([lambda: Paying("trot", episode_s=0.5)] * 2)
    before = {name: value.clone() for name, value in policy.state_dict().items()}
    model = ppo_from_policy(policy, venv, critic_steps=200, gamma=0.9, **SMALL)
    values = model.policy.predict_values(torch.from_numpy(observations([0]))).item()
    assert values == pytest.approx(10.0, abs=2.0)
    moved = {name for name, value in model.policy.state_dict().items() if not torch.equal(value, before[name])}
    assert {name.partition(".")[0] for name in moved} == {"critic", "log_std"}
    assert all(torch.equal(value, before[name]) for name, value in policy.state_dict().items())
    assert model.num_timesteps == 0


def test_it_learns_saves_and_loads(policy, tmp_path):
    venv = DummyVecEnv([lambda: Paying("trot"), lambda: Paying("walk")])
    model = ppo_from_policy(policy, venv, critic_steps=32, **SMALL)
    model.learn(64)
    moved = [not torch.equal(a, b) for a, b in zip(model.policy.actor.parameters(), policy.actor.parameters())]
    assert any(moved)
    model.save(tmp_path / "ppo.zip")
    again, obs = PPO.load(tmp_path / "ppo.zip", device="cpu"), observations([2, 0])
    np.testing.assert_array_equal(again.predict(obs, deterministic=True)[0], model.predict(obs, deterministic=True)[0])
    model.policy.save(tmp_path / "policy.zip")
    assert MultiHeadPolicy.load(tmp_path / "policy.zip").contract == policy.contract


def test_equal_seeds_give_equal_critics(policy):
    def output(seed: int) -> torch.Tensor:
        venv = DummyVecEnv([lambda: Paying("trot"), lambda: Paying("trot")])
        return ppo_from_policy(policy, venv, critic_steps=40, seed=seed, **SMALL).policy.critic[-1].weight

    assert torch.equal(output(0), output(0)) and not torch.equal(output(0), output(1))


def test_the_critics_rate_is_a_multiple_of_the_actors():
    """Adam's first step is the learning rate times the gradient's sign."""
    actor, critic = (torch.nn.Parameter(torch.zeros(1)) for _ in range(2))
    optimizer = ActorCriticAdam([{"params": [actor]}, {"params": [critic], "lr_factor": 5.0}], lr=1.0)
    for group in optimizer.param_groups:  # as stable-baselines3 does before each update
        group["lr"] = 0.01
    (actor + critic).sum().backward()
    optimizer.step()
    assert actor.item() == pytest.approx(-0.01, rel=1e-4) and critic.item() == pytest.approx(-0.05, rel=1e-4)
    assert [group["lr"] for group in optimizer.param_groups] == [0.01, 0.01]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"exploration_rad": 0.0}, "exploration_rad"),
        ({"critic_lr_factor": 0}, "lr_factor"),
        ({"critic_steps": -1}, "steps"),
    ],
)
def test_impossible_numbers(policy, venv, arguments, message):
    with pytest.raises(InvalidInputError, match=message):
        ppo_from_policy(policy, venv, **arguments)


def test_other_environments_and_policies_without_a_contract(policy, venv):
    other = DummyVecEnv([lambda: StubEnv("trot", control_hz=100)])
    with pytest.raises(InvalidInputError, match="the policy and the environments do not.*control_hz: 50 against 100"):
        ppo_from_policy(policy, other)
    unnamed = MultiHeadPolicy(venv.observation_space, venv.action_space, n_tasks=4, width=8)
    with pytest.raises(InvalidInputError, match="with a contract was expected"):
        ppo_from_policy(unnamed, venv)
