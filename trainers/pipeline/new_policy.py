"""An untrained policy of the size and for the environment that the main job describes."""

from collections.abc import Mapping
from typing import Any

import torch

from go1_mtl_gym.errors import InvalidInputError
from trainers.data.environments import make_env
from trainers.pipeline.config import JobConfig
from trainers.policies.multi_head import MultiHeadPolicy


def new_policy(config: JobConfig, env_kwargs: Mapping[str, Any], pooled: bool = False) -> MultiHeadPolicy:
    """An untrained policy.

    Args:
        config: its size, seed and device.
        env_kwargs: of the environment that it is made for.
        pooled: one head for all tasks, which is not told the task.

    Raises:
        InvalidInputError: if there can be no such environment or policy, or the device is not there.
    """
    check_device(config.device)
    env = make_env(config.tasks[0], **env_kwargs)
    policy = MultiHeadPolicy(
        env.observation_space,
        env.action_space,
        contract=env.unwrapped.contract,
        width=config.width,
        pooled=pooled,
        normalization=config.normalization,
        seed=config.seed,
    )
    env.close()
    return policy.to(torch.device(config.device))


def check_device(device: str) -> str:
    """Return the name of a device that can be trained on.

    Raises:
        InvalidInputError: if it is neither the CPU nor a GPU that is there.
    """
    if device != "cpu" and not (device.startswith("cuda") and torch.cuda.is_available()):
        raise InvalidInputError(f"device must be cpu, or cuda where PyTorch finds a GPU; got {device!r}")
    return device
