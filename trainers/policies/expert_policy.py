"""The environment's expert in the shape of a stable-baselines3 policy."""

from typing import Any

import numpy as np
import torch
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.vec_env import VecEnv

from go1_mtl_gym.errors import InvalidInputError


class ExpertPolicy(BasePolicy):
    """Asks each environment of a vector environment for the expert's action at its present state.

    The observation is not looked at: row i of the answer belongs to environment i *now*. In a ``SubprocVecEnv`` all
    workers are asked before the first answer is awaited, so the experts solve in parallel.

    Args:
        venv: vector environment whose members have a method ``expert_action() -> (12,)`` without side effects.
    """

    def __init__(self, venv: VecEnv) -> None:
        super().__init__(venv.observation_space, venv.action_space)
        self._venv = venv

    def predict(  # type: ignore[override]  # flat spaces: never a dict
        self,
        observation: np.ndarray,
        state: Any = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, Any]:
        """Expert actions, float32, shape (n_envs, 12).

        Raises:
            InvalidInputError: if the batch does not have one row per environment.
        """
        if len(observation) != self._venv.num_envs:
            raise InvalidInputError(
                f"ExpertPolicy answers for all {self._venv.num_envs} environments at once, got {len(observation)} rows"
            )
        return np.stack(self._venv.env_method("expert_action")).astype(np.float32), state

    def _predict(  # type: ignore[override]  # flat spaces: never a dict
        self, observation: torch.Tensor, deterministic: bool = True
    ) -> torch.Tensor:
        return torch.as_tensor(self.predict(observation.cpu().numpy())[0], device=observation.device)
