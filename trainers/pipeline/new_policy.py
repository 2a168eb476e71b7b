"""An untrained policy of the size and for the environment that the main job describes."""

from collections.abc import Mapping
from typing import Any

from trainers.data.environments import base_env, make_env
from trainers.pipeline.config import JobConfig
from trainers.policies.checkpoint import checked_device
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
    device = checked_device(config.device)
    env = make_env(config.tasks[0], **env_kwargs)
    policy = MultiHeadPolicy(
        env.observation_space,
        env.action_space,
        contract=base_env(env).contract,
        width=config.width,
        pooled=pooled,
        normalization=config.normalization,
        seed=config.seed,
    )
    env.close()
    return policy.to(device)
