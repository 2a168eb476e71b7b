"""What a person does with a stick and gait buttons, written down: the same moves for every policy."""

import dataclasses
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, cast

import gymnasium
import numpy as np

from go1_mtl_gym import TASKS, Go1Env
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.rotations import yaw_matrix
from go1_mtl_gym.validation import finite_vector, number_in, one_of, parameters_of
from trainers.data.environments import base_env
from trainers.utils.files import read_json, write_json

LONGEST_S = 600.0
"""Of a script [s]."""


@dataclasses.dataclass(frozen=True)
class Move:
    """A button is pressed, and the stick is put somewhere, where it stays until the next move.

    Attributes:
        time_s: when, since the start [s].
        task: name of the gait that is asked for, one of `go1_mtl_gym.TASKS`; the same as before changes nothing.
        command: (vx [m/s], vy [m/s], yaw rate [rad/s]), within the task's `command_limit`.
        push: a change of the trunk's velocity (forward, left) that comes with it [m/s], heading frame; or None.

    Raises:
        InvalidInputError: if a value is not as described.
    """

    time_s: float
    task: str
    command: tuple[float, float, float] = (0.0, 0.0, 0.0)
    push: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        time_s = number_in(self.time_s, 0.0, LONGEST_S, "time_s of a move [s]")
        task = TASKS[one_of(self.task, tuple(TASKS), f"task of the move at {time_s:g} s")]
        try:
            command = task.check_command(self.command)
        except InvalidInputError as error:
            raise InvalidInputError(f"move at {time_s:g} s: {error}") from error
        if self.push is not None:
            push = finite_vector(self.push, 2, f"push of the move at {time_s:g} s")
            object.__setattr__(self, "push", tuple(push.tolist()))
        object.__setattr__(self, "time_s", time_s)
        object.__setattr__(self, "command", tuple(command.tolist()))


@dataclasses.dataclass(frozen=True)
class Script:
    """Moves in the order of their time. JSON's form of it, ``Script(**json.load(file))``, has lists for tuples.

    Attributes:
        moves: `Move`, or their fields as a sequence (time_s, task, command) or a dictionary; the first is at 0 s.
        seconds: when it is over [s], after the last move.

    Raises:
        InvalidInputError: if there is no move, one is none, or their times are not as described.
    """

    moves: tuple[Move, ...]
    seconds: float

    def __post_init__(self) -> None:
        if isinstance(self.moves, (str, Mapping)) or not isinstance(self.moves, Sequence) or not self.moves:
            raise InvalidInputError(f"moves of a script must be a sequence of at least one, got {self.moves!r}")
        moves = tuple(map(_move, self.moves))
        if moves[0].time_s != 0.0:
            raise InvalidInputError(f"the first move of a script must be at 0 s, got {moves[0].time_s:g} s")
        for before, after in zip(moves, moves[1:], strict=False):
            if after.time_s <= before.time_s:
                raise InvalidInputError(
                    f"moves of a script must be in order of time, got {after.time_s:g} s after {before.time_s:g} s"
                )
        seconds = number_in(self.seconds, 0.0, LONGEST_S, "seconds of a script")
        if seconds <= moves[-1].time_s:
            raise InvalidInputError(
                f"a script must end after its last move at {moves[-1].time_s:g} s, got seconds={seconds:g}"
            )
        object.__setattr__(self, "moves", moves)
        object.__setattr__(self, "seconds", seconds)

    @property
    def task_names(self) -> tuple[str, ...]:
        """Names of the gaits that are asked for, in the order of their first time."""
        return tuple(dict.fromkeys(move.task for move in self.moves))

    def drive(self, env: gymnasium.Env, step: int) -> None:
        """Make the move that is due: a `watch` of `EpisodeSetup.play`, whose reset makes the first one.

        Args:
            env: that is driven.
            step: number of steps that were made.
        """
        base = base_env(env)
        last_step = round(self.seconds * base.control_hz) - 1  # the end is no time for a move
        for move in self.moves:
            if min(round(move.time_s * base.control_hz), last_step) == step:
                if move is not self.moves[0]:
                    base.set_task(move.task, command=move.command)
                if move.push is not None:
                    push(env, move.push)

    @classmethod
    def read(cls, path: str | PathLike[str]) -> "Script":
        """From a JSON file.

        Raises:
            InvalidInputError: if there is no such file, or it holds something else.
        """
        values = read_json(path, "script")
        if not isinstance(values, dict) or not {"moves", "seconds"} <= set(values):
            raise InvalidInputError(f"{str(path)!r} is no script: an object with moves and seconds was expected")
        return parameters_of(values, cls, f"the script {str(path)!r}")

    def write(self, path: str | PathLike[str]) -> None:
        """As a JSON file."""
        write_json(path, dataclasses.asdict(self))


def push(env: gymnasium.Env, change: Sequence[float]) -> None:
    """Push a robot: change its velocity (forward, left) [m/s], heading frame."""
    go1 = cast(Go1Env, env.unwrapped)
    go1.push(np.append(yaw_matrix(go1.state.rpy[2]) @ np.asarray(change), 0.0))


def _move(value: Any) -> Move:
    """A move from its fields.

    Raises:
        InvalidInputError: if it is none.
    """
    if isinstance(value, Sequence) and not isinstance(value, str):
        names = [each.name for each in dataclasses.fields(Move)]
        if not 2 <= len(value) <= len(names):
            raise InvalidInputError(f"a move is ({', '.join(names)}), got {value!r}")
        value = dict(zip(names, value, strict=False))
    if isinstance(value, Mapping) and not {"time_s", "task"} <= set(value):
        raise InvalidInputError(f"a move needs time_s and task, got {value!r}")
    return parameters_of(value, Move, "a move")
