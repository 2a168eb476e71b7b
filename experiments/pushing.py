"""Pushes: where they go, and tables of the largest."""

from collections.abc import Iterable

import numpy as np

from experiments.results import Record

DIRECTIONS = {"left": (0.0, 1.0), "right": (0.0, -1.0), "forward": (1.0, 0.0), "backward": (-1.0, 0.0)}
"""Where a push goes, in the heading frame."""
PAIRS = {"lateral": ("left", "right"), "fore-aft": ("forward", "backward")}
"""Directions of which the weaker one counts."""
CRUISE = (0.3, 0.0, 0.0)
"""The command while being pushed: vx, vy [m/s], yaw rate [rad/s]."""


def push_w(direction: str, size: float, yaw: float) -> tuple[float, float, float]:
    """A push as a change of the base's velocity in the world frame [m/s].

    Args:
        direction: one of `DIRECTIONS`.
        size: [m/s].
        yaw: heading of the robot [rad].
    """
    (x, y), cos, sin = DIRECTIONS[direction], np.cos(yaw), np.sin(yaw)
    return size * (cos * x - sin * y), size * (sin * x + cos * y), 0.0


def weaker(records: Iterable[Record], pair: Iterable[str]) -> float | None:
    """The smaller of two directions' largest pushes [m/s], of those that were measured."""
    return min((record["largest"] for record in records if record["condition"] in pair), default=None)
