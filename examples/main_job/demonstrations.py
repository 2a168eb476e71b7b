"""What is demonstrated: shards whose seeds tell what they are for."""

from collections.abc import Mapping
from typing import Any

import trainers
from main_job.config import JobConfig


def shard_jobs(
    config: JobConfig,
    seconds: float,
    block: int,
    disturbed: trainers.PerturbationConfig | None = None,
    world: Mapping[str, Any] | None = None,
) -> list[trainers.CollectJob]:
    """Descriptions of shards of `config.shard_s`, one of every task after the other, so that fewer seconds come first.

    Args:
        config: of the students.
        seconds: per task [s].
        block: shards of different blocks and of different `config.seed` have different seeds.
        disturbed: how, or None for the clean expert.
        world: arguments of the environment on top of the students' own.
    """
    first = (config.seed * 10 + block) * 10_000
    env_kwargs = config.env_kwargs | dict(world or {})
    return [
        trainers.CollectJob(task, first + i, config.shard_s, None, disturbed, env_kwargs)
        for i in range(round(seconds / config.shard_s))
        for task in config.tasks
    ]
