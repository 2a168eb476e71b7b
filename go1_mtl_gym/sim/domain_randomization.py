"""Physics and sensors that differ from episode to episode."""

from dataclasses import dataclass, field, fields, replace

import numpy as np

from go1_mtl_gym.deprecation import renamed_arguments
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing import sensor_faults
from go1_mtl_gym.sensing.sensor_faults import SensorParams
from go1_mtl_gym.sim import physics_params
from go1_mtl_gym.sim.physics_params import PhysicsParams
from go1_mtl_gym.validation import Limits, finite_vector, number_in

Range = tuple[float, float] | None
OF_SENSORS = {"encoder_offset": "encoder_offset", "sensor_delay_s": "delay_s"}
"""Range of `DomainRandomization` -> the field of `SensorParams` that it is of."""
_CHANCES = {
    "fraction": "fraction of randomized episodes",
    "each": "each, the probability of being drawn",
    "ends": "ends, the probability of an end of a range",
}
SETTLE_S = (0.0, 10.0)
"""Shortest and longest time for which a robot may stand before an episode begins [s]."""
_LIMITS = {
    **physics_params.LIMITS,
    **{name: sensor_faults.LIMITS[own] for name, own in OF_SENSORS.items()},
    "noise": Limits(0.0, 10.0),
    "settle_s": Limits(*SETTLE_S, " [s]"),
}
"""Range -> what its ends may be."""


@dataclass(frozen=True)
class EpisodeConditions:
    """What can differ from episode to episode.

    Attributes:
        physics: differences from the expert's model.
        sensors: faults of the readings.
        noise: factor on the sensor noise; None leaves the noise as it is.
        settle_s: time for which the robot stands before the episode begins [s].
    """

    physics: PhysicsParams = field(default_factory=PhysicsParams)
    sensors: SensorParams = field(default_factory=SensorParams)
    noise: float | None = None
    settle_s: float = 0.0


@renamed_arguments(share="fraction")
@dataclass(frozen=True)
class DomainRandomization:
    """Ranges (low, high) that an episode's figures are drawn from, uniformly; None leaves the environment's own.

    Attributes:
        friction, payload_kg, action_delay_s, motor_strength, joint_friction, rotor_inertia, contact_time_s,
            joint_damping: as in `go1_mtl_gym.sim.physics_params.PhysicsParams`.
        noise: factor on the environment's `SensorNoise`, or on the default one if the environment has none.
        encoder_offset: largest constant error of the joint positions [rad]; each joint's is drawn within it.
        sensor_delay_s: age of the readings [s].
        settle_s: time for which the robot stands before the episode begins [s].
        fraction: of the episodes that are randomized; the others are as without randomization.
        each: probability with which each of the figures is drawn in such an episode; the others are the environment's
            own. Below 1 there are episodes in which only one or two things differ, which are what a robot meets.
        ends: probability with which a drawn figure is one of the two ends of its range, where robots fall first, and
            which would otherwise be drawn never.

    Raises:
        InvalidInputError: if a range is not low <= high, or one of its ends is an impossible figure.
    """

    friction: Range = (0.4, 1.0)
    payload_kg: Range = (0.0, 3.0)
    action_delay_s: Range = (0.0, 0.02)
    motor_strength: Range = (0.9, 1.1)
    joint_friction: Range = (0.0, 1.0)
    rotor_inertia: Range = (0.0, 0.01)
    contact_time_s: Range = (0.005, 0.16)
    noise: Range = (0.0, 2.0)
    joint_damping: Range = (0.0, 1.0)
    encoder_offset: Range = (0.0, 0.06)
    sensor_delay_s: Range = (0.0, 0.02)
    settle_s: Range = (0.0, 0.5)
    fraction: float = 1.0
    each: float = 1.0
    ends: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges, and bring them into one form."""
        for name, label in _CHANCES.items():
            object.__setattr__(self, name, number_in(getattr(self, name), 0.0, 1.0, label))
        for name, (low, high) in self._ranges().items():
            if low > high:
                raise InvalidInputError(f"range of {name} must be low <= high, got {(low, high)}")
            object.__setattr__(self, name, (low, high))  # equal to what comes back from JSON
            for end in (low, high):
                number_in(end, _LIMITS[name].low, _LIMITS[name].high, f"range of {name}{_LIMITS[name].unit}")

    def draw(self, rng: np.random.Generator, base: EpisodeConditions) -> EpisodeConditions:
        """Draw the figures of an episode; every call takes as many numbers from the generator.

        Args:
            rng: where the randomness comes from.
            base: the environment's own figures.
        """
        names = [each.name for each in fields(self) if each.name not in _CHANCES]
        chance, *levels = rng.uniform(size=1 + len(names)).tolist()
        level, drawn_at = dict(zip(names, levels)), dict(zip(names, rng.uniform(size=len(names)).tolist()))
        drawn = {
            name: min(low + self._place(level[name]) * (high - low), high)  # rounding must not lead beyond the end
            for name, (low, high) in self._ranges().items()
            if drawn_at[name] < self.each
        }
        noise, settle_s = drawn.pop("noise", base.noise), drawn.pop("settle_s", base.settle_s)
        faults = {own: drawn.pop(name) for name, own in OF_SENSORS.items() if name in drawn}
        sensors = replace(base.sensors, **faults).drawn(rng)
        if chance >= self.fraction:
            return base
        return EpisodeConditions(replace(base.physics, **drawn), sensors, noise, settle_s)

    def _place(self, level: float) -> float:
        """Where in a range a uniform draw from [0, 1) leads: both ends gather half of `ends` each."""
        if self.ends == 1.0:
            return float(level >= 0.5)
        return min(max((level - self.ends / 2) / (1.0 - self.ends), 0.0), 1.0)

    def _ranges(self) -> dict[str, tuple[float, float]]:
        """The ranges that are not None, by name."""
        given = {each.name: getattr(self, each.name) for each in fields(self) if each.name not in _CHANCES}
        return {
            name: tuple(finite_vector(ends, 2, f"range of {name}").tolist())
            for name, ends in given.items()
            if ends is not None
        }
