"""What the sections that teach their own students share: who is taught, demonstrations and policies on disk."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from main_job.config import JobConfig

import trainers
from student_report.lab import Walker, summary

ALL = "all gaits"
"""Stands for the gait in parts that measure every gait of their student."""


@dataclass(frozen=True)
class Pupil(Walker):
    """A student that its section teaches, and that its section knows by its name."""

    def load(self) -> str:
        """The name."""
        return self.name


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


def rows_of(jobs: Sequence[trainers.CollectJob], folder: Path) -> trainers.Demonstrations:
    """The rows of some demonstrations; those that are not in the folder yet are made."""
    paths = trainers.collect_all(jobs, folder / "demonstrations")
    return trainers.Demonstrations.concatenate([trainers.Demonstrations.load(path) for path in paths])


def kept_policy(path: Path, teach: Callable[[], Any]) -> Any:
    """A policy: read if it is there, else taught on one thread and written."""
    torch.set_num_threads(1)
    if not path.is_file():
        teach().save(path)
    return trainers.load(path)


def pooled(results: Mapping[str, trainers.ClosedLoopResult]) -> dict[str, Any]:
    """`student_lab.summary` of the episodes of all gaits together."""
    episodes = sum((result.episodes for result in results.values()), ())
    return summary(trainers.ClosedLoopResult(ALL, max(result.seconds for result in results.values()), episodes))
