"""The gait clock: when it runs, and when the robot stands."""

import numpy as np

from go1_mtl_gym.gaits import Gait

STAND_COMMAND = (0.02, 0.02, 0.04)
"""A command with smaller |vx|, |vy| [m/s] and |yaw rate| [rad/s] asks for a stand."""
_SLACK = 1e-9  # of the clock [cycles]; adding up fractions of a cycle ends a little below the whole


def asks_to_stand(gait: Gait, command: np.ndarray) -> bool:
    """Whether the gait can stand and the filtered command, shape (3,), is about zero."""
    return bool((np.abs(command) < STAND_COMMAND).all()) and gait.can_stand


def is_standing(gait: Gait, phase: float, command: np.ndarray) -> bool:
    """Whether the clock rests: at phase 0 of a gait that can stand there, under a command that asks for it."""
    return phase == 0.0 and asks_to_stand(gait, command)


def next_phase(gait: Gait, phase: float, command: np.ndarray, seconds: float) -> float:
    """The clock [cycles], in [0, 1), after some time under one filtered command.

    It gains seconds / period. A command that asks for a stand lets it run on to the next phase 0, where it rests at
    exactly 0.0.
    """
    turns = phase + seconds / gait.period
    if asks_to_stand(gait, command) and (phase == 0.0 or turns >= 1.0 - _SLACK):
        return 0.0
    return turns % 1.0


def passes(mark: float, before: float, after: float) -> bool:
    """Whether the clock came to, or past, a phase between two readings less than a cycle apart; all in [0, 1)."""
    return (mark - before) % 1.0 <= (after - before) % 1.0
