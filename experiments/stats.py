"""Rates, means and their intervals."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

from trainers.evaluation.metrics import exact_interval


class Rate(NamedTuple):
    """Successes of trials, with Clopper and Pearson's exact 95 % interval; NaN where there are no trials."""

    successes: int
    trials: int

    @property
    def value(self) -> float:
        """The share."""
        return self.successes / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper bound."""
        return exact_interval(self.successes, self.trials) if self.trials else (math.nan, math.nan)


class Estimate(NamedTuple):
    """A mean, half the width of its 95 % interval (NaN for a single value), and the number of values."""

    mean: float
    half: float
    count: int


def estimate(values: Sequence[float]) -> Estimate:
    """Mean with its 95 % interval by Student's t: half width t_{.975, n-1} s / sqrt(n), with s over n - 1."""
    n = len(values)
    mean = float(np.mean(values)) if n else math.nan
    if n < 2:
        return Estimate(mean, math.nan, n)
    half = stats.t.ppf(0.975, n - 1) * np.std(values, ddof=1) / math.sqrt(n)
    return Estimate(mean, float(half), n)


def drops(before: Rate, after: Rate) -> bool:
    """Whether a share falls by more than the 95 % interval of the difference.

    p - q > sqrt((p - l)^2 + (u - q)^2), with p and its lower bound l before, q and its upper bound u after: method 10
    of Newcombe (1998), with exact bounds in place of Wilson's.
    """
    p, q = before.value, after.value
    return p - q > math.hypot(p - before.interval[0], after.interval[1] - q) + 1e-9


def spread(values: Sequence[float]) -> list[float]:
    """Lower quartile, median and upper quartile."""
    return [float(value) for value in np.quantile(values, (0.25, 0.5, 0.75))]
