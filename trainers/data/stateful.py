"""A policy at the controls, with its memory if it has one."""

import inspect
from typing import Any

import numpy as np


class Learner:
    """Asks a policy for actions step by step, and keeps its state by stable-baselines3's recurrent convention.

    ``predict(observation, state, episode_start, deterministic)`` returns the state that the next call is given;
    `episode_start` tells the policy in which rows to forget it. The first state is ``policy.initial_state(n_envs)``
    where there is such a method, or None, and every row begins anew. So several of these can share a policy, and none
    touches what the policy remembers for others. A policy whose `predict` knows no `state` is asked for
    ``predict(observation, deterministic=True)``.

    Args:
        policy: with or without a state.
    """

    def __init__(self, policy: Any) -> None:
        parameters = inspect.signature(policy.predict).parameters
        anything = any(p.kind is p.VAR_KEYWORD for p in parameters.values())
        self._remembers = anything or {"state", "episode_start"} <= set(parameters)
        self._policy = policy
        self._state: Any = None
        self._begun = False

    def act(self, obs: np.ndarray, starts: np.ndarray) -> np.ndarray:
        """The deterministic actions; to be asked at every step, also if they are not used.

        Args:
            obs: the same environments in every call, shape (n_envs, D), or (D,) for a single one.
            starts: True where an episode begins with this observation, bool, shape (n_envs,).

        Returns:
            Shape (n_envs, 12), or (12,).
        """
        if not self._remembers:
            return self._policy.predict(obs, deterministic=True)[0]
        if not self._begun:
            initial_state = getattr(self._policy, "initial_state", None)
            self._state = initial_state(len(np.atleast_2d(obs))) if callable(initial_state) else None
            starts, self._begun = np.ones_like(starts), True
        actions, self._state = self._policy.predict(obs, state=self._state, episode_start=starts, deterministic=True)
        return actions


def act_on_rows(policy: Any, obs: np.ndarray) -> np.ndarray:
    """The deterministic actions of a policy for rows that do not follow one another in time; it remembers none.

    A policy with a clock that it corrects (`trainers.PhaseFreePolicy`) is asked without one, with a correction of 1.
    Any other begins anew at every row.

    Args:
        policy: with or without a state.
        obs: shape (n, D).

    Returns:
        Shape (n, 12).
    """
    alone = policy.with_correction(1.0) if hasattr(policy, "with_correction") else policy
    return Learner(alone).act(obs, np.ones(len(obs), dtype=bool))
