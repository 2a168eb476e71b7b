"""What several trainings of one kind of student make together, and whether it is what was aimed at."""

import math
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from paper_report.published import FIGURES, KINDS, MULTI_HEAD, POOLED

AIMS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {"simulation": {"trot": 0.99, "jump": 0.99, "bound": 0.99}, "hardware": {"trot": 0.971, "walk": 0.961}}
)
"""Table of the paper -> gait -> the R2 that a multi-head student is to exceed."""


class Learner(NamedTuple):
    """Students that differ in their seed alone; sorted, narrow ones come first, in the order of `KINDS`.

    Attributes:
        width: units of every hidden layer.
        steps: gradient steps.
        precision: of the training, one of `paper_report.config.PRECISIONS`.
        rank: place of the kind in `KINDS`.
    """

    width: int
    steps: int
    precision: str
    rank: int

    @property
    def kind(self) -> str:
        """Of student, one of `KINDS`."""
        return [*KINDS][self.rank]


def learner_of(student: Mapping[str, Any]) -> Learner:
    """The learner that a student is of, by what is known of it."""
    return Learner(student["width"], student["steps"], student["precision"], [*KINDS].index(student["kind"]))


class Estimate(NamedTuple):
    """A mean over training seeds.

    Attributes:
        mean: of the values.
        half: half the width of its 95 % interval; NaN for a single value.
        count: of the values.
    """

    mean: float
    half: float
    count: int


def estimate(values: Sequence[float]) -> Estimate:
    """Mean and 95 % interval by Student's t: half width t_{.975, n-1} s / sqrt(n), with s over n - 1."""
    n = len(values)
    if n < 2:
        return Estimate(float(np.mean(values)), math.nan, n)
    half = stats.t.ppf(0.975, n - 1) * np.std(values, ddof=1) / math.sqrt(n)
    return Estimate(float(np.mean(values)), float(half), n)


def learners(students: Iterable[Mapping[str, Any]]) -> dict[Learner, list[Mapping[str, Any]]]:
    """The students of every learner, sorted."""
    found: dict[Learner, list[Mapping[str, Any]]] = {}
    for own in students:
        found.setdefault(learner_of(own), []).append(own)
    return dict(sorted(found.items()))


def scores(students: Iterable[Mapping[str, Any]], gait: str, use: str) -> dict[Learner, dict[str, Estimate]]:
    """{learner: {figure: estimate}} in one gait, of the learners that know it.

    Args:
        students: what is known of them.
        gait: name of the task.
        use: which held-out rows.
    """
    found = {}
    for learner, own in learners(students).items():
        known = [student["scores"][use][gait] for student in own if gait in student["scores"].get(use, {})]
        if known:
            found[learner] = {name: estimate([score[name] for score in known]) for name in known[0]}
    return found


def uses(students: Iterable[Mapping[str, Any]]) -> list[str]:
    """Kinds of held-out rows that students were measured on."""
    return list(dict.fromkeys(use for student in students for use in student["scores"]))


def worse_than_pooled(own: Mapping[str, Estimate], pooled: Mapping[str, Estimate]) -> list[str]:
    """Those of `FIGURES` in which a learner's mean is not better than the pooled one's."""
    sign = {name: 1.0 if name == "r2" else -1.0 for name in FIGURES}
    return [name for name in FIGURES if not sign[name] * (own[name].mean - pooled[name].mean) > 0.0]


def verdicts(name: str, students: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Whether every multi-head learner reaches its aim and beats its pooled counterpart.

    Args:
        name: of the table of the paper.
        students: what is known of them.

    Returns:
        One per gait, held-out rows and multi-head learner: "gait", "use", "width", "steps", "precision", "aim", "r2"
        (mean), "reached", and "worse": figures in which pooled students of this width, precision and number of steps
        are as good or better; None if there are none of these.
    """
    found = []
    for gait, aim in AIMS[name].items():
        for use in uses(students):
            own = scores(students, gait, use)
            for learner in own:
                if learner.kind != MULTI_HEAD:
                    continue
                rival = own.get(learner._replace(rank=[*KINDS].index(POOLED)))
                r2 = own[learner]["r2"].mean
                found.append(
                    {
                        "gait": gait,
                        "use": use,
                        "width": learner.width,
                        "steps": learner.steps,
                        "precision": learner.precision,
                        "aim": aim,
                        "r2": r2,
                        "reached": r2 > aim,
                        "worse": None if rival is None else worse_than_pooled(own[learner], rival),
                    }
                )
    return found
