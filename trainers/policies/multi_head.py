"""The student: one network for all gaits, as a stable-baselines3 policy."""

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.distributions import DiagGaussianDistribution
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import nn

from go1_mtl_gym import TASKS, PolicyContract
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import one_of
from trainers.policies import normalization as norm
from trainers.policies.checkpoint import (
    Checkpoint,
    SavedPolicy,
    space_from_json,
    space_to_json,
    tensors_of,
    tuples,
)
from trainers.policies.checks import check_arguments, check_observation, check_spaces, check_task_ids, number_of_tasks
from trainers.policies.environment import ForEnvironment, json_arguments
from trainers.policies.networks import MultiHeadActor, plain, seeded

CRITIC_WIDTH = 64
"""Units of each hidden layer of the value network, which behaviour cloning never evaluates."""

CRITIC_INPUT = "critic.0.weight"
"""Weights of the critic's first layer, shape (units, D): the one-hot task id is its last columns."""


def _constant_rate(_progress: float) -> float:
    return 3e-4


class MultiHeadPolicy(SavedPolicy, ForEnvironment, ActorCriticPolicy):
    """Actor with a shared trunk and one head per task, chosen by the one-hot task id that ends the observation.

    The trunk sees the normalised observation without the task id (clipped at `clip_sd`); the head gives the normalised
    action; the inverse map gives the action. Only the heads that a batch names are computed, only these get gradients.
    Exploration noise (for PPO and friends) is a diagonal Gaussian that does not depend on the state; the critic is
    small and not evaluated when cloning.

    Args:
        observation_space: flat Box of size D; its last `n_tasks` entries are the one-hot task id.
        action_space: flat Box of the actions.
        lr_schedule: progress -> learning rate of `optimizer`; stable-baselines3 passes its own.
        width: units of every hidden layer of the actor (the paper: 2560).
        contract: of the environment it is for (``env.unwrapped.contract``); names the tasks, and is compared wherever
            the policy meets environments or rows.
        n_tasks: number of tasks K, for environments that have no contract; nothing is compared then but sizes.
        pooled: the baseline that ignores the task id: one head for all tasks, same depth as one path of the multi-head.
        normalization: "mean_std", "min_max" or "none"; used by `fit_normalization`.
        clip_sd: normalised inputs are clipped to +- this.
        env_kwargs: what `gymnasium.make` needs beyond the contract for the environment it was trained for; travels with
            `save`, so values are JSON's, or frozen dataclasses of the environment's, such as
            `go1_mtl_gym.SensorNoise`.
        log_std_init: initial log standard deviation of the exploration noise, in units of the action: at -3.5 targets
            vary by 0.1 rad, which a trained policy survives; see `trainers.ppo_from_policy`.
        seed: of the initial weights, without touching torch's global generator; None draws from that generator.
        optimizer_class: for on-policy learning.
        optimizer_kwargs: of `optimizer_class`, without the learning rate.
        critic_lr_factor: ``lr_factor`` of the critic's group of parameters, for an optimizer that knows it
            (`trainers.algorithms.ppo.ActorCriticAdam`).

    Raises:
        InvalidInputError: if an argument is not as described, neither contract nor number of tasks is given, or the
            spaces are not the contract's.
    """

    kind = "multi_head"
    weight_files = ("weights",)
    observation_space: spaces.Box
    action_space: spaces.Box
    action_dist: DiagGaussianDistribution

    def __init__(
        self,
        observation_space: spaces.Space,
        action_space: spaces.Space,
        lr_schedule: Any = _constant_rate,
        *,
        contract: PolicyContract | None = None,
        n_tasks: int | None = None,
        width: int = 256,
        pooled: bool = False,
        normalization: str = "mean_std",
        clip_sd: float = 6.0,
        env_kwargs: Mapping[str, Any] | None = None,
        log_std_init: float = -3.5,
        seed: int | None = None,
        optimizer_class: type[torch.optim.Optimizer] = torch.optim.Adam,
        optimizer_kwargs: dict[str, Any] | None = None,
        critic_lr_factor: float = 1.0,
        use_sde: bool = False,
    ) -> None:
        n_tasks = number_of_tasks(contract, n_tasks)
        check_arguments(observation_space, action_space, width, n_tasks, normalization, clip_sd, use_sde)
        if contract is not None:
            check_spaces(contract, observation_space, action_space, n_tasks)
        self.width = int(width)
        self.contract = contract
        self.n_tasks = int(n_tasks)
        self.pooled = bool(pooled)
        self.normalization = normalization
        self.clip_sd = float(clip_sd)
        self.extra_env_kwargs = json_arguments(env_kwargs or {}, contract)
        self.seed = seed
        self.critic_lr_factor = float(critic_lr_factor)
        super().__init__(
            observation_space,
            action_space,
            lr_schedule,
            log_std_init=log_std_init,
            optimizer_class=optimizer_class,
            optimizer_kwargs=optimizer_kwargs,
        )

    # -- Construction, as stable-baselines3 calls it -------------------------------------------------------------------

    def _build(self, lr_schedule: Any) -> None:
        n_inputs = int(self.observation_space.shape[0]) - self.n_tasks
        n_actions = int(self.action_space.shape[0])
        with seeded(self.seed):
            self.actor = MultiHeadActor(n_inputs, n_actions, 1 if self.pooled else self.n_tasks, self.width)
            self.critic = plain(n_inputs + self.n_tasks, 1, CRITIC_WIDTH)
        self.obs_normalizer = norm.Normalizer(n_inputs)
        self.act_normalizer = norm.Normalizer(n_actions)
        self.log_std = nn.Parameter(torch.full((n_actions,), float(self.log_std_init)))
        self._first_rate = float(lr_schedule(1))

    @functools.cached_property
    def optimizer(self) -> torch.optim.Optimizer:  # type: ignore[override]  # made when it is asked for
        """For on-policy learning; a policy that only drives has none, since PyTorch's take a second to import."""
        groups: list[dict[str, Any]] = [
            {"params": [*self.actor.parameters(), self.log_std]},
            {"params": list(self.critic.parameters()), "lr_factor": self.critic_lr_factor},
        ]
        return self.optimizer_class(  # type: ignore[call-arg]  # torch's base class alone knows no rate
            groups, lr=self._first_rate, **self.optimizer_kwargs
        )

    def network_kwargs(self) -> dict[str, Any]:
        """Constructor arguments that shape the network: also ``policy_kwargs`` for a PPO that starts from it."""
        return {
            "contract": self.contract,
            "n_tasks": self.n_tasks,
            "width": self.width,
            "pooled": self.pooled,
            "normalization": self.normalization,
            "clip_sd": self.clip_sd,
            "env_kwargs": self.extra_env_kwargs,
            "log_std_init": self.log_std_init,
        }

    def _get_constructor_parameters(self) -> dict[str, Any]:
        """All that rebuilds an equal policy; stable-baselines3 reads it."""
        return {
            "observation_space": self.observation_space,
            "action_space": self.action_space,
            "lr_schedule": _constant_rate,
            "optimizer_class": self.optimizer_class,
            "optimizer_kwargs": self.optimizer_kwargs,
            "critic_lr_factor": self.critic_lr_factor,
            "seed": self.seed,
            **self.network_kwargs(),
        }

    def fit_normalization(self, obs: np.ndarray, acts: np.ndarray, binary: np.ndarray | None = None) -> None:
        """Take shift and scale of inputs and outputs from demonstrations, by the mode in `normalization`.

        Args:
            obs: observations with task id, shape (n, D).
            acts: actions, shape (n, 12).
            binary: bool mask of inputs to leave at 0 and 1, shape (D - K,); None finds columns that hold nothing else.

        Raises:
            InvalidInputError: if a shape is wrong or a value is not finite.
        """
        obs, acts = np.asarray(obs), np.asarray(acts)
        for value, space, label in ((obs, self.observation_space, "obs"), (acts, self.action_space, "acts")):
            if value.ndim != 2 or value.shape[1:] != space.shape:
                raise InvalidInputError(f"{label} must have shape (n, {space.shape[0]}), got {value.shape}")
        self.obs_normalizer.set(*norm.fit(obs[:, : -self.n_tasks], self.normalization, binary))
        self.act_normalizer.set(*norm.fit(acts, self.normalization, np.zeros(acts.shape[1], dtype=bool)))

    # -- New tasks ----------------------------------------------------------------------------------------------------

    def add_task(self, name: str, seed: int = 0, like: str | None = None) -> "MultiHeadPolicy":
        """A new policy that knows one task more, the last in its task id; this one stays as it is.

        Its space of observations is one entry longer, so whoever holds this policy and its spaces must take the new one
        instead. Trunk, heads, normalization, critic and exploration noise are copies: in the old tasks it acts as this
        one does, to the bit. The new head is untrained (see `trainers.learn_task`), and the critic does not see the new
        task's entry yet.

        Args:
            name: of a registered task that this policy does not have.
            seed: of the new head's weights.
            like: name of a task of this policy whose head the new one begins as a copy of (see
                `trainers.closest_task`); None draws its weights.

        Raises:
            InvalidInputError: if the task is unknown or there already, `like` is not there, or this policy is pooled.
        """
        tasks = self.tasks
        if self.pooled:
            raise InvalidInputError(
                f"a policy with a head per task was expected, got a pooled one; it cannot add {name!r}"
            )
        one_of(name, [task for task in TASKS if task not in tasks], "a task that the policy does not have")
        if like is not None:
            one_of(like, tasks, "like")
        grown = self._with_room_for(name, seed)
        weights = self.state_dict()
        weights[CRITIC_INPUT] = nn.functional.pad(weights[CRITIC_INPUT], (0, 1))
        grown.load_state_dict(grown.state_dict() | weights)
        if like is not None:
            grown.actor.heads[-1].load_state_dict(self.actor.heads[tasks.index(like)].state_dict())
        grown.seed = None  # no seed gives these weights
        grown.set_training_mode(self.training)
        return grown

    def _with_room_for(self, name: str, seed: int) -> "MultiHeadPolicy":
        """An untrained policy like this one with one more task."""
        space = self.observation_space
        tasks = (*self.tasks, name)
        arguments: dict[str, Any] = self._get_constructor_parameters() | {
            "observation_space": spaces.Box(np.append(space.low, np.float32(0)), np.append(space.high, np.float32(1))),
            "contract": self.named_contract().with_tasks(tasks, {name: TASKS[name].gait}),
            "n_tasks": len(tasks),
            "seed": seed,
        }
        return MultiHeadPolicy(**arguments).to(self.device)

    # -- The actor -----------------------------------------------------------------------------------------------------

    def task_index(self, obs: torch.Tensor) -> torch.Tensor:
        """Index of each row's task, int64, shape (n,)."""
        return obs[:, -self.n_tasks :].argmax(dim=1)

    def mean_actions(self, obs: torch.Tensor, rows: Sequence[int] | None = None) -> torch.Tensor:
        """The deterministic actions, not clipped to the action space, shape (n, 12).

        Args:
            obs: shape (n, D), any mix of tasks.
            rows: how many there are of each task if they come sorted by task; None looks them up.
        """
        if rows is None:
            return self._means(self.normalized(obs), obs)
        return self.act_normalizer.inverse(self.actor.in_blocks(self.normalized(obs), rows))

    def normalized(self, obs: torch.Tensor) -> torch.Tensor:
        """What the trunk sees of observations: without task id, normalized and clipped, shape (n, D - K)."""
        return self.obs_normalizer(obs[:, : -self.n_tasks].float()).clamp(-self.clip_sd, self.clip_sd)

    def _means(self, normalized: torch.Tensor, obs: torch.Tensor) -> torch.Tensor:
        return self.act_normalizer.inverse(self.actor(normalized, self.task_index(obs)))

    def _values(self, normalized: torch.Tensor, obs: torch.Tensor) -> torch.Tensor:
        return self.critic(torch.cat([normalized, obs[:, -self.n_tasks :].float()], dim=1))

    def _gaussian(self, means: torch.Tensor) -> DiagGaussianDistribution:
        return self.action_dist.proba_distribution(means, self.log_std)

    # -- What stable-baselines3 calls ----------------------------------------------------------------------------------

    def forward(
        self, obs: torch.Tensor, deterministic: bool = False
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Actions (n, 12), values (n, 1) and log probabilities (n,), as on-policy learners collect them.

        Raises:
            InvalidInputError: if an observation does not end in a one-hot task id.
        """
        check_task_ids(obs[:, -self.n_tasks :].cpu().numpy())
        normalized = self.normalized(obs)
        distribution = self._gaussian(self._means(normalized, obs))
        actions = distribution.get_actions(deterministic=deterministic)
        return actions, self._values(normalized, obs), distribution.log_prob(actions)

    def evaluate_actions(  # type: ignore[override]  # flat spaces: never a dict
        self, obs: torch.Tensor, actions: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor | None]:
        """Values (n, 1), log probabilities (n,) and entropies (n,) of given actions."""
        normalized = self.normalized(obs)
        distribution = self._gaussian(self._means(normalized, obs))
        return self._values(normalized, obs), distribution.log_prob(actions), distribution.entropy()

    def get_distribution(  # type: ignore[override]  # flat spaces: never a dict
        self, obs: torch.Tensor
    ) -> DiagGaussianDistribution:
        """Distribution of the actions."""
        return self._gaussian(self.mean_actions(obs))

    def predict_values(  # type: ignore[override]  # flat spaces: never a dict
        self, obs: torch.Tensor
    ) -> torch.Tensor:
        """Values, shape (n, 1)."""
        return self._values(self.normalized(obs), obs)

    def set_training_mode(self, mode: bool) -> None:
        """Switch between training and evaluation; `predict` asks for it each time, and walking all modules is slow."""
        if mode != self.training:
            super().set_training_mode(mode)

    def _predict(  # type: ignore[override]  # flat spaces: never a dict
        self, observation: torch.Tensor, deterministic: bool = False
    ) -> torch.Tensor:
        means = self.mean_actions(observation)
        return means if deterministic else self._gaussian(means).get_actions()

    def predict(  # type: ignore[override]  # flat spaces: never a dict
        self,
        observation: np.ndarray,
        state: tuple[np.ndarray, ...] | None = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = False,
    ) -> tuple[np.ndarray, tuple[np.ndarray, ...] | None]:
        """Actions of one observation (D,) or a batch (n, D) of any mix of tasks, clipped to the action space.

        Raises:
            InvalidInputError: if an observation has another size or is not finite, or does not end in a one-hot task
                id.
        """
        if not isinstance(observation, dict):
            observation = _as_array(observation)
            check_observation(observation, self.contract, self.observation_space.shape[0], self.n_tasks)
        return super().predict(observation, state, episode_start, deterministic)

    # -- Files ---------------------------------------------------------------------------------------------------------

    def to_checkpoint(self) -> Checkpoint:
        """All that `from_checkpoint` needs."""
        network = {
            name: value for name, value in self.network_kwargs().items() if name not in ("contract", "env_kwargs")
        }
        policy = {
            "network": network,
            "contract": None if self.contract is None else self.contract.as_dict(),
            "env_kwargs": self.extra_env_kwargs,
            "observation_space": space_to_json(self.observation_space),
            "action_space": space_to_json(self.action_space),
        }
        return Checkpoint(self.kind, policy, {"weights": tensors_of(self)})

    @classmethod
    def from_checkpoint(cls, checkpoint: Checkpoint) -> "MultiHeadPolicy":
        """An equal policy, but that no seed is known for its weights."""
        values = checkpoint.policy
        contract = None if values["contract"] is None else PolicyContract.from_dict(values["contract"])
        policy = cls(
            space_from_json(values["observation_space"]),
            space_from_json(values["action_space"]),
            contract=contract,
            env_kwargs=tuples(values["env_kwargs"]),
            seed=0,
            **values["network"],
        )
        policy.seed = None
        policy.load_state_dict(checkpoint.weights["weights"])
        return policy


def _as_array(observation: Any) -> np.ndarray:
    """Numbers of whatever kind as an array.

    Raises:
        InvalidInputError: if there are no numbers in it.
    """
    try:
        plain = observation.detach().cpu() if isinstance(observation, torch.Tensor) else observation
        return np.asarray(plain, dtype=np.float32)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"observations must be arrays of numbers, got {observation!r}") from error
