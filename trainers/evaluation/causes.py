"""Why an episode failed: what it was doing, in which gait, and what had just happened."""

import dataclasses

import numpy as np

from go1_mtl_gym import TASKS
from go1_mtl_gym.gaits import STAND_COMMAND
from trainers.evaluation.scoring import SETTLE_S, VELOCITY_TOLERANCE, EpisodeRecord, Series

FELL, NO_TRACKING, NO_STEPPING = "fell", "did not track", "did not step"
WINDOW_S = 1.0
"""Events count if they happened at most so long before the failure [s]."""
BRAKING_S = 1.5
"""So long after it was let go a robot is braking; later it stands [s]."""
AXES = (("forward", "backward"), ("sideways", "sideways"), ("turning", "turning"))
"""What a robot does whose command is largest along an axis, in the positive and in the negative direction."""
MOVES_WITH_A_NAME = {"jerk": "jerking", "full_and_back": "reversing"}
"""Moves of the stick that matter more than where it is."""


@dataclasses.dataclass(frozen=True)
class Cause:
    """What is known of a failure.

    Attributes:
        what: `FELL`, `NO_TRACKING` or `NO_STEPPING`; the first that is true.
        time_s: of the fall, or of the end of the second in which the robot was farthest from its command; the end of
            the episode if it only did not step [s].
        task: that was present at that time.
        doing: "standing", "braking" (let go less than 1.5 s before), "jerking", "reversing", or where the command
            pointed, in shares of the task's range: "forward", "backward", "sideways", "turning". "all along" if it only
            did not step.
        events: (what, how long before [s]) of the last second, the oldest first: "push", "let go", "new command", or
            "trot to walk" where that change of gait was asked for.
    """

    what: str
    time_s: float
    task: str
    doing: str
    events: tuple[tuple[str, float], ...] = ()

    @property
    def after(self) -> str:
        """The last event; "nothing" if there was none."""
        return self.events[-1][0] if self.events else "nothing"

    def __str__(self) -> str:
        """In words."""
        before = ", ".join(f"{name} {ago:.1f} s before" for name, ago in self.events)
        return f"{self.what} at {self.time_s:.1f} s in {self.task}, {self.doing}" + (f"; {before}" if before else "")


def cause_of(series: Series, record: EpisodeRecord, first_task: str, control_hz: float) -> Cause:
    """Find out why an episode failed.

    Args:
        series: of the whole episode.
        record: its scores.
        first_task: that it began in.
        control_hz: steps per second.
    """
    last = len(series.measured) - 1
    if record.fallen:
        what, i = FELL, last
    elif not record.velocity_error <= VELOCITY_TOLERANCE:
        what, i = NO_TRACKING, _farthest(series, control_hz)
    else:
        return Cause(NO_STEPPING, (last + 1) / control_hz, series.tasks[last], "all along")
    known = [(name, step) for name, step in _events(series, first_task) if step <= i]
    recent = tuple((name, (i - step) / control_hz) for name, step in known if i - step <= WINDOW_S * control_hz)
    return Cause(what, (i + 1) / control_hz, series.tasks[i], _doing(series, i, control_hz), recent)


def _doing(series: Series, i: int, control_hz: float) -> str:
    command, before = series.commands[i], series.commands[max(0, i - round(BRAKING_S * control_hz)) : i]
    if _released(command):
        return "standing" if _released(before).all() else "braking"
    if series.moves and series.moves[i] in MOVES_WITH_A_NAME:
        return MOVES_WITH_A_NAME[series.moves[i]]
    share = command / np.maximum(TASKS[series.tasks[i]].command_range, 1e-9)
    axis = int(np.abs(share).argmax())
    return AXES[axis][int(share[axis] < 0)]


def _released(commands: np.ndarray) -> np.ndarray:
    """Whether commands, shape (..., 3), ask for a stand."""
    return (np.abs(commands) < STAND_COMMAND).all(axis=-1)


def _farthest(series: Series, control_hz: float) -> int:
    """The last step of the second in which the mean velocity was farthest from the command."""
    window, skip = round(WINDOW_S * control_hz), round(SETTLE_S * control_hz)
    difference = (series.measured - series.wanted)[skip:, :2]
    if len(difference) < window:
        return len(series.measured) - 1
    sums = np.cumsum(np.vstack([np.zeros(2), difference]), axis=0)
    return skip + window - 1 + int(np.linalg.norm(sums[window:] - sums[:-window], axis=1).argmax())


def _events(series: Series, first_task: str) -> list[tuple[str, int]]:
    """Everything that happened, and in which step, in order."""
    events, task = [], first_task
    released = _released(series.commands)
    for i in range(len(series.measured)):
        for name in series.events[i] if series.events else ():
            if name in TASKS:
                name, task = f"{task} to {name}", name
            events.append((name, i))
        if i and released[i] and not released[i - 1]:
            events.append(("let go", i))
        elif i and not series.events and (series.commands[i] != series.commands[i - 1]).any():
            events.append(("new command", i))
    return events
