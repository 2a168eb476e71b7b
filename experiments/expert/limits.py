"""How far the expert goes: the largest command along each axis, and the largest push at every phase of the cycle."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments import plots
from experiments.expert.lab import ExpertOptions, ExpertStudy, Lab, generator
from experiments.pushing import CRUISE, DIRECTIONS, push_w
from experiments.results import Results, group
from experiments.searches import climb, scouted
from experiments.study import option
from experiments.tables import mean
from go1_mtl_gym import TASKS
from trainers.data.environments import derive_seed

AXES = {
    "vx": (0, (1.0,), 0.2, 2.5),
    "-vx": (0, (-1.0,), 0.2, 2.5),
    "vy": (1, (1.0, -1.0), 0.1, 1.0),
    "yaw": (2, (1.0, -1.0), 0.5, 3.0),
}
"""Axis -> its place in the command, the signs tried in turn, step of the grid and largest value [m/s, rad/s]."""
OTHERS = (0.3, 0.1, 0.2)
"""Largest |vx|, |vy| [m/s], |yaw rate| [rad/s] drawn for the two components that are not being tested."""
TRACKED = (0.15, 0.3)
"""Mean velocity error [m/s] and mean yaw rate error [rad/s] up to which a command counts as tracked."""
Errors = tuple[float, float]


@dataclass(frozen=True)
class LimitOptions(ExpertOptions):
    """The search for the largest command."""

    trials: int = option(20, "episodes that must all survive")
    scouts: int = option(2, "episodes tried on the way up, before the whole number is tried on the way down")
    seconds: float = option(10.0, "duration of an episode [s]")
    grid: int = option(100, "largest number of steps above the task's own range")
    axes: tuple[str, ...] = option(tuple(AXES), "which of AXES")


class Limits(ExpertStudy):
    """The largest command along each axis that the expert survives, and that it tracks."""

    name = "expert_limits"
    title = "Largest commands"
    note = (
        "The largest command along an axis that every trial survived, the errors there, and the largest that was also "
        f"tracked: mean errors of at most {TRACKED[0]:g} m/s and {TRACKED[1]:g} rad/s."
    )
    caption = "Largest command along each axis"
    rows = {"task": "gait", "condition": "axis"}
    columns = {
        "survived": lambda members: f"{members[0]['survived_to']:g}{' (end of the search)' * members[0]['at_cap']}",
        "velocity error there [m/s]": mean("velocity_error", ".3f"),
        "yaw rate error there [rad/s]": mean("yaw_rate_error", ".3f"),
        "and tracked": mean("tracked_to", "g"),
    }
    full = LimitOptions()
    quick = LimitOptions(("trot",), trials=1, scouts=1, seconds=2.5, grid=1, axes=("vx", "yaw"))
    code = (*ExpertStudy.code, "experiments.searches")

    def measure_in(self, lab: Lab, task: str, seed: int) -> list[dict[str, Any]]:
        return [{"condition": axis, **self._search(lab, task, axis, seed)} for axis in self.options.axes]

    def _search(self, lab: Lab, task: str, axis: str, seed: int) -> dict[str, Any]:
        """See `searches.scouted`.

        Returns:
            "survived_to": the largest value with no fall in all trials, with its mean errors; "tracked_to": the
            largest that was also tracked; 0 if there is none. "at_cap": whether there was no larger one to try.
        """
        options, (index, _, step, cap) = self.options, AXES[axis]
        start = TASKS[task].command_range[index]
        levels = [min(start + k * step, cap) for k in range(options.grid + 1) if start + (k - 1) * step < cap - 1e-9]
        levels = sorted({round(level, 6) for level in levels})
        below = [round(start - k * step, 6) for k in range(1, 100) if start - k * step > 1e-6]

        def errors(level: float, trials: int) -> Errors | None:
            return episodes(lab, task, axis, level, trials, options.seconds, seed)

        survived, tracked = scouted(
            levels,
            below,
            scout=lambda level: errors(level, options.scouts) is not None,
            try_all=lambda level: errors(level, options.trials),
            good=lambda means: means[0] <= TRACKED[0] and means[1] <= TRACKED[1],
        )
        level, (velocity, yaw_rate) = survived or (0.0, (None, None))
        at_cap = survived is not None and level == levels[-1]
        means = {"velocity_error": velocity, "yaw_rate_error": yaw_rate}
        return {"survived_to": level, "tracked_to": tracked, **means, "at_cap": at_cap}

    def figure(self, results: Results) -> Figure:
        titles = {"vx": "forward [m/s]", "-vx": "backward [m/s]", "vy": "sideways [m/s]", "yaw": "yaw rate [rad/s]"}
        per_axis = group(results.records, "condition").items()
        panels: dict[str, Any] = {titles[axis]: {"survived": {}, "and tracked": {}} for axis, _ in per_axis}
        for axis, members in per_axis:
            for record in members:
                panels[titles[axis]]["survived"][record["task"]] = record["survived_to"]
                panels[titles[axis]]["and tracked"][record["task"]] = record["tracked_to"]
        return plots.dots(panels)


def episodes(lab: Lab, task: str, axis: str, level: float, trials: int, seconds: float, seed: int) -> Errors | None:
    """Mean velocity error [m/s] and yaw rate error [rad/s] over some episodes, or None at the first fall."""
    index, signs, _, _ = AXES[axis]
    small, errors = np.minimum(OTHERS, TASKS[task].command_range), []
    for i in range(trials):
        command = generator("limits", task, axis, seed, i).uniform(-1, 1, 3) * small
        command[index] = signs[i % len(signs)] * level
        result = lab.score(task, seconds, derive_seed("limits", axis, seed, i), command=command)
        if result.episodes[0].fallen:
            return None
        errors.append((result.velocity_error, result.yaw_rate_error))
    velocity, yaw_rate = np.mean(errors, axis=0)
    return float(velocity), float(yaw_rate)


# -- Pushes ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PushOptions(ExpertOptions):
    """The search for the largest push."""

    phases: int = option(8, "of the cycle, evenly spaced, at each of which the push must be survived")
    first: float = option(0.6, "grid of pushes [m/s]; below the first one it is searched downward")
    step: float = option(0.1, "grid of pushes [m/s]; below the first one it is searched downward")
    grid: int = option(40, "largest number of steps above the first")
    before_s: float = option(1.5, "walking before the push, and without a fall after it [s]")
    after_s: float = option(3.0, "walking before the push, and without a fall after it [s]")
    directions: tuple[str, ...] = option(tuple(DIRECTIONS), "which of DIRECTIONS")


class Pushes(ExpertStudy):
    """The largest push that the expert survives at every phase of the cycle, per direction."""

    name = "expert_pushes"
    title = "Pushes"
    note = "Largest change of the base's velocity that is survived at every phase of the cycle, walking at 0.3 m/s."
    caption = "Largest push survived at every phase of the cycle"
    rows = {"task": "gait"}
    columns = {f"{name} [m/s]": mean("largest", ".1f", condition=name) for name in DIRECTIONS}
    full = PushOptions()
    quick = PushOptions(("trot",), phases=1, grid=1, after_s=0.5, directions=("left", "forward"))
    code = (*ExpertStudy.code, "experiments.pushing", "experiments.searches")

    def measure_in(self, lab: Lab, task: str, seed: int) -> list[dict[str, Any]]:
        options = self.options
        return [{"condition": to, "largest": largest_push(lab, task, to, options, seed)} for to in options.directions]

    def figure(self, results: Results) -> Figure:
        largest = plots.panel(results.records, "condition", "task", lambda members: members[0]["largest"])
        return plots.dots({"largest push survived [m/s]": largest})


def largest_push(lab: Lab, task: str, direction: str, options: PushOptions, seed: int) -> float:
    """Largest push on the grid below the first that made the robot fall at some phase [m/s]; 0 if all do."""

    def passes(size: float) -> bool:
        return all(survives(lab, task, direction, size, k, options, seed) for k in range(options.phases))

    return climb(options.first, options.step, options.grid, passes)


def survives(lab: Lab, task: str, direction: str, size: float, k: int, options: PushOptions, seed: int) -> bool:
    """Whether one push [m/s], as the gait clock passes phase k / phases, is survived."""
    lab.begin(task, CRUISE, direction, seed, k)
    if not lab.walk(options.before_s):
        return False
    wanted, per_step = k / options.phases, lab.env.control_s / TASKS[task].gait.period
    for _ in range(round(1 / per_step) + 1):
        if (lab.env.state.phase - wanted + 1e-9) % 1.0 < per_step:
            break
        if lab.step()["fallen"]:
            return False
    lab.env.push(push_w(direction, size, lab.env.state.rpy[2]))
    return lab.walk(options.after_s)
