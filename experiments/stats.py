"""Records put together: sums, means and intervals of groups."""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from trainers.evaluation.metrics import wilson_interval

Record = dict[str, Any]
"""{"study", "agent", "task", "condition", "seed", metrics ...}."""
Z_95 = float(stats.norm.ppf(0.975))
"""Of two-sided 95 % intervals."""


class Rate(NamedTuple):
    """Successes of trials, with Wilson's 95 % interval (Wilson, 1927); NaN where there are no trials."""

    successes: int
    trials: int

    @property
    def value(self) -> float:
        """The share."""
        return self.successes / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper bound."""
        return wilson_interval(self.successes, self.trials, Z_95) if self.trials else (math.nan, math.nan)


class Estimate(NamedTuple):
    """A mean, half the width of its 95 % interval (NaN for a single value), and the number of values."""

    mean: float
    half: float
    count: int


class Group(tuple[Record, ...]):
    """Some records, taken together."""

    def where(self, **values: Any) -> "Group":
        """The records that have these values."""
        return Group(record for record in self if all(record.get(name) == value for name, value in values.items()))

    def total(self, key: str) -> int:
        """Sum over the records that have it."""
        return sum(record[key] for record in self if record.get(key) is not None)

    def rate(self, key: str = "succeeded") -> Rate:
        """A count of the "trials" of those records that have both."""
        known = [record for record in self if record.get(key) is not None]
        return Rate(sum(record[key] for record in known), sum(record["trials"] for record in known))

    def values(self, key: str) -> list[float]:
        """The values that are there."""
        return [record[key] for record in self if record.get(key) is not None]

    def mean(self, key: str) -> float | None:
        """Mean of the values that are there; None if there are none."""
        known = self.values(key)
        return float(np.mean(known)) if known else None

    def largest(self, key: str) -> float | None:
        """The largest value; None if there is no record, or one without: that would have been the worst."""
        known = self.values(key)
        return max(known) if self and len(known) == len(self) else None


def estimate(values: Sequence[float]) -> Estimate:
    """Mean with its 95 % interval by Student's t: half width t_{.975, n-1} s / sqrt(n), with s over n - 1."""
    n = len(values)
    mean = float(np.mean(values)) if n else math.nan
    if n < 2:
        return Estimate(mean, math.nan, n)
    half = stats.t.ppf(0.975, n - 1) * np.std(values, ddof=1) / math.sqrt(n)
    return Estimate(mean, float(half), n)


def group(records: Iterable[Record], by: str | Sequence[str]) -> dict[Any, Group]:
    """The records by the values of one key, or by the tuples of values of several; keys that are missing are None."""
    groups: dict[Any, list[Record]] = {}
    for record in records:
        key = record.get(by) if isinstance(by, str) else tuple(record.get(name) for name in by)
        groups.setdefault(key, []).append(record)
    return {key: Group(members) for key, members in groups.items()}


def drops(before: Rate, after: Rate) -> bool:
    """Whether a share falls by more than the 95 % interval of the difference.

    p - q > sqrt((p - l)^2 + (u - q)^2), with p and its lower bound l before, q and its upper bound u after (Newcombe,
    1998, method 10).
    """
    p, q = before.value, after.value
    return p - q > math.hypot(p - before.interval[0], after.interval[1] - q) + 1e-9


def spread(values: Sequence[float]) -> list[float]:
    """Lower quartile, median and upper quartile."""
    return [float(value) for value in np.quantile(values, (0.25, 0.5, 0.75))]
