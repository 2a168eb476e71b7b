"""What a player asks for: a stick, buttons for the gaits, and pushes."""

from typing import cast

import gymnasium
import numpy as np

from go1_mtl_gym import TASKS, Go1Env
from go1_mtl_gym.validation import finite_vector, number_in, one_of
from trainers.evaluation.script import LONGEST_S, Move, Script, push

PUSH_SHARE = 0.5
"""Of a push, as a share of the largest one that the expert bears in the present gait and that direction."""


class Hands:
    """Holds what was asked for until the next step makes it happen; `drive` is a `Watch`.

    Full deflection of the stick asks for the `command_range` of the gait that was asked for last, which is what
    policies are trained and certified for.
    """

    def __init__(self) -> None:
        self._stick = np.zeros(3)
        self._task = ""
        self._pushes: list[tuple[float, float]] = []
        self._moves: list[Move] = []
        self._seconds = 0.0

    @property
    def script(self) -> Script:
        """What was done since the last reset, for as long as a script can be: who drives by it goes the same way.

        Raises:
            InvalidInputError: if nothing was driven yet.
        """
        return Script(tuple(self._moves), self._seconds)

    @property
    def stick(self) -> np.ndarray:
        """Deflection (forward, left, turn to the left), each in [-1, 1], shape (3,)."""
        return self._stick.copy()

    def move_stick(self, stick: object) -> None:
        """Put it somewhere, where it stays; beyond its ends it cannot go.

        Raises:
            InvalidInputError: if it is not three finite numbers.
        """
        self._stick = np.clip(finite_vector(stick, 3, "stick (forward, left, turn)"), -1.0, 1.0)

    def press(self, task: str) -> None:
        """Press the button of a gait.

        Raises:
            InvalidInputError: if there is no such gait.
        """
        self._task = one_of(task, tuple(TASKS), "gait")

    def push(self, direction_w: float, share: float = PUSH_SHARE) -> None:
        """Push the robot.

        Args:
            direction_w: from the world's x axis to the left [rad].
            share: of the largest push that the expert bears (`Task.largest_push`).

        Raises:
            InvalidInputError: if a number is none.
        """
        direction = finite_vector([direction_w], 1, "direction of a push [rad]").item()
        self._pushes.append((direction, number_in(share, 0.0, 3.0, "share of the largest push")))

    def let_go(self) -> None:
        """Leave the stick to its springs, and forget what was to happen."""
        self._stick, self._task, self._pushes = np.zeros(3), "", []

    def drive(self, env: gymnasium.Env, step: int) -> None:
        """Do what was asked for since the step before; a `Watch`.

        Args:
            env: that is driven.
            step: number of steps that were made.
        """
        go1 = cast(Go1Env, env.unwrapped)
        task = TASKS[self._task] if self._task in go1.tasks else go1.requested_task
        command = self._stick * np.array(task.command_range)
        if self._task in go1.tasks:
            go1.set_task(self._task, command=command)
        else:
            go1.set_command(command)
        yaw, change = float(go1.state.rpy[2]), np.zeros(2)
        for direction_w, share in self._pushes:
            angle = direction_w - yaw
            change += share * go1.task.largest_push(angle) * np.array([np.cos(angle), np.sin(angle)])
        if change.any():
            push(env, change.tolist())
        self._task, self._pushes = "", []
        self._write_down(step, go1, command, change)

    def _write_down(self, step: int, go1: Go1Env, command: np.ndarray, change: np.ndarray) -> None:
        """Remember what was done, if it differs from what was done before and a script has room for it."""
        if step == 0:
            self._moves = []
        if (step + 1) * go1.control_s > LONGEST_S:
            return
        forward, left, turn = command.tolist()
        pushed = (float(change[0]), float(change[1])) if change.any() else None
        move = Move(step * go1.control_s, go1.requested_task.name, (forward, left, turn), pushed)
        last = self._moves[-1] if self._moves else None
        if last is None or pushed or (last.task, last.command) != (move.task, move.command):
            self._moves.append(move)
        self._seconds = (step + 1) * go1.control_s
