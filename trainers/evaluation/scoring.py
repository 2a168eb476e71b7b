"""What an episode is scored by, and the scores of several."""

import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from go1_mtl_gym import TASKS, Gait
from go1_mtl_gym.gaits import gait_of
from go1_mtl_gym.tasks import ANY_GAIT
from trainers.evaluation.metrics import exact_interval, touchdowns, tracking_error
from trainers.utils.files import json_ready

SETTLE_S = 2.0
"""Start of an episode that counts for survival only [s]."""
MIN_AIR_SHARE = 0.5
"""A foot that was off the ground for less than this share of the gait's planned swing has bounced, not stepped."""
VELOCITY_TOLERANCE = 0.15
"""Largest velocity error of a success [m/s]."""
STEP_RATE_TOLERANCE = 0.25
"""Largest relative deviation of a leg's touchdown rate from the gait's in a success."""
STAND_TOUCHDOWNS = 1
"""Touchdowns that a leg may always have too many or too few of in an episode that stands for a while."""


@dataclasses.dataclass(frozen=True)
class Series:
    """What was measured after each of n steps.

    Attributes:
        measured: (vx [m/s], vy [m/s], yaw rate [rad/s]), shape (n, 3).
        wanted: the filtered command, shape (n, 3).
        contacts: feet on the ground, bool, shape (n, 4).
        running: whether the gait clock ran during the step, bool, shape (n,).
        commands: as asked for, shape (n, 3).
        tasks: names of the tasks whose gait the clock was of, after each step.
        moves: what the hands were doing, if there are any; empty otherwise.
        events: what they did in each step besides: "push", or the name of a task; empty without hands.
        gait_numbers: `go1_mtl_gym.Gait.numbers` of the gait after each step, shape (n, 12); None: those of the tasks.
    """

    measured: np.ndarray
    wanted: np.ndarray
    contacts: np.ndarray
    running: np.ndarray
    commands: np.ndarray
    tasks: tuple[str, ...]
    moves: tuple[str, ...] = ()
    events: tuple[tuple[str, ...], ...] = ()
    gait_numbers: np.ndarray | None = None

    @functools.cached_property
    def gaits(self) -> tuple[Gait, ...]:
        """Gait after each step."""
        if self.gait_numbers is None:
            return tuple(TASKS[name].gait for name in self.tasks)
        known = {numbers.tobytes(): numbers for numbers in self.gait_numbers}
        made = {key: gait_of(numbers, ANY_GAIT) for key, numbers in known.items()}
        return tuple(made[numbers.tobytes()] for numbers in self.gait_numbers)


@dataclasses.dataclass(frozen=True)
class EpisodeRecord:
    """One episode.

    Attributes:
        seed: that the environment was reset with.
        commands: (vx, vy, yaw rate) in the order they were given.
        survival_s: time until the fall, or the whole duration [s].
        fallen: whether it fell.
        velocity_error: `trainers.evaluation.metrics.tracking_error` after the first 2 s [m/s]; NaN if it fell too
            early to tell.
        yaw_rate_error: likewise [rad/s].
        step_rate: touchdowns per second of each leg after the first 2 s [1/s], each after at least half a planned swing
            in the air; NaN if it fell within them.
        success: survived, velocity error <= 0.15 m/s, and every leg stepped at the gait's rate: within 25 % of 1 / gait
            period times the share of the time after the first 2 s in which the gait clock ran. If the robot was to
            stand for a while, one touchdown more or less is allowed, so one that stands throughout may make one.
    """

    seed: int
    commands: tuple[tuple[float, float, float], ...]
    survival_s: float
    fallen: bool
    velocity_error: float
    yaw_rate_error: float
    step_rate: tuple[float, float, float, float]
    success: bool


@dataclasses.dataclass(frozen=True)
class ClosedLoopResult:
    """Several episodes of one task.

    Means of errors and rates leave out the episodes that fell too early to have one (NaN if all did).

    Attributes:
        task: name of the task.
        seconds: duration of an episode without a fall [s].
        episodes: the records.
    """

    task: str
    seconds: float
    episodes: tuple[EpisodeRecord, ...]

    @property
    def survival_rate(self) -> float:
        """Share of episodes without a fall."""
        return float(np.mean([not e.fallen for e in self.episodes]))

    @property
    def survival_s(self) -> float:
        """Mean time until the fall or the end [s]."""
        return float(np.mean([e.survival_s for e in self.episodes]))

    @property
    def velocity_error(self) -> float:
        """Mean velocity error [m/s]."""
        return _mean([e.velocity_error for e in self.episodes])

    @property
    def yaw_rate_error(self) -> float:
        """Mean yaw rate error [rad/s]."""
        return _mean([e.yaw_rate_error for e in self.episodes])

    @property
    def step_rate(self) -> float:
        """Mean touchdowns per leg per second [1/s]."""
        return _mean(np.ravel([e.step_rate for e in self.episodes]))

    @property
    def success_rate(self) -> float:
        """Share of episodes that survived, tracked and stepped."""
        return float(np.mean([e.success for e in self.episodes]))

    @property
    def success_interval(self) -> tuple[float, float]:
        """95 % interval (Clopper and Pearson's) of the success rate."""
        return exact_interval(sum(e.success for e in self.episodes), len(self.episodes))

    def __str__(self) -> str:
        """One line for people; `repr` has every episode."""
        count, low, high = len(self.episodes), *self.success_interval
        return (
            f"{self.task}: {sum(e.success for e in self.episodes)} of {count} episodes of {self.seconds:g} s succeed "
            f"(95 % interval {low:.0%} ... {high:.0%}), {sum(not e.fallen for e in self.episodes)} survive, "
            f"velocity error {self.velocity_error:.3f} m/s, {self.step_rate:.2f} steps/s"
        )

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready values; NaN becomes None."""
        names = ("survival_rate", "survival_s", "velocity_error", "yaw_rate_error", "step_rate", "success_rate")
        summary = {name: getattr(self, name) for name in (*names, "success_interval", "task", "seconds")}
        return json_ready(summary | {"episodes": [dataclasses.asdict(e) for e in self.episodes]})


def score(
    series: Series,
    fallen: bool,
    seed: int,
    commands: tuple[tuple[float, float, float], ...],
    control_hz: float,
    task: str | None = None,
) -> EpisodeRecord:
    """Figures of one episode.

    Args:
        series: from the time on that the gait was asked for.
        fallen: whether it ended in a fall.
        seed: kept in the record.
        commands: likewise.
        control_hz: steps per second.
        task: name of what was asked for all the time; None where it changed: what the environment says it was.
    """
    if task is not None and task != ANY_GAIT:
        series = dataclasses.replace(series, tasks=(task,) * len(series.tasks), gait_numbers=None)
    skip, steps = round(SETTLE_S * control_hz), len(series.measured)
    window = max(1, round(max((gait.period for gait in series.gaits), default=0.0) * control_hz))
    velocity_error, yaw_error = tracking_error(series.measured, series.wanted, window, skip)
    counted_s = (steps - skip) / control_hz
    rate, stepped = np.full(4, np.nan), False
    if counted_s > 0:
        count = touchdowns(series.contacts, _min_air(series, control_hz), skip)
        cycles = np.array([gait.step_rate for gait in series.gaits]) / control_hz
        wanted_count = (cycles * series.running)[skip:].sum()
        stood = 0 if series.running[skip:].all() else STAND_TOUCHDOWNS
        slack = max(STEP_RATE_TOLERANCE * wanted_count, stood) + _changes_of_gait(series, skip)
        rate, stepped = count / counted_s, bool((np.abs(count - wanted_count) <= slack + 1e-9).all())
    return EpisodeRecord(
        seed=seed,
        commands=commands,
        survival_s=steps / control_hz,
        fallen=fallen,
        velocity_error=velocity_error,
        yaw_rate_error=yaw_error,
        step_rate=tuple(rate.tolist()),
        success=bool(not fallen and velocity_error <= VELOCITY_TOLERANCE and stepped),
    )


def _min_air(series: Series, control_hz: float) -> np.ndarray:
    """Samples in the air that make a flight, at every step, int, shape (n, 4)."""
    swing_s = np.array([gait.swing_s for gait in series.gaits]).reshape(-1, 4)
    return np.ceil(MIN_AIR_SHARE * swing_s * control_hz - 1e-9).astype(int)


def _changes_of_gait(series: Series, skip: int) -> int:
    """After the first samples: each change cuts a cycle short, so that a leg may have one touchdown too many or few.

    A gait that becomes another one bit by bit changes once.
    """
    gaits = series.gaits[skip:]
    changed = [before != after for before, after in zip(gaits, gaits[1:])]
    return sum(now and not before for before, now in zip([False, *changed], changed))


def _mean(values: Sequence[float] | np.ndarray) -> float:
    known = [value for value in values if not math.isnan(value)]
    return float(np.mean(known)) if known else math.nan
