"""What the sections that teach their own students share: who is taught, demonstrations and policies on disk."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

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
