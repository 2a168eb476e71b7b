"""Steady walking, looked at every millisecond: contacts against the plan, torques, energy, posture and tracking."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from expert_report.lab import Lab, generator
from expert_report.limits import CRUISE
from go1_mtl_gym import TASKS, Gait, robot
from go1_mtl_gym.actuation import PHYSICS_HZ
from go1_mtl_gym.gaits import next_phase

SATURATED = 0.999
"""A joint is at its limit from this share of it."""


@dataclass(frozen=True)
class SteadyConfig:
    """Two rollouts: one at `CRUISE`, one at a drawn command.

    Attributes:
        seconds: duration of each [s].
        skip_s: start that does not count [s].
        cycles: of the gait whose contacts are kept for the picture.
    """

    seconds: float = 10.0
    skip_s: float = 2.0
    cycles: int = 2


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
            self._note("phase", next_phase(begun.gait, begun.phase, begun.command, (i + 1) / PHYSICS_HZ))
            self._note("contacts", state.contacts)
            self._note("torque", self._simulation.torque)
            self._note("joint_velocity", state.v)
            self._note("height", state.position_w[2])
            self._note("rpy", state.rpy)
            self._note("velocity", state.base_velocity)
            self._note("wanted", state.command)

    def _note(self, name: str, value: Any) -> None:
        self.rows.setdefault(name, []).append(np.array(value))

    def series(self, skip_s: float) -> dict[str, np.ndarray]:
        """Name -> array with one row per millisecond, without the first seconds."""
        return {name: np.array(rows[round(skip_s * PHYSICS_HZ) :]) for name, rows in self.rows.items()}


def steady(lab: Lab, task: str, config: SteadyConfig, seed: int) -> dict[str, Any]:
    """{"cruise": figures, "drawn": figures}; with "schedule", the contacts of the last cycles, of the first."""
    drawn = TASKS[task].draw_command(generator("steady", task, seed))
    return {
        "cruise": _rollout(lab, task, np.array(CRUISE), config, seed, schedule=True),
        "drawn": _rollout(lab, task, drawn, config, seed),
    }


def _rollout(
    lab: Lab, task: str, command: np.ndarray, config: SteadyConfig, seed: int, schedule: bool = False
) -> dict[str, Any]:
    lab.begin(task, command, "steady", seed)
    calls, iterations = lab.settle().calls, lab.ledger.iterations
    with Recorder(lab) as recorder:
        survived = lab.walk(config.seconds)
    ledger, gait = lab.settle(), TASKS[task].gait
    series = recorder.series(config.skip_s)
    figures = {
        "command": command,
        "survived": survived,
        "qp_iterations": (ledger.iterations - iterations) / max(1, ledger.calls - calls),
    }
    if len(series["phase"]) < gait.period * PHYSICS_HZ:
        return figures
    figures |= contact_figures(series["contacts"], series["phase"], gait) | body_figures(series)
    if schedule:
        figures["schedule"] = contact_intervals(series["contacts"], series["phase"], gait, config.cycles)
    return figures


# -- Contacts ----------------------------------------------------------------------------------------------------------


def contact_figures(contacts: np.ndarray, phase: np.ndarray, gait: Gait) -> dict[str, float]:
    """How well the feet keep to the plan.

    Args:
        contacts: which feet press on the ground, bool, shape (n, 4), one row per millisecond.
        phase: the gait clock [cycles], shape (n,).
        gait: the plan.

    Returns:
        "contact_agreement", the share of (leg, sample) in which contact is as planned; "touchdown_lag_s" and
        "liftoff_lag_s", medians of measured minus planned time [s]; "flight_share", the share of samples with no foot
        on the ground, and "planned_flight_share".
    """
    planned = gait.stance(phase)
    return {
        "contact_agreement": float((contacts == planned).mean()),
        "touchdown_lag_s": _lag(contacts, planned, gait, rising=True),
        "liftoff_lag_s": _lag(contacts, planned, gait, rising=False),
        "flight_share": float((~contacts.any(axis=1)).mean()),
        "planned_flight_share": float((~planned.any(axis=1)).mean()),
    }


def _lag(contacts: np.ndarray, planned: np.ndarray, gait: Gait, rising: bool) -> float:
    """Median delay of the measured change nearest to each planned one, within a third of a cycle [s]."""
    lags = []
    for leg in range(4):
        seen, meant = (np.flatnonzero(_changes(series[:, leg], rising)) for series in (contacts, planned))
        for at in meant:
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


def body_figures(series: dict[str, np.ndarray]) -> dict[str, Any]:
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
        "saturated_share": float((np.abs(torque) >= SATURATED * robot.TORQUE_LIMIT).mean()),
        "power_w": power,
        "speed": speed,
        "cost_of_transport": power / (robot.MASS * robot.GRAVITY * speed) if speed > 0.05 else None,
        "height": float(series["height"].mean()),
        "roll_deg": [float(roll.min()), float(roll.max())],
        "pitch_deg": [float(pitch.min()), float(pitch.max())],
        "rms_velocity_error": float(np.sqrt((error[:, :2] ** 2).sum(axis=1).mean())),
        "rms_yaw_rate_error": float(np.sqrt((error[:, 2] ** 2).mean())),
    }
