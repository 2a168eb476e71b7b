"""How far the world may differ from the one that the student was trained in: one quantity at a time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import trainers
from go1_mtl_gym.sensing.observation import SensorNoise
from go1_mtl_gym.sensing.state_noise import EstimatorNoise
from student_report.lab import EXPERT, summary


@dataclass(frozen=True)
class Quantity:
    """One thing that differs.

    Attributes:
        label: its name and unit.
        values: from one end of its range to the other.
    """

    label: str
    values: tuple[float, ...]


QUANTITIES = {
    "friction": Quantity("friction", (0.4, 0.55, 0.7, 0.85, 1.0)),
    "payload_kg": Quantity("payload [kg]", (0.0, 0.75, 1.5, 2.25, 3.0)),
    "action_delay_s": Quantity("action delay [s]", (0.0, 0.005, 0.01, 0.015, 0.02)),
    "motor_strength": Quantity("motor strength", (0.9, 0.95, 1.0, 1.05, 1.1)),
    "joint_friction": Quantity("joint friction [N m]", (0.0, 0.25, 0.5, 0.75, 1.0)),
    "rotor_inertia": Quantity("rotor inertia [kg m²]", (0.0, 0.0025, 0.005, 0.0075, 0.01)),
    "contact_time_s": Quantity("contact time [s]", (0.005, 0.01, 0.02, 0.03, 0.04)),
    "noise": Quantity("noise, in units of the default", (0.0, 0.5, 1.0, 1.5, 2.0)),
}
"""Argument of `Go1Env` -> what it is varied over. Noise is the student's sensors' or the expert's estimator's."""


@dataclass(frozen=True)
class RobustnessConfig:
    """Drawn commands in a world that differs.

    Attributes:
        episodes: per gait and value.
        seconds: duration of each [s].
        command_interval: time between commands [s].
        every: 1 for all values, 2 for the ends and the middle.
        quantities: which of `QUANTITIES`.
    """

    episodes: int = 20
    seconds: float = 10.0
    command_interval: float = 5.0
    every: int = 1
    quantities: tuple[str, ...] = tuple(QUANTITIES)

    def parts(self, task: str, tasks: Sequence[str]) -> tuple[str, ...]:
        """The quantities."""
        return self.quantities


def robustness(who: Any, task: str, quantity: str, config: RobustnessConfig, seed: int, **env_kwargs: Any) -> dict:
    """{"levels": [{"value": ..., and what `student_lab.summary` gives}]}; the same commands at every value."""
    levels = []
    for value in QUANTITIES[quantity].values[:: config.every]:
        result = trainers.evaluate(
            who,
            task,
            config.episodes,
            config.seconds,
            seed,
            command_interval=config.command_interval,
            **(env_kwargs | world(quantity, value, who)),
        )
        levels.append({"value": value, **summary(result)})
    return {"levels": levels}


def world(quantity: str, value: float, who: Any) -> dict[str, Any]:
    """Arguments of `Go1Env` that make a quantity have a value for a policy or "expert"."""
    if quantity != "noise":
        return {quantity: value}
    if isinstance(who, str) and who == EXPERT:
        return {"estimator_noise": EstimatorNoise().scaled(value)}
    return {"noise": SensorNoise().scaled(value)}
