"""Who walks in the student's report, and how several episodes are summed up."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import trainers
from go1_mtl_gym import TASKS
from go1_mtl_gym.env_config import EXPERT_ONLY
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sim.physics_params import PhysicsParams
from trainers.evaluation.metrics import wilson_interval

EXPERT = "expert"
SHARED = ("tasks", "control_hz", "kp", "kd")
"""Arguments of the students' environments that the expert's has as well; the others shape what only students see."""

WORLD = ("randomization", "noise", *EXPERT_ONLY, *(each.name for each in fields(PhysicsParams)))
"""Arguments in which the environment that a student was trained in may differ; here all walk in the model's world."""


@dataclass(frozen=True)
class Walker:
    """A student on disk, or the expert.

    Attributes:
        name: what it is called in tables and figures.
        path: the student's file; None is the expert.
        sha256: of the file.
        env_kwargs: of the expert's environment; a student brings its own.
        only: parts of a section that are measured of it; none: all.
    """

    name: str
    path: Path | None = None
    sha256: str = ""
    env_kwargs: dict[str, Any] = field(default_factory=dict)
    only: tuple[str, ...] = ()

    @classmethod
    def student(cls, name: str, path: str | Path, only: tuple[str, ...] = ()) -> "Walker":
        """The student in a file."""
        return cls(name, Path(path), hashlib.sha256(Path(path).read_bytes()).hexdigest(), only=only)

    def load(self) -> Any:
        """What `trainers.evaluate` takes: the policy, for an environment without its `WORLD`, or "expert"."""
        if self.path is None:
            return EXPERT
        policy = trainers.load(self.path)
        policy.env_kwargs = {name: value for name, value in policy.env_kwargs.items() if name not in WORLD}
        return policy


def walkers(policies: Sequence[str]) -> list[Walker]:
    """The students and, last, the expert, in an environment of the same tasks, control rate and gains.

    Args:
        policies: "name=path", or a path, which is called "student".

    Raises:
        InvalidInputError: if a name is empty, taken or the expert's, or the students' environments differ in `SHARED`.
        CheckpointError: if a file is no policy.
    """
    found, shared = [], []
    for policy in policies:
        name, path = policy.split("=", 1) if "=" in policy else ("student", policy)
        if not name or name in (EXPERT, *(walker.name for walker in found)):
            raise InvalidInputError(f"expected another name than {EXPERT!r} for every policy, got {list(policies)}")
        kwargs = {"tasks": tuple(TASKS)} | trainers.load(path).env_kwargs
        shared.append({key: kwargs[key] for key in SHARED if key in kwargs})
        found.append(Walker.student(name, path))
    if any(own != shared[0] for own in shared):
        raise InvalidInputError(f"expected students for the same {', '.join(SHARED)}, got {shared}")
    return [*found, Walker(EXPERT, env_kwargs=shared[0])]


def summary(result: trainers.ClosedLoopResult) -> dict[str, Any]:
    """Counts, rates with their 95 % Wilson intervals and the mean velocity error [m/s] of some episodes."""
    trials = len(result.episodes)
    survived, succeeded = (sum(flags) for flags in zip(*((not e.fallen, e.success) for e in result.episodes)))
    return {
        "trials": trials,
        "survived": survived,
        "survival_rate": result.survival_rate,
        "survival_interval": wilson_interval(survived, trials),
        "succeeded": succeeded,
        "success_rate": result.success_rate,
        "success_interval": result.success_interval,
        "velocity_error": result.velocity_error,
    }
