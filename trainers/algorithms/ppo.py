"""Reinforcement learning that goes on from a trained policy instead of from nothing."""

from typing import Any, cast

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv
from torch import nn
from tqdm.auto import tqdm

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import number_in
from trainers.algorithms.optimizer import adamw_one_cycle
from trainers.data.environments import contracts_of, flat_obs
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.policies.normalization import SMALLEST_SCALE

CONSERVATIVE = {
    "n_steps": 512,
    "batch_size": 512,
    "n_epochs": 5,
    "gamma": 0.98,
    "gae_lambda": 0.95,
    "clip_range": 0.1,
    "target_kl": 0.01,
    "max_grad_norm": 0.5,
}
"""PPO's settings for small steps away from a policy that can walk already."""
CRITIC_GRADIENT_STEPS = 2000
"""Of the fit before PPO begins."""


class ActorCriticAdam(torch.optim.Adam):
    """Adam with a factor on the learning rate of each group of parameters.

    stable-baselines3 sets one rate for all groups before each update; a critic that begins from nothing needs a larger
    one than an actor that has learned.
    """

    def step(self, closure: Any = None) -> Any:
        """One step, each group at its rate times its ``lr_factor`` (1 where it has none)."""
        rates = [group["lr"] for group in self.param_groups]
        for group in self.param_groups:
            group["lr"] *= group.get("lr_factor", 1.0)
        try:
            return super().step(closure)
        finally:
            for group, rate in zip(self.param_groups, rates, strict=True):
                group["lr"] = rate


def ppo_from_policy(
    policy: MultiHeadPolicy,
    venv: VecEnv,
    *,
    exploration_rad: float = 0.03,
    learning_rate: float = 1e-5,
    critic_lr_factor: float = 30.0,
    critic_steps: int = 16_384,
    seed: int = 0,
    progress: bool = False,
    **ppo_kwargs: Any,
) -> PPO:
    """A PPO that starts as a trained policy and is careful with it.

    What makes PPO forget a cloned policy is exploration that makes the robot fall, a critic that knows nothing, and
    steps too large for an actor that is already good. So the noise is given in radians of joint target, the critic is
    fitted first, to what the policy as it is earns in `critic_steps` steps, and the actor's rate is a fraction of the
    critic's.

    Args:
        policy: a trained one; copied, not changed.
        venv: environments of the policy's contract, e.g. from `trainers.make_venv`.
        exploration_rad: standard deviation of the noise on every joint target at the start [rad].
        learning_rate: of the actor.
        critic_lr_factor: the critic's rate in units of the actor's.
        critic_steps: environment steps, all environments together, that the critic is fitted to; 0 leaves the policy's.
        seed: of everything random.
        progress: show a bar while the critic's steps are made.
        ppo_kwargs: of `stable_baselines3.PPO`, on top of `CONSERVATIVE`.

    Returns:
        A model whose ``learn`` goes on from there.

    Raises:
        InvalidInputError: if the environments are not of the policy's contract, or a number is outside its range.
    """
    if policy.contract is None:
        raise InvalidInputError("a policy with a contract was expected: nothing tells whether the environments are its")
    for contract in contracts_of(venv):
        policy.contract.check(contract, "the policy", "the environments")
    number_in(exploration_rad, 1e-4, 1.0, "exploration_rad [rad]")
    number_in(critic_lr_factor, 1e-3, 1e6, "critic_lr_factor")
    number_in(critic_steps, 0, 1e9, "critic_steps")
    optimizer = {"optimizer_class": ActorCriticAdam, "critic_lr_factor": critic_lr_factor}
    policy_kwargs = policy.network_kwargs() | optimizer
    arguments = {"learning_rate": learning_rate, "seed": seed, "device": "cpu", **CONSERVATIVE, **ppo_kwargs}
    model = PPO(MultiHeadPolicy, venv, policy_kwargs=policy_kwargs, **arguments)
    model.policy.load_state_dict(policy.state_dict())
    scale = torch.tensor(policy.contract.action_scale, dtype=torch.float32)
    with torch.no_grad():
        model.policy.log_std.copy_(torch.log(exploration_rad / scale))
    if critic_steps:
        obs, returns = _earned(model, max(1, int(critic_steps) // venv.num_envs), progress)
        _fit_critic(cast(MultiHeadPolicy, model.policy), obs, returns, seed)
    return model


def _earned(model: PPO, steps: int, progress: bool) -> tuple[torch.Tensor, torch.Tensor]:
    """Observations of the model's policy at work, and the discounted rewards that followed each, shape (n,).

    Where an episode is cut by its time, and at the end, the mean reward is taken to go on for ever.
    """
    venv = cast(VecEnv, model.get_env())
    seen: list[np.ndarray] = []
    rewards: list[np.ndarray] = []
    falls: list[np.ndarray] = []
    cuts: list[np.ndarray] = []
    obs = flat_obs(venv.reset())
    for _ in tqdm(range(steps), "critic", unit="step", disable=not progress):
        with torch.no_grad():
            actions = model.policy(torch.as_tensor(obs))[0].numpy()
        seen.append(obs)
        after, reward, done, infos = venv.step(np.clip(actions, -1.0, 1.0))
        obs = flat_obs(after)
        cut = np.array([info.get("TimeLimit.truncated", False) for info in infos])
        rewards.append(reward)
        falls.append(done & ~cut)
        cuts.append(cut)
    beyond = np.mean(rewards) / (1.0 - model.gamma)
    returns, later = np.empty((steps, venv.num_envs)), np.full(venv.num_envs, beyond)
    for i in reversed(range(steps)):
        later = rewards[i] + model.gamma * np.where(falls[i], 0.0, np.where(cuts[i], beyond, later))
        returns[i] = later
    return torch.as_tensor(np.concatenate(seen)), torch.as_tensor(returns.ravel(), dtype=torch.float32)


def _fit_critic(policy: MultiHeadPolicy, obs: torch.Tensor, returns: torch.Tensor, seed: int) -> None:
    """Least squares; the critic's output begins at the mean of the returns and in units of their deviation."""
    output, rng = cast(nn.Linear, policy.critic[-1]), np.random.default_rng(seed)
    with torch.no_grad():
        output.weight.mul_(max(float(returns.std()), SMALLEST_SCALE))
        output.bias.fill_(returns.mean())
    optimizer, schedule = adamw_one_cycle(list(policy.critic.parameters()), 1e-3, 1e-4, CRITIC_GRADIENT_STEPS)
    for _ in range(CRITIC_GRADIENT_STEPS):
        batch = torch.from_numpy(rng.integers(len(obs), size=min(512, len(obs))))
        error = policy.predict_values(obs[batch]).flatten() - returns[batch]
        optimizer.zero_grad()
        error.square().mean().backward()
        optimizer.step()
        schedule.step()
