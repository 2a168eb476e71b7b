"""Sums over gaits and students of what the student's report measured, for its tables and figures."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from student_report.ablation import CHANGED
from student_report.commanded import CORNERS, CORRECTED, DRAWN, PHASE_FREE
from student_report.lab import EXPERT

Report = Mapping[str, Mapping[str, Mapping[str, Any]]]
"""{walker: {gait: {part: figures}}}."""
Count = tuple[int, int]
"""Successful trials, and all of them; (0, 0) where nothing was measured."""


def gaits_of(report: Report) -> list[str]:
    """All gaits in it, in the order of the first walker that has them."""
    return list(dict.fromkeys(gait for tasks in report.values() for gait in tasks))


def pooled(parts: Iterable[Mapping[str, Any]]) -> Count:
    """Successes and trials of several parts together."""
    parts = list(parts)
    return sum(part["succeeded"] for part in parts), sum(part["trials"] for part in parts)


def mean(values: Iterable[float | None]) -> float | None:
    """Mean of the values that are there; None if there are none."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def seeds_of(report: Report, gait: str, what: str) -> dict[str, Mapping[str, Any]]:
    """{student: figures} of one part, without the expert."""
    return {name: tasks[gait][what] for name, tasks in report.items() if name != EXPERT and what in tasks.get(gait, {})}


def commanded_sums(report: Report, gait: str) -> dict[str, Any]:
    """Of all training seeds together, in one gait.

    Returns:
        "drawn", "corners", "phase_free" and "clock with correction": see `pooled`; "expert_corners": likewise; "worst":
        smallest success rate of a seed; "error", "worst_error", "expert_error": mean and largest velocity error of a
        seed and the expert's [m/s]; "worst_ratio": largest of the seeds'. None for what was not measured, or for what
        there is none of because a student kept falling.
    """
    drawn = list(seeds_of(report, gait, DRAWN).values())
    expert = report.get(EXPERT, {}).get(gait, {})
    return {
        **{what: pooled(seeds_of(report, gait, what).values()) for what in (DRAWN, CORNERS, PHASE_FREE, CORRECTED)},
        "expert_corners": pooled([expert[CORNERS]] if CORNERS in expert else []),
        "worst": min((own["success_rate"] for own in drawn), default=None),
        "error": mean(own["velocity_error"] for own in drawn),
        "worst_error": _largest(own["velocity_error"] for own in drawn),
        "expert_error": expert[DRAWN]["velocity_error"] if DRAWN in expert else None,
        "worst_ratio": _largest(own["error_ratio"] for own in drawn),
    }


def variant_sums(tasks: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Of all gaits of one student together.

    Returns:
        "gaits": {gait: count} and "success", their sum; "switching"; "changed": counts; "error" [m/s] and "r2": means
        over gaits. Counts are as in `pooled`.
    """
    drawn = {gait: parts[DRAWN] for gait, parts in tasks.items() if DRAWN in parts}
    return {
        "gaits": {gait: pooled([part]) for gait, part in drawn.items()},
        "success": pooled(drawn.values()),
        "switching": pooled(part for parts in tasks.values() for what, part in parts.items() if what in tasks),
        "changed": pooled(parts[CHANGED] for parts in tasks.values() if CHANGED in parts),
        "error": mean(part["velocity_error"] for part in drawn.values()),
        "r2": mean(parts["held_out"]["r2"] for parts in tasks.values()),
    }


def _largest(values: Iterable[float | None]) -> float | None:
    """The largest; None if there is none, or if one is None: it would have been the worst."""
    values = list(values)
    return None if None in values or not values else max(values)
