"""How far the expert goes: the largest command along each axis, and the largest kick at every phase of the cycle."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from expert_report.lab import Lab, generator
from go1_mtl_gym import TASKS
from trainers.data.environments import derive_seed

AXES = {
    "vx": (0, (1.0,), 0.2, 2.5),
    "-vx": (0, (-1.0,), 0.2, 2.5),
    "vy": (1, (1.0, -1.0), 0.1, 1.0),
    "yaw": (2, (1.0, -1.0), 0.5, 3.0),
}
"""Axis -> its place in the command, the signs tried in turn, step of the grid and largest figure [m/s, rad/s]."""
OTHERS = (0.3, 0.1, 0.2)
"""Largest |vx|, |vy| [m/s], |yaw rate| [rad/s] drawn for the two components that are not being tested."""
TRACKED = (0.15, 0.3)
"""Mean velocity error [m/s] and mean yaw rate error [rad/s] up to which a command counts as tracked."""
DIRECTIONS = {"left": (0.0, 1.0), "right": (0.0, -1.0), "forward": (1.0, 0.0), "backward": (-1.0, 0.0)}
"""Where a kick goes, in the heading frame."""
CRUISE = (0.3, 0.0, 0.0)
"""The command while being kicked."""


@dataclass(frozen=True)
class LimitsConfig:
    """The search for the largest command.

    Attributes:
        trials: episodes that must all survive.
        scouts: episodes tried on the way up, before the whole number is tried on the way down.
        seconds: duration of an episode [s].
        grid: largest number of steps above the task's own range.
        axes: which of `AXES`.
    """

    trials: int = 20
    scouts: int = 2
    seconds: float = 10.0
    grid: int = 100
    axes: tuple[str, ...] = tuple(AXES)


@dataclass(frozen=True)
class PushConfig:
    """The search for the largest kick.

    Attributes:
        phases: of the cycle, evenly spaced, at each of which the kick must be survived.
        first, step: grid of kicks [m/s]; below the first one it is searched downward.
        grid: largest number of steps above the first.
        before_s, after_s: walking before the kick, and without a fall after it [s].
        directions: which of `DIRECTIONS`.
    """

    phases: int = 8
    first: float = 0.6
    step: float = 0.1
    grid: int = 40
    before_s: float = 1.5
    after_s: float = 3.0
    directions: tuple[str, ...] = tuple(DIRECTIONS)


# -- Commands ----------------------------------------------------------------------------------------------------------


def limits(lab: Lab, task: str, config: LimitsConfig, seed: int) -> dict[str, Any]:
    """{axis: {"survived", "tracked", ...}}, see `_search`."""
    return {axis: _search(lab, task, axis, config, seed) for axis in config.axes}


def _search(lab: Lab, task: str, axis: str, config: LimitsConfig, seed: int) -> dict[str, Any]:
    """Scout upward with few episodes until one falls, then come down until all survive, and on until it also tracks.

    Returns:
        "survived": the largest figure with no fall in all trials, and its mean errors; "tracked": the largest one
        that was also tracked (0 if there is none); "at_cap": whether the search ended for lack of larger figures.
    """
    index, _, step, cap = AXES[axis]
    start = TASKS[task].command_range[index]
    levels = [min(start + k * step, cap) for k in range(config.grid + 1) if start + (k - 1) * step < cap - 1e-9]
    levels = sorted({round(level, 6) for level in levels})
    top = 0
    while top < len(levels) and _episodes(lab, task, axis, levels[top], config.scouts, config, seed) is not None:
        top += 1
    below = [round(start - k * step, 6) for k in range(1, 100) if start - k * step > 1e-6]
    survived = tracked = None
    for level in [*reversed(levels[:top] or levels[:1]), *below]:
        errors = _episodes(lab, task, axis, level, config.trials, config, seed)
        if errors is None:
            continue
        survived = survived or (level, errors)
        if errors[0] <= TRACKED[0] and errors[1] <= TRACKED[1]:
            tracked = level
            break
    level, errors = survived or (0.0, (None, None))
    return {
        "survived": level,
        "velocity_error": errors[0],
        "yaw_rate_error": errors[1],
        "tracked": tracked or 0.0,
        "at_cap": bool(survived) and level == levels[-1],
    }


def _episodes(
    lab: Lab, task: str, axis: str, level: float, trials: int, config: LimitsConfig, seed: int
) -> tuple[float, float] | None:
    """Mean velocity error [m/s] and yaw rate error [rad/s] over some episodes, or None at the first fall."""
    index, signs, _, _ = AXES[axis]
    small = np.minimum(OTHERS, TASKS[task].command_range)
    errors = []
    for i in range(trials):
        command = generator("limits", task, axis, seed, i).uniform(-1, 1, 3) * small
        command[index] = signs[i % len(signs)] * level
        result = lab.score(task, config.seconds, derive_seed("limits", axis, seed, i), command=command)
        if result.episodes[0].fallen:
            return None
        errors.append((result.velocity_error, result.yaw_rate_error))
    velocity, yaw = np.mean(errors, axis=0)
    return float(velocity), float(yaw)


# -- Kicks -------------------------------------------------------------------------------------------------------------


def pushes(lab: Lab, task: str, config: PushConfig, seed: int) -> dict[str, Any]:
    """Largest kick [m/s] survived at every phase: per direction, "lateral" and "fore_aft" (the weaker of each two)."""
    largest = {direction: largest_push(lab, task, direction, config, seed) for direction in config.directions}
    pairs = {"lateral": ("left", "right"), "fore_aft": ("forward", "backward")}
    for name, pair in pairs.items():
        known = [largest[direction] for direction in pair if direction in largest]
        if known:
            largest[name] = min(known)
    return largest


def largest_push(lab: Lab, task: str, direction: str, config: PushConfig, seed: int) -> float:
    """Largest kick on the grid below the first that made the robot fall at some phase [m/s]; 0 if all do."""
    size = config.first
    if not _withstands(lab, task, direction, size, config, seed):
        while size > config.step:
            size = round(size - config.step, 6)
            if _withstands(lab, task, direction, size, config, seed):
                return size
        return 0.0
    for _ in range(config.grid):
        larger = round(size + config.step, 6)
        if not _withstands(lab, task, direction, larger, config, seed):
            break
        size = larger
    return size


def _withstands(lab: Lab, task: str, direction: str, size: float, config: PushConfig, seed: int) -> bool:
    return all(_push_speed(lab, task, direction, size, k, config, seed) for k in range(config.phases))


def _push_speed(lab: Lab, task: str, direction: str, size: float, k: int, config: PushConfig, seed: int) -> bool:
    """Whether one kick, as the gait clock passes phase k / phases, is survived."""
    lab.begin(task, CRUISE, direction, seed, k)
    if not lab.walk(config.before_s):
        return False
    wanted, pace = k / config.phases, lab.env.control_s / TASKS[task].gait.period
    for _ in range(round(1 / pace) + 1):
        if (lab.env.state.phase - wanted + 1e-9) % 1.0 < pace:
            break
        if lab.step()["fallen"]:
            return False
    lab.env.push(kick_w(direction, size, lab.env.state.rpy[2]))
    return lab.walk(config.after_s)


def kick_w(direction: str, size: float, yaw: float) -> tuple[float, float, float]:
    """A kick of some size [m/s] in one of the `DIRECTIONS` of a heading [rad]: change of velocity, world frame."""
    (x, y), cos, sin = DIRECTIONS[direction], np.cos(yaw), np.sin(yaw)
    return size * (cos * x - sin * y), size * (sin * x + cos * y), 0.0
