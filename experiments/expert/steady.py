"""Steady walking, looked at every millisecond: contacts against the plan, torques, energy, posture and tracking."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments import plots
from experiments.expert.lab import ExpertOptions, ExpertStudy, Lab, generator
from experiments.pushing import CRUISE
from experiments.results import Record, Results
from experiments.study import option
from experiments.tables import first, mean
from go1_mtl_gym import TASKS, Gait, robot
from go1_mtl_gym.actuation import PHYSICS_HZ
from go1_mtl_gym.gaits import next_phase

SATURATED = 0.999
"""A joint is at its limit from this fraction of it."""


@dataclass(frozen=True)
class SteadyOptions(ExpertOptions):
    """Two rollouts: one at `CRUISE`, one at a drawn command."""

    seconds: float = option(10.0, "duration of each [s]")
    skip_s: float = option(2.0, "start that does not count [s]")
    cycles: int = option(2, "of the gait whose contacts are kept for the picture")


class Steady(ExpertStudy):
    """Steady walking at every millisecond: contacts against the plan, torques, energy, posture, tracking."""

    name = "expert_steady"
    title = "Steady walking"
    caption = "Feet on the ground over two cycles, planned and measured"
    rows = {"task": "gait", "condition": "walk"}
    columns = {
        "command": first("command", ".2f"),
        "contact as planned": mean("contact_agreement", ".3f"),
        "touchdown lag [s]": mean("touchdown_lag_s", ".3f"),
        "flight": mean("flight_fraction", ".3f"),
        "planned": mean("planned_flight_fraction", ".3f"),
        "torque at limit": mean("saturated_fraction", ".4f"),
        "cost of transport": mean("cost_of_transport", ".2f"),
        "height [m]": mean("height", ".3f"),
        "RMS velocity error [m/s]": mean("rms_velocity_error", ".3f"),
        "QP iterations": mean("qp_iterations", ".0f"),
        "roll from, to [deg]": first("roll_deg", ".1f"),
        "pitch from, to [deg]": first("pitch_deg", ".1f"),
    }
    full = SteadyOptions()
    quick = SteadyOptions(("trot",), seconds=3.5)

    def measure_in(self, lab: Lab, task: str, seed: int) -> list[dict[str, Any]]:
        drawn = TASKS[task].draw_command(generator("steady", task, seed))
        return [
            {"condition": "cruise", **_rollout(lab, task, np.array(CRUISE), self.options, seed, schedule=True)},
            {"condition": "drawn", **_rollout(lab, task, drawn, self.options, seed)},
        ]

    def figure(self, results: Results) -> Figure:
        known = [record for record in results.records if "schedule" in record]
        figure, axes = plots.grid(len(known), 2, (4.4, 1.55), (0.3, 0.6))
        for ax, record in zip(axes.flat, known):
            _contacts(ax, record)
        for ax in axes.flat[max(0, len(known) - axes.shape[1]) : len(known)]:
            ax.set_xlabel("gait clock [cycles]", fontsize=9)
        plots.legend(figure, axes.flat[:1])
        return figure


def _contacts(ax: Axes, record: Record) -> None:
    plan, cycles = TASKS[record["task"]].gait, 2
    for row, intervals in enumerate(record["schedule"]):
        for k in range(-1, cycles + 1):
            start = k - plan.offsets[row]
            low, high = max(0.0, start), min(float(cycles), start + plan.duty)
            if high > low:
                label = "planned" if row == 0 and low == 0.0 else None
                ax.barh(row, high - low, left=low, height=0.86, color="0.82", label=label)
        for i, (low, high) in enumerate(intervals):
            label = "measured" if not row and not i else None
            ax.barh(row, high - low, left=low, height=0.36, color=plots.BLUE, label=label)
    ax.set_yticks(range(4), robot.LEGS, fontsize=8)
    ax.invert_yaxis()
    ax.set_xlim(0, cycles)
    ax.set_title(record["task"], fontsize=10)
    ax.tick_params(axis="x", labelsize=8)


@dataclass
class Recorder:
    """Lets an environment's physics run one millisecond at a time and notes what it sees after each.

    Use as a context: inside, the environment's `Simulation.step` is replaced. `series` gives what was seen, one row per
    millisecond.
    """

    lab: Lab
    rows: dict[str, list[np.ndarray]] = field(default_factory=dict)

    def __enter__(self) -> "Recorder":
        self._simulation = self.lab.env.simulation
        self._step: Callable[[np.ndarray, int], None] = self._simulation.step
        self._simulation.step = self._recorded
        return self

    def __exit__(self, *_: object) -> None:
        del self._simulation.step  # the class's own shows again

    def _recorded(self, target: np.ndarray, physics_steps: int) -> None:
        begun = self.lab.env.state  # the clock moves on after the physics
        for i in range(physics_steps):
            self._step(target, 1)
            state = self.lab.env.state
            seen = {
                "phase": next_phase(begun.gait, begun.phase, begun.command, (i + 1) / PHYSICS_HZ),
                "contacts": state.contacts,
                "torque": self._simulation.torque,
                "joint_velocity": state.v,
                "height": state.position_w[2],
                "rpy": state.rpy,
                "velocity": state.base_velocity,
                "wanted": state.command,
            }
            for name, value in seen.items():
                self.rows.setdefault(name, []).append(np.array(value))

    def series(self, skip_s: float) -> dict[str, np.ndarray]:
        """Name -> array with one row per millisecond, without the first seconds."""
        return {name: np.array(rows[round(skip_s * PHYSICS_HZ) :]) for name, rows in self.rows.items()}


def _rollout(
    lab: Lab, task: str, command: np.ndarray, options: SteadyOptions, seed: int, schedule: bool = False
) -> dict[str, Any]:
    lab.begin(task, command, "steady", seed)
    before = dict(lab.settle())
    with Recorder(lab) as recorder:
        survived = lab.walk(options.seconds)
    made, gait = {name: count - before[name] for name, count in lab.settle().items()}, TASKS[task].gait
    series = recorder.series(options.skip_s)
    metrics = {
        "command": command,
        "survived": survived,
        "qp_iterations": made["iterations"] / max(1, made["calls"]),
    }
    if len(series["phase"]) < gait.period * PHYSICS_HZ:
        return metrics
    metrics |= contact_metrics(series["contacts"], series["phase"], gait) | body_metrics(series)
    if schedule:
        metrics["schedule"] = contact_intervals(series["contacts"], series["phase"], gait, options.cycles)
    return metrics


# -- Contacts ----------------------------------------------------------------------------------------------------------


def contact_metrics(contacts: np.ndarray, phase: np.ndarray, gait: Gait) -> dict[str, float]:
    """How well the feet keep to the plan.

    Args:
        contacts: which feet press on the ground, bool, shape (n, 4), one row per millisecond.
        phase: the gait clock [cycles], shape (n,).
        gait: the plan.

    Returns:
        "contact_agreement", the fraction of (leg, sample) in which contact is as planned; "touchdown_lag_s" and
        "liftoff_lag_s", medians of measured minus planned time [s]; "flight_fraction", that of samples with no foot
        on the ground, and "planned_flight_fraction".
    """
    planned = gait.stance(phase)
    return {
        "contact_agreement": float((contacts == planned).mean()),
        "touchdown_lag_s": _lag(contacts, planned, gait, rising=True),
        "liftoff_lag_s": _lag(contacts, planned, gait, rising=False),
        "flight_fraction": float((~contacts.any(axis=1)).mean()),
        "planned_flight_fraction": float((~planned.any(axis=1)).mean()),
    }


def _lag(contacts: np.ndarray, planned: np.ndarray, gait: Gait, rising: bool) -> float:
    """Median delay of the measured change nearest to each planned one, within a third of a cycle [s]."""
    lags = []
    for leg in range(4):
        seen, planned_at = (np.flatnonzero(_changes(series[:, leg], rising)) for series in (contacts, planned))
        for at in planned_at:
            delays = seen - at
            near = delays[np.abs(delays) < gait.period * PHYSICS_HZ / 3]
            if len(near):
                lags.append(near[np.abs(near).argmin()])
    return float(np.median(lags)) / PHYSICS_HZ if lags else float("nan")


def _changes(on: np.ndarray, rising: bool) -> np.ndarray:
    return on[1:] & ~on[:-1] if rising else ~on[1:] & on[:-1]


def contact_intervals(contacts: np.ndarray, phase: np.ndarray, gait: Gait, cycles: int) -> list[list[list[float]]]:
    """For each leg the intervals [from, to] on the ground, in cycles from 0 to `cycles`, near the end of the series."""
    starts = np.flatnonzero(np.diff(phase) < 0) + 1
    if len(starts) <= cycles:
        return [[] for _ in range(4)]
    first, last = starts[-cycles - 1], starts[-1]
    legs = []
    for leg in range(4):
        padded = np.concatenate([[False], contacts[first:last, leg], [False]])
        begins, ends = (np.flatnonzero(_changes(padded, rising)) for rising in (True, False))
        scale = cycles / (last - first)
        legs.append([[round(float(a * scale), 4), round(float(b * scale), 4)] for a, b in zip(begins, ends)])
    return legs


# -- Body --------------------------------------------------------------------------------------------------------------


def body_metrics(series: dict[str, np.ndarray]) -> dict[str, Any]:
    """Effort, posture and tracking.

    The cost of transport is the mean of sum |tau v| over joints, divided by m g times the mean speed in the heading
    frame. The RMS errors compare instantaneous velocity and filtered command, the oscillation within a stride included.
    """
    torque, velocity = series["torque"], series["velocity"]
    speed = float(np.linalg.norm(velocity[:, :2].mean(axis=0)))
    power = float(np.abs(torque * series["joint_velocity"]).sum(axis=1).mean())
    error = velocity - series["wanted"]
    roll, pitch = (np.degrees(series["rpy"][:, i]) for i in range(2))
    return {
        "saturated_fraction": float((np.abs(torque) >= SATURATED * robot.TORQUE_LIMIT).mean()),
        "power_w": power,
        "speed": speed,
        "cost_of_transport": power / (robot.MASS * robot.GRAVITY * speed) if speed > 0.05 else None,
        "height": float(series["height"].mean()),
        "roll_deg": [float(roll.min()), float(roll.max())],
        "pitch_deg": [float(pitch.min()), float(pitch.max())],
        "rms_velocity_error": float(np.sqrt((error[:, :2] ** 2).sum(axis=1).mean())),
        "rms_yaw_rate_error": float(np.sqrt((error[:, 2] ** 2).mean())),
    }
