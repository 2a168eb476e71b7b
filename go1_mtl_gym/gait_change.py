"""When a robot can leave one gait for another."""

from dataclasses import dataclass

import numpy as np

from go1_mtl_gym.gaits import passes
from go1_mtl_gym.tasks import Task

SHORTEST_TASK_S = 1.0
"""A task that was changed to is asked for at least this long before the next one [s]."""
SLACK_S = 1e-9
"""Of times that are sums of control periods [s]."""
CHANGE_FRACTION = 0.5
"""A gait is changed while the filtered command is within this share of both gaits' `command_range`."""
REACH, SLACK_COMMAND = 1.15, 0.02
"""About within it: larger by this factor, and by this much [m/s, rad/s]."""


@dataclass(frozen=True)
class GaitChange:
    """A change of task that waits until the robot can leave its gait.

    It waits for three things: that the present task has had its time, that the robot is slow enough for both gaits, and
    that the clock is where the present gait can be left (`Gait.change_phase`). The new gait begins at phase 0.

    Attributes:
        present: the task that goes on meanwhile.
        wanted: the one that was asked for.
        since_s: since when the present task goes on [s]; -inf if it need not go on for a while.
    """

    present: Task
    wanted: Task
    since_s: float = -np.inf

    @property
    def reach(self) -> np.ndarray:
        """The largest |vx|, |vy| [m/s] and |yaw rate| [rad/s] to change with, shape (3,)."""
        return CHANGE_FRACTION * np.minimum(self.present.command_range, self.wanted.command_range)

    def slowed(self, command: np.ndarray) -> np.ndarray:
        """What the command filter follows meanwhile: the command, shape (3,), only as far as a change allows."""
        reach = self.reach
        return np.clip(command, -reach, reach)

    def begins_at_once(self, filtered_command: np.ndarray, time_s: float) -> bool:
        """Whether there is nothing to wait for when it is asked for.

        Args:
            filtered_command: then, shape (3,).
            time_s: since the reset [s].
        """
        return self.present.gait.change_phase is None and self._allowed(filtered_command, time_s)

    def begins_after(self, before: float, after: float, filtered_command: np.ndarray, time_s: float) -> bool:
        """Whether it begins at the end of some time.

        Args:
            before: phase at its beginning [cycles].
            after: phase at its end; the same if the clock rests.
            filtered_command: during it, shape (3,).
            time_s: its end, since the reset [s].
        """
        mark = self.present.gait.change_phase
        leaves = mark is None or before == after or passes(mark, before, after)
        return leaves and self._allowed(filtered_command, time_s)

    def _allowed(self, filtered_command: np.ndarray, time_s: float) -> bool:
        """Whether the present task has had its time, and the filtered command is about what a change allows.

        The filter comes near a command soon, and never to it.
        """
        settled = time_s - self.since_s >= SHORTEST_TASK_S - SLACK_S
        return settled and bool((np.abs(filtered_command) <= REACH * self.reach + SLACK_COMMAND).all())
