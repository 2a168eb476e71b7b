"""Searches for the largest push and the largest command on a grid."""

from collections.abc import Callable, Sequence
from typing import Any

Passes = Callable[[float], bool]
"""Whether a level is withstood."""


def climb(first: float, step: float, steps: int, passes: Passes) -> float:
    """The last level that passes, upward from a likely one; where that does not pass, the next below that does, or 0.

    Args:
        first: level that is tried first.
        step: of the grid.
        steps: largest number of levels above the first.
        passes: whether a level passes.
    """
    if not passes(first):
        lower = [round(first - k * step, 6) for k in range(1, round(first / step))]
        return next((level for level in lower if passes(level)), 0.0)
    largest = first
    for level in (round(first + k * step, 6) for k in range(1, steps + 1)):
        if not passes(level):
            break
        largest = level
    return largest


def scouted(
    levels: Sequence[float],
    below: Sequence[float],
    scout: Passes,
    try_all: Callable[[float], Any],
    good: Callable[[Any], bool],
) -> tuple[tuple[float, Any] | None, float]:
    """Scout upward with few trials until one fails, then come down with all of them, on until what is found is good.

    Args:
        levels: rising.
        below: levels that are tried after the lowest of these, falling.
        scout: whether few trials pass.
        try_all: what all trials give, None if one fails.
        good: whether what they give is good as well.

    Returns:
        The largest level at which no trial failed with what they gave, None if there is none; and the largest at which
        that was also good, 0 if there is none.
    """
    top = 0
    while top < len(levels) and scout(levels[top]):
        top += 1
    passed = None
    for level in [*reversed(levels[:top] or levels[:1]), *below]:
        outcome = try_all(level)
        if outcome is None:
            continue
        passed = passed or (level, outcome)
        if good(outcome):
            return passed, level
    return passed, 0.0
