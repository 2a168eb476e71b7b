"""A policy where stable-baselines3's `VecNormalize` has changed the observations."""

from typing import Any, Protocol

import numpy as np
from stable_baselines3.common.vec_env import VecEnv, VecNormalize, unwrap_vec_wrapper

from go1_mtl_gym.errors import InvalidInputError

ROUNDING = 1e-4
"""By how much an observation may differ from the one that `VecNormalize` gave, in standard deviations."""


class Predicts(Protocol):
    """Whatever has stable-baselines3's `predict`."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = False,
    ) -> tuple[np.ndarray, Any]:
        """Actions, and the state for the next call."""


class OriginalObs:
    """Drives a policy of this package in environments whose observations are normalized for another learner.

    Its observations mean what the contract says, and it normalizes them by itself; normalized twice they mean nothing.
    So what it is shown is what the environments gave before `VecNormalize` changed it, exactly.

    Args:
        policy: of this package, or any other that learned from observations as they are.
        venv: vector environment with a `VecNormalize` among its wrappers.

    Raises:
        InvalidInputError: if there is no `VecNormalize`.
    """

    def __init__(self, policy: Predicts, venv: VecEnv) -> None:
        normalizing = unwrap_vec_wrapper(venv, VecNormalize)
        if normalizing is None:
            raise InvalidInputError(f"a vector environment with VecNormalize was expected, got {type(venv).__name__}")
        self.policy = policy
        self._normalizing = normalizing

    def predict(
        self,
        observation: np.ndarray,
        state: Any = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = False,
    ) -> tuple[np.ndarray, Any]:
        """Actions for the observations that the vector environment gave last, and the state for the next call.

        Args:
            observation: as `VecNormalize` gave it, shape (n_envs, D).
            state: of the policy; see its `predict`.
            episode_start: True where an episode begins, shape (n_envs,).
            deterministic: without exploration noise.

        Raises:
            InvalidInputError: if that is not what it gave last; the original of any other is not known.
        """
        if not hasattr(self._normalizing, "old_obs"):  # stable-baselines3 has it from the first reset on
            raise InvalidInputError("the vector environment was never reset: call its reset() first")
        original = self._normalizing.get_original_obs()
        shown = np.asarray(self._normalizing.normalize_obs(original))
        if np.shape(observation) != shown.shape:
            raise InvalidInputError(
                f"the observations of shape {shown.shape} that VecNormalize gave last were expected, got some of shape "
                f"{np.shape(observation)}"
            )
        if not np.allclose(observation, shown, rtol=0.0, atol=ROUNDING):
            raise InvalidInputError(
                "the observations that VecNormalize gave last were expected, got others of equal shape; what is not "
                "normalized goes to the policy itself"
            )
        return self.policy.predict(original, state, episode_start, deterministic)
