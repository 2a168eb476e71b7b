"""What hands do with a stick, six buttons and a robot in reach: the one distribution that all episodes are drawn from.

Demonstrations, DAgger rounds, the watching of the phase-free student, validation and evaluation share it. It is made of
moves of a stick in [-1, 1]^3, a share of the present task's `command_range`, of changes of gait, and of pushes.
"""

import dataclasses
import functools
from typing import Any

import numpy as np

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import interval_s, number_in, one_of

MOVES = (
    "hold", "straight", "sideways", "turn", "corner", "full_and_back", "ramp", "jerk", "release", "stand"
)  # fmt: skip
"""Everything that a hand does next; each is a field of `OperatorConfig`, which holds its weight."""


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
        hard_push: largest hard push, as a share of what the expert bears in the present gait and that direction
            (`Task.largest_push`); they begin at half of it.
        hard_push_interval: mean time between hard pushes [s], or None for none.

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
    hard_push: float = 1.0
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
        set_field("hard_push", number_in(self.hard_push, 0.0, 3.0, "hard_push"))
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
