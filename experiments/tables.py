"""Cells and tables in Markdown."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from experiments.results import Group
from experiments.stats import Estimate, Rate
from go1_mtl_gym.validation import one_of
from trainers.utils.report import markdown, number

__all__ = [
    "count", "estimated", "first", "judged", "markdown", "mean", "number", "percent", "settings", "share", "spans",
    "table",
]  # fmt: skip
Column = Callable[[Group], str]
"""Writes the cell of some records."""


def count(rate: Rate, target: float = 0.0) -> str:
    """Successes of trials; bold where their share is below a target, "-" without trials."""
    if not rate.trials:
        return "-"
    text = f"{rate.successes}/{rate.trials}"
    return text if rate.successes >= target * rate.trials - 1e-9 else f"**{text}**"


def table(groups: Mapping[Any, Group], labels: Sequence[str], columns: Mapping[str, Column]) -> str:
    """One row per group.

    Args:
        groups: key, or tuple of keys, -> records; the keys stand first.
        labels: headers of the keys.
        columns: header -> what writes a group's cell.
    """
    keys = {key: key if isinstance(key, tuple) else (key,) for key in groups}
    rows = [[*map(str, keys[key]), *(cell(members) for cell in columns.values())] for key, members in groups.items()]
    return markdown([*labels, *columns], rows, text_columns=len(labels))


def share(key: str = "succeeded", target: float = 0.0, **where: Any) -> Column:
    """A column of `count` of the records that have some values."""
    return lambda members: count(members.where(**where).rate(key), target)


def mean(key: str, how: str, **where: Any) -> Column:
    """A column of means of the records that have some values; "-" where there is none."""
    return lambda members: number(members.where(**where).mean(key), how)


def first(key: str, how: str) -> Column:
    """A column of the first record's list of numbers; "-" without."""
    return lambda members: " ".join(f"{value:{how}}" for value in members[0].get(key, ())) or "-"


def percent(rate: Rate) -> str:
    """A share in percent."""
    return f"{rate.value:.0%}" if rate.trials else "-"


def estimated(value: Estimate, how: str) -> str:
    """A mean, with half the width of its interval where it has one."""
    return number(value.mean, how) + ("" if math.isnan(value.half) else f" ± {value.half:{how}}")


def judged(value: float | None, target: float, better: str, how: str) -> str:
    """A number; bold where it misses its target, as one does that is not there.

    Args:
        value: the number.
        target: that it is held against.
        better: "higher" or "lower".
        how: its format.
    """
    sign = 1.0 if one_of(better, ("higher", "lower"), "better") == "higher" else -1.0
    text = number(value, how)
    return text if value is not None and sign * (value - target) >= -1e-9 else f"**{text}**"


def spans(spread: Sequence[float] | None, how: str = ".2f") -> str:
    """Median and quartiles of `stats.spread`; "-" without."""
    if spread is None:
        return "-"
    low, median, high = spread
    return f"{median:{how}} ({low:{how}} ... {high:{how}})"


def settings(values: Mapping[str, float]) -> str:
    """Names and their values, in words."""
    return ", ".join(f"{name} {value:g}" for name, value in values.items())
