"""The parts of the report on new gaits, and what they share."""

import inspect
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import main_job.config
import main_job.demonstrations
import student_report.lab
from report_parts import digest, finished, sources
from student_report.lab import EXPERT, Walker

import experts
import gait_report.config
import gait_report.methods
import go1_mtl_gym
import trainers
from gait_report.config import NewGaitsConfig, demonstrations, held_out
from gait_report.methods import BEFORE, METHODS, REFERENCES, Lesson, rehearsal
from go1_mtl_gym import TASKS
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import one_of
from trainers.algorithms.add_task import tasks_of
from trainers.policies.checkpoint import versions

OLD = "old gaits"
"""Stands for the gait in the part `BEFORE`."""
MEASURING = (gait_report.config, gait_report.methods, main_job.config, main_job.demonstrations, student_report.lab)
"""Modules that figures depend on, beside those of the packages."""


@dataclass(frozen=True)
class GaitPart:
    """One lesson, or one reference.

    Attributes:
        base: the trained policy.
        gait: that is new to it, or `OLD`.
        method: one of `METHODS` or of `REFERENCES`.
        seconds: of demonstrations [s]; 0 for references.
        train_seed: of the training; 0 for references.
        section: what all share.
        seed: of the evaluation.
        folder: where finished parts are kept.
    """

    base: Walker
    gait: str
    method: str
    seconds: float
    train_seed: int
    section: NewGaitsConfig
    seed: int
    folder: Path

    @property
    def shared(self) -> Path:
        """Folder of demonstrations and students; its name changes with all that could change them."""
        return self.folder / f"new_gaits-{digest((self.base.sha256, repr(self.section), *_code()))}"

    @property
    def path(self) -> Path:
        """File of the finished part."""
        words = (self.gait, self.method.replace(",", ""), f"{self.seconds:g}", str(self.train_seed), str(self.seed))
        return self.shared / "parts" / f"{'-'.join(words).replace(' ', '_')}.json"

    def measure(self) -> dict[str, Any]:
        """The finished part: read if it is there, else measured and written."""
        return finished(self.path, self._figures)

    def _figures(self) -> dict[str, Any]:
        if self.method in REFERENCES:
            figures, what = REFERENCES[self.method](self.base, self.gait, self.section, self.seed), self.method
        else:
            lesson = Lesson(self.base, self.gait, self.method, self.seconds, self.train_seed, self.section, self.shared)
            figures = lesson.measure(self.seed)
            what = f"{self.method}, {self.seconds:g} s, seed {self.train_seed}"
        return {"task": self.gait, "what": what, "figures": figures}


@cache
def _code() -> tuple[str, ...]:
    """The code that figures depend on, and the versions of packages."""
    return (sources(experts, go1_mtl_gym, trainers), *map(inspect.getsource, MEASURING), repr(versions()))


def parts_of(base: Walker, gaits: Sequence[str], config: NewGaitsConfig, seed: int, folder: Path) -> list[GaitPart]:
    """The references, and every gait, method, training seed and budget; the longest lessons come first.

    Raises:
        InvalidInputError: if the policy has a gait already or cannot learn one, or a gait is unknown or named twice.
    """
    known = learnable(base)
    for gait in gaits:
        one_of(gait, [name for name in TASKS if name not in known], "a gait that is new to the policy")
    if len(set(gaits)) != len(gaits):
        raise InvalidInputError(f"a gait was named twice: {' '.join(gaits)}")
    references = [(OLD, BEFORE), *((gait, EXPERT) for gait in gaits)]
    lessons = [
        (gait, method, seconds, train_seed)
        for seconds in reversed(config.seconds)
        for gait in gaits
        for method in METHODS
        for train_seed in config.seeds
    ]
    asked = [(*reference, 0.0, 0) for reference in references] + lessons
    return [GaitPart(base, *each, config, seed, folder) for each in asked]


def learnable(base: Walker) -> tuple[str, ...]:
    """The gaits of a policy that can be given others.

    Raises:
        InvalidInputError: if it has no heads, or sees several frames of proprioception.
    """
    policy = base.load()
    if not isinstance(policy, trainers.MultiHeadPolicy) or policy.pooled or policy.env_kwargs.get("history", 1) != 1:
        raise InvalidInputError(f"a policy with a head per gait that sees one frame was expected, got {base.path}")
    return tasks_of(policy)


def prepare(parts: Sequence[GaitPart], n_jobs: int) -> None:
    """Have everything demonstrated that the lessons share."""
    some = parts[0]
    base, config, gaits = some.base.load(), some.section, {part.gait for part in parts} - {OLD}
    jobs = []
    for gait in sorted(gaits):
        own = [config.job_of(base, (gait,), seed) for seed in config.seeds]
        jobs += [job for each in own for job in demonstrations(each, config.seconds[-1])] + held_out(own[0])
    trainers.collect_all(jobs, some.shared / "demonstrations", n_jobs, progress=True)
    rehearsal(base, config, some.shared)


def assembled(parts: Sequence[GaitPart], results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """What was measured, for tables and figures.

    Returns:
        "report", {gait: {method: [{"seconds", "seeds": {seed: figures}}]}} with rising seconds; "expert", {gait:
        figures}; and "before", {old gait: figures}.
    """
    found: dict[str, Any] = {"report": {}, EXPERT: {}, BEFORE: {}}
    lessons: dict[str, dict[str, dict[float, dict[str, Any]]]] = found["report"]
    for part, result in zip(parts, results, strict=True):
        figures = result["figures"]
        if part.method == EXPERT:
            found[EXPERT][part.gait] = figures
        elif part.method == BEFORE:
            found[BEFORE] = figures
        else:
            levels = lessons.setdefault(part.gait, {}).setdefault(part.method, {})
            levels.setdefault(part.seconds, {})[str(part.train_seed)] = figures
    for methods in lessons.values():
        for method, levels in methods.items():
            methods[method] = [{"seconds": value, "seeds": levels[value]} for value in sorted(levels)]
    return found
