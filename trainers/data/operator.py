"""What hands do with a stick, six buttons and a robot in reach: the one distribution that all episodes are drawn from.

Demonstrations, DAgger rounds, the watching of the phase-free student, validation and evaluation share it. It is made of
moves of a stick in [-1, 1]^3, a share of the present task's `command_range`, of changes of gait, and of pushes.
"""

import bisect
import dataclasses
import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import interval_s, number_in, one_of

RELEASED = (0.0, 0.0, 0.0)
"""The stick that nobody holds."""
MOVES = (
    "hold", "straight", "sideways", "turn", "corner", "full_and_back", "ramp", "jerk", "release", "stand"
)  # fmt: skip
"""Everything that a hand does next; each is a field of `OperatorConfig`, which holds its weight."""
SWEEP_S = 0.15
"""How long a hand takes from one position of the stick to another if it neither jerks nor takes its time [s]."""


@dataclasses.dataclass(frozen=True)
class OperatorConfig:
    """How often hands do what; the weights of the moves need not add up to 1.

    Attributes:
        hold: weight of going anywhere, and holding the stick there.
        straight: of going forward or backward.
        sideways: of going sideways only.
        turn: of turning in place.
        corner: of every axis at one of its ends.
        full_and_back: of one axis from the middle to its end, to the other end, and back.
        ramp: of moving the stick slowly to somewhere else.
        jerk: of tearing it from place to place, a few times a second.
        release: of letting go.
        stand: of letting go for long.
        move_s: shortest and longest duration of a move [s].
        stand_s: the same of a long stand [s].
        starts_released: probability that an episode begins with a stick that nobody holds.
        deflection: share of a task's `command_range` that a full deflection asks for; above 1 it goes beyond, as far as
            `command_limit`.
        task_interval: shortest and longest time between changes of gait [s], or None for one gait per episode.
        double_change: probability that a change of gait is followed by another one within a second.
        braking_change: probability that letting go comes with a change of gait in the half second after it.
        push: largest push, a change of the trunk's velocity in any horizontal direction [m/s].
        push_interval: mean time between pushes [s], or None for none.
        hard_push_interval: mean time between pushes of half to all of what the expert bears in the present gait and
            that direction (`Task.largest_push`) [s], or None for none.

    Raises:
        InvalidInputError: if a weight is negative or all are 0, or another figure is outside its range.
    """

    hold: float = 2.0
    straight: float = 1.5
    sideways: float = 1.0
    turn: float = 1.0
    corner: float = 1.0
    full_and_back: float = 1.0
    ramp: float = 1.5
    jerk: float = 1.0
    release: float = 3.0
    stand: float = 0.1
    move_s: tuple[float, float] = (0.3, 4.0)
    stand_s: tuple[float, float] = (10.0, 60.0)
    starts_released: float = 0.3
    deflection: float = 1.0
    task_interval: tuple[float, float] | None = (1.0, 12.0)
    double_change: float = 0.2
    braking_change: float = 0.2
    push: float = 0.3
    push_interval: float | None = 10.0
    hard_push_interval: float | None = None

    def __post_init__(self) -> None:
        set_field = functools.partial(object.__setattr__, self)
        for name in MOVES:
            set_field(name, number_in(getattr(self, name), 0.0, 1e6, f"weight of the move {name!r}"))
        if not self.weights.any():
            raise InvalidInputError(f"at least one move of the operator needs a weight above 0, got {self}")
        for name in ("starts_released", "double_change", "braking_change"):
            set_field(name, number_in(getattr(self, name), 0.0, 1.0, name))
        set_field("deflection", number_in(self.deflection, 0.0, 3.0, "deflection"))
        set_field("push", number_in(self.push, 0.0, 5.0, "push [m/s]"))
        for name in ("push_interval", "hard_push_interval"):
            if getattr(self, name) is not None:
                set_field(name, number_in(getattr(self, name), 0.1, 1e6, f"{name} [s]"))
        for name in ("move_s", "stand_s", "task_interval"):
            set_field(name, interval_s(getattr(self, name), name))
        if self.move_s is None or self.stand_s is None:
            raise InvalidInputError(f"move_s and stand_s must be intervals, got {self.move_s} and {self.stand_s}")

    @property
    def weights(self) -> np.ndarray:
        """Of the moves, in the order of `MOVES`, shape (10,)."""
        return np.array([getattr(self, name) for name in MOVES])

    def of_one_gait(self) -> "OperatorConfig":
        """The same hands without the buttons."""
        return dataclasses.replace(self, task_interval=None)

    def of_moves(self, *moves: str) -> "OperatorConfig":
        """The same hands with these moves alone, each of its weight.

        Raises:
            InvalidInputError: if one is none of `MOVES`, or none has a weight.
        """
        kept = {one_of(move, MOVES, "move") for move in moves}
        others: dict[str, Any] = dict.fromkeys(set(MOVES) - kept, 0.0)
        return dataclasses.replace(self, **others)


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
class OperatorPlan:
    """All that one pair of hands will do in an episode, whatever the robot does.

    Attributes:
        task: that the episode begins in.
        segments: of the stick, in order of time, without gaps.
        changes: (time [s], task) of each change of gait, in order.
        pushes: in order of time.
    """

    task: str
    segments: tuple[Segment, ...]
    changes: tuple[tuple[float, str], ...]
    pushes: tuple[Push, ...]

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
    config: OperatorConfig, task: str, tasks: Sequence[str], seconds: float, rng: np.random.Generator
) -> OperatorPlan:
    """Draw what hands will do for some time.

    Args:
        config: how often they do what.
        task: that they begin in.
        tasks: all that there is a button for; with a single one, or without a `task_interval`, the gait stays.
        seconds: at least as long as the episode [s].
        rng: where the randomness comes from.
    """
    stick_rng, task_rng, push_rng = rng.spawn(3)
    segments = _Hand(config, stick_rng).segments(seconds)
    return OperatorPlan(
        task,
        tuple(segments),
        tuple(_changes(config, task, tasks, segments, seconds, task_rng)),
        tuple(_pushes(config, seconds, push_rng)),
    )


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
            size = rng.uniform(0.5, 1.0) if hard else config.push * np.sqrt(rng.uniform())
            pushes.append(Push(float(time_s), float(rng.uniform(-np.pi, np.pi)), float(size), hard))
    return sorted(pushes, key=lambda push: push.time_s)
