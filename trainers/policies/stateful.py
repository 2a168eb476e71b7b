"""A policy at the controls, with its memory if it has one."""

import inspect
from typing import Any

import numpy as np


class Learner:
    """Asks a policy for actions step by step, and keeps its state by stable-baselines3's recurrent convention.

    ``predict(observation, state, episode_start, deterministic)`` returns the state that the next call is given;
    `episode_start` tells the policy in which rows to forget it. A policy whose `predict` knows no `state` is asked for
    ``predict(observation, deterministic=True)``.

    Args:
        policy: with or without a state.
    """

    def __init__(self, policy: Any) -> None:
        parameters = inspect.signature(policy.predict).parameters
        anything = any(p.kind is p.VAR_KEYWORD for p in parameters.values())
        self._remembers = anything or {"state", "episode_start"} <= set(parameters)
        self._predict = policy.predict
        self._state: Any = None

    def act(self, obs: np.ndarray, starts: np.ndarray) -> np.ndarray:
        """The deterministic actions; to be asked at every step, also if they are not used.

        Args:
            obs: the same environments in every call, shape (n_envs, D), or (D,) for a single one.
            starts: True where an episode begins with this observation, bool, shape (n_envs,).

        Returns:
            Shape (n_envs, 12), or (12,).
        """
        if not self._remembers:
            return self._predict(obs, deterministic=True)[0]
        actions, self._state = self._predict(obs, state=self._state, episode_start=starts, deterministic=True)
        return actions
