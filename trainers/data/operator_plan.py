"""What one pair of hands does in an episode, drawn before it begins."""

import bisect
import dataclasses
import functools
from collections.abc import Sequence

import numpy as np

from go1_mtl_gym.gait_space import GaitSpace
from go1_mtl_gym.gaits import Gait
from go1_mtl_gym.wrappers import GAIT_SLEW_S
from trainers.data.operator import MOVES, OperatorConfig

RELEASED = (0.0, 0.0, 0.0)
"""The stick that nobody holds."""
SWEEP_S = 0.15
"""How long a hand takes from one position of the stick to another if it neither jerks nor takes its time [s]."""


@dataclasses.dataclass(frozen=True)
class Segment:
    """The stick on its way from one position to another at constant speed, or resting.

    Attributes:
        start_s: when it begins [s].
        end_s: when it is there [s]; the next segment begins then.
        before: position at the start, in [-1, 1]^3.
        after: position at the end.
        move: the one of `MOVES` that it belongs to.
    """

    start_s: float
    end_s: float
    before: tuple[float, float, float]
    after: tuple[float, float, float]
    move: str


@dataclasses.dataclass(frozen=True)
class Push:
    """A push of the trunk.

    Attributes:
        time_s: when [s].
        angle: where to, from forward to the left, in the heading frame [rad].
        size: change of velocity [m/s]; of a hard push, as a share of `Task.largest_push`.
        hard: whether it is one.
    """

    time_s: float
    angle: float
    size: float
    hard: bool = False


@dataclasses.dataclass(frozen=True)
class NextGait:
    """A gait that is asked for.

    Attributes:
        gait: which.
        slew_s: how long the present one takes to become it; 0 lets it begin at once [s].
    """

    gait: Gait
    slew_s: float


@dataclasses.dataclass(frozen=True)
class OperatorPlan:
    """All that one pair of hands will do in an episode, whatever the robot does.

    Attributes:
        task: that the episode begins in.
        segments: of the stick, in order of time, without gaps.
        changes: (time [s], task) of each change of gait, in order.
        pushes: in order of time.
        gaits: that each change asks for, where any gait can be; empty where tasks have their own.
    """

    task: str
    segments: tuple[Segment, ...]
    changes: tuple[tuple[float, str], ...]
    pushes: tuple[Push, ...]
    gaits: tuple[NextGait, ...] = ()

    def move(self, time_s: float) -> str:
        """What the hand is doing at a time."""
        return self._segment(time_s).move

    def stick(self, time_s: float) -> np.ndarray:
        """Position of the stick at a time, in [-1, 1]^3, shape (3,)."""
        segment = self._segment(time_s)
        span = segment.end_s - segment.start_s
        done = 1.0 if span <= 0.0 else min(max((time_s - segment.start_s) / span, 0.0), 1.0)
        return (1.0 - done) * np.array(segment.before) + done * np.array(segment.after)

    def changes_in(self, after_s: float, until_s: float) -> list[str]:
        """The tasks that are asked for later than one time and not later than another, in order."""
        return [task for time_s, task in self.changes if after_s < time_s <= until_s]

    def gaits_in(self, after_s: float, until_s: float) -> list[NextGait]:
        """The gaits that are asked for later than one time and not later than another, in order."""
        return [gait for (time_s, _), gait in zip(self.changes, self.gaits) if after_s < time_s <= until_s]

    def pushes_in(self, after_s: float, until_s: float) -> list[Push]:
        """The pushes later than one time and not later than another."""
        return [push for push in self.pushes if after_s < push.time_s <= until_s]

    def _segment(self, time_s: float) -> Segment:
        last = bisect.bisect_right(self._starts, time_s) - 1
        return self.segments[max(last, 0)]

    @functools.cached_property
    def _starts(self) -> list[float]:
        return [segment.start_s for segment in self.segments]


def draw_plan(
    config: OperatorConfig,
    task: str,
    tasks: Sequence[str],
    seconds: float,
    rng: np.random.Generator,
    gaits: GaitSpace | None = None,
) -> OperatorPlan:
    """Draw what hands will do for some time.

    Args:
        config: how often they do what.
        task: that they begin in.
        tasks: all that there is a button for; with a single one, or without a `task_interval`, the gait stays.
        seconds: at least as long as the episode [s].
        rng: where the randomness comes from.
        gaits: where the next gait is drawn from where any gait can be; None: tasks have their own.
    """
    stick_rng, task_rng, push_rng, gait_rng = rng.spawn(4)
    segments = _Hand(config, stick_rng).segments(seconds)
    buttons = tasks if gaits is None else (task, "another gait")
    changes = _changes(config, task, buttons, segments, seconds, task_rng)
    if gaits is not None:
        changes = [(time_s, task) for time_s, _ in changes]
    return OperatorPlan(
        task,
        tuple(segments),
        tuple(changes),
        tuple(_pushes(config, seconds, push_rng)),
        () if gaits is None else tuple(_next_gait(gaits, gait_rng) for _ in changes),
    )


def _next_gait(gaits: GaitSpace, rng: np.random.Generator) -> NextGait:
    """Any gait, every other time at once."""
    gait, at_once, slew_s = gaits.draw(rng), rng.uniform() < 0.5, float(rng.uniform(*GAIT_SLEW_S))
    return NextGait(gait, 0.0 if at_once else slew_s)


class _Hand:
    """Draws one move of the stick after the other."""

    def __init__(self, config: OperatorConfig, rng: np.random.Generator) -> None:
        self._config = config
        self._rng = rng
        self._segments: list[Segment] = []
        self._time_s = 0.0
        self._at = RELEASED

    def segments(self, seconds: float) -> list[Segment]:
        """Segments that fill some seconds; the first begins with the stick where the hand has it already."""
        config, rng = self._config, self._rng
        if rng.uniform() < config.starts_released:
            self._rest("release", self._duration())
        else:
            self._at = self._position("hold")
            self._rest("hold", self._duration())
        while self._time_s < seconds:
            self._move(str(rng.choice(MOVES, p=config.weights / config.weights.sum())))
        return self._segments

    def _move(self, move: str) -> None:
        rng = self._rng
        if move == "stand":
            self._go(move, RELEASED, SWEEP_S)
            self._rest(move, rng.uniform(*self._config.stand_s))
        elif move == "ramp":
            self._go(move, self._position("hold"), self._duration() + SWEEP_S)
        elif move == "jerk":
            for _ in range(rng.integers(2, 6)):
                self._go(move, self._position("corner" if rng.uniform() < 0.5 else "hold"), 0.0)
                self._rest(move, rng.uniform(0.1, 0.5))
        elif move == "full_and_back":
            axis, sign = int(rng.integers(3)), rng.choice((-1.0, 1.0))
            for level in (sign, -sign, 0.0):
                self._go(move, _on_axis(axis, level), rng.uniform(0.0, 0.5))
                self._rest(move, rng.uniform(0.2, 1.0))
        else:
            self._go(move, self._position(move), rng.choice((0.0, SWEEP_S)))
            self._rest(move, self._duration())

    def _position(self, move: str) -> tuple[float, float, float]:
        rng = self._rng
        if move == "release":
            return RELEASED
        if move == "hold":
            return _triple(rng.uniform(-1.0, 1.0, 3))
        if move == "corner":
            return _triple(rng.choice((-1.0, 1.0), 3))
        axis = ("straight", "sideways", "turn").index(move)
        level = rng.choice((-1.0, 1.0)) if rng.uniform() < 0.4 else rng.uniform(-1.0, 1.0)
        return _on_axis(axis, level)

    def _duration(self) -> float:
        return float(self._rng.uniform(*self._config.move_s))

    def _go(self, move: str, position: tuple[float, float, float], seconds: float) -> None:
        self._append(move, position, seconds)

    def _rest(self, move: str, seconds: float) -> None:
        self._append(move, self._at, seconds)

    def _append(self, move: str, position: tuple[float, float, float], seconds: float) -> None:
        end_s = self._time_s + float(seconds)
        self._segments.append(Segment(self._time_s, end_s, self._at, position, move))
        self._time_s, self._at = end_s, position


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    forward, sideways, yaw = values.tolist()
    return forward, sideways, yaw


def _on_axis(axis: int, level: float) -> tuple[float, float, float]:
    return _triple(np.where(np.arange(3) == axis, level, 0.0))


def _changes(
    config: OperatorConfig,
    task: str,
    tasks: Sequence[str],
    segments: Sequence[Segment],
    seconds: float,
    rng: np.random.Generator,
) -> list[tuple[float, str]]:
    """When which button is pressed: now and then, twice within a second, and soon after letting go."""
    if config.task_interval is None or len(tasks) < 2:
        return []
    times = []
    time_s = rng.uniform(0.0, config.task_interval[1])
    while time_s < seconds:
        times.append(time_s)
        if rng.uniform() < config.double_change:
            times.append(time_s + rng.uniform(0.1, 1.0))
        time_s += rng.uniform(*config.task_interval)
    let_go = [segment.start_s for segment in segments if segment.move == "release" and segment.before != RELEASED]
    times += [start + rng.uniform(0.0, 0.5) for start in let_go if rng.uniform() < config.braking_change]
    changes = []
    for time_s in sorted(times):
        task = str(rng.choice([name for name in tasks if name != task]))
        changes.append((float(time_s), task))
    return changes


def _pushes(config: OperatorConfig, seconds: float, rng: np.random.Generator) -> list[Push]:
    """Pushes at exponentially distributed times: the usual ones uniform in a disc, the hard ones near its border."""
    pushes = []
    for interval, hard in ((config.push_interval, False), (config.hard_push_interval, True)):
        time_s = 0.0
        while interval is not None and (time_s := time_s + rng.exponential(interval)) < seconds:
            size = config.hard_push * rng.uniform(0.5, 1.0) if hard else config.push * np.sqrt(rng.uniform())
            pushes.append(Push(float(time_s), float(rng.uniform(-np.pi, np.pi)), float(size), hard))
    return sorted(pushes, key=lambda push: push.time_s)
