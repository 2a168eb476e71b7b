"""What is wrong with sensors beyond white noise: encoders that were never zeroed, and readings that come late."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PHYSICS_HZ
from go1_mtl_gym.validation import Limits, check_numbers, finite_vector, number_in

LARGEST_OFFSET = 0.5
"""Of an encoder [rad]."""
LIMITS = {"encoder_offset": Limits(0.0, LARGEST_OFFSET, " [rad]"), "delay_s": Limits(0.0, 0.05, " [s]")}
"""What each figure of `SensorParams` may be, if it is a single number."""


@dataclass(frozen=True)
class Reading:
    """What the robot's sensors say at one instant; frames and units as in `go1_mtl_gym.sensing.observation`."""

    accelerometer: np.ndarray
    gyroscope: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    contacts: np.ndarray
    gravity: np.ndarray


@dataclass(frozen=True)
class SensorParams:
    """Faults of the sensors; the defaults are none. Only readings have them: the actuators know their joints.

    Attributes:
        encoder_offset: constant error of the joint positions [rad]: 12 numbers, or the largest one as a single number
            x, from which every episode draws each joint's in [-x, x].
        delay_s: age that every reading has when it is observed [s], rounded to milliseconds.

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    encoder_offset: float | tuple[float, ...] = 0.0
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers, and bring them into one form."""
        check_numbers(self, {"delay_s": LIMITS["delay_s"]}, "sensor ")
        object.__setattr__(self, "encoder_offset", _checked_offset(self.encoder_offset))

    @property
    def is_drawn(self) -> bool:
        """Whether an episode draws its offsets."""
        return isinstance(self.encoder_offset, float) and self.encoder_offset > 0.0

    def drawn(self, rng: np.random.Generator) -> "SensorParams":
        """The same with 12 offsets; takes 12 numbers from the generator, needed or not."""
        level, largest = rng.uniform(-1.0, 1.0, len(robot.JOINTS)), self.encoder_offset
        if isinstance(largest, tuple) or not largest:
            return self
        return replace(self, encoder_offset=tuple((largest * level).tolist()))


def _checked_offset(value: object) -> float | tuple[float, ...]:
    """An encoder offset in its one form.

    Raises:
        InvalidInputError: if it is none.
    """
    label = "sensor encoder_offset [rad]"
    if not isinstance(value, (Sequence, np.ndarray)):
        return number_in(value, 0.0, LARGEST_OFFSET, label)
    offsets = finite_vector(value, len(robot.JOINTS), label).tolist()
    return tuple(number_in(offset, -LARGEST_OFFSET, LARGEST_OFFSET, label) for offset in offsets)


@dataclass
class SensorFaults:
    """The faults of one episode: what was read goes in, what is observed comes out, once per control period.

    Readings that are late by d are those of the times k P - d, with P the control period: one per period, taken
    `early` physics steps before its end.

    Attributes:
        offset: of the encoders [rad], shape (12,).
        early: physics steps between a reading and the end of its control period.
        line: readings on their way, oldest first; its `maxlen` is the number of periods between a reading's and its
            arrival's, plus 1.
    """

    offset: np.ndarray = field(default_factory=lambda: np.zeros(len(robot.JOINTS)))
    early: int = 0
    line: deque[Reading] = field(default_factory=lambda: deque(maxlen=1))

    @classmethod
    def of(cls, params: SensorParams, control_hz: int) -> "SensorFaults":
        """The faults that parameters say.

        Args:
            params: with offsets that are drawn already.
            control_hz: control periods per second.
        """
        late, early = divmod(round(params.delay_s * PHYSICS_HZ), PHYSICS_HZ // control_hz)
        offset = np.broadcast_to(np.array(params.encoder_offset, dtype=np.float64), len(robot.JOINTS)).copy()
        return cls(offset, early, deque(maxlen=late + 1))

    def observe(self, reading: Reading) -> Reading:
        """Take in the newest reading, and give the one that arrives.

        Args:
            reading: without faults; the first one of an episode also stands for those before it.
        """
        missing = (self.line.maxlen or 1) - len(self.line)
        self.line.extend([reading] * max(missing, 1))
        arriving = self.line[0]
        return replace(arriving, q=arriving.q + self.offset) if self.offset.any() else arriving
