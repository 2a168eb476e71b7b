"""What is demonstrated: shards whose seeds tell what they are for."""

from collections.abc import Mapping
from typing import Any

from trainers.data.collection import CollectJob
from trainers.data.environments import PerturbationConfig
from trainers.pipeline.config import NOISE_RAD, JobConfig


def shard_jobs(
    config: JobConfig,
    seconds: float,
    block: int,
    perturbation: PerturbationConfig | None = None,
    env_kwargs: Mapping[str, Any] | None = None,
) -> list[CollectJob]:
    """Descriptions of shards of `config.shard_s`, one of every task after the other, so that fewer seconds come first.

    Args:
        config: of the job.
        seconds: per task [s].
        block: shards of different blocks and of different `config.seed` have different seeds.
        perturbation: of the episodes, or None for the clean expert.
        env_kwargs: arguments of the environment on top of the job's.
    """
    first = (config.seed * 10 + block) * 10_000
    kwargs = config.env_kwargs | dict(env_kwargs or {})
    return [
        CollectJob(task, first + i, config.shard_s, None, perturbation, kwargs)
        for i in range(config.shards(seconds))
        for task in config.tasks
    ]


def training_jobs(config: JobConfig) -> list[CollectJob]:
    """Shards to learn from: clean ones, perturbed ones, those that are pushed hard, and those with drawn physics."""
    perturbation = config.perturbation(NOISE_RAD)
    jobs = shard_jobs(config, config.clean_s, 0) + shard_jobs(config, config.perturbed_s, 1, perturbation)
    if config.operator is not None and config.hard_push_interval is not None:
        hard = config.perturbation(NOISE_RAD, config.hard_push_interval)
        jobs += shard_jobs(config, config.hard_push_s, 3, hard)
    return jobs + shard_jobs(config, config.randomized_s, 4, perturbation, config.randomization_kwargs(1.0))


def held_out_jobs(config: JobConfig) -> list[CollectJob]:
    """Clean shards of other commands and seeds, for the one-step errors."""
    return shard_jobs(config, config.held_out_s, 2)
