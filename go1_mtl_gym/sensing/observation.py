"""The one flat observation: its named slices, its bounds and the noise of its sensors.

| name          | size | unit    | always there | content                                                            |
|---------------|------|---------|--------------|--------------------------------------------------------------------|
| accelerometer | 3    | m/s^2   | yes          | specific force at the IMU, trunk frame                             |
| gyroscope     | 3    | rad/s   | yes          | angular velocity, trunk frame                                      |
| q             | 12   | rad     | yes          | joint positions                                                    |
| dq            | 12   | rad/s   | yes          | joint velocities                                                   |
| contacts      | 4    | 0 or 1  | yes          | feet on the ground, FL FR RL RR                                    |
| command       | 3    | m/s, rad/s | channel   | filtered (vx, vy, yaw rate)                                        |
| gravity       | 3    | -       | channel      | unit vector of gravity, trunk frame                                |
| phase         | 2    | -       | channel      | sine and cosine of the gait clock                                  |
| last_action   | 12   | -       | channel      | the action applied during the last step                            |
| leg_kinematics | 24  | m, m/s | channel      | feet, 4 x 3, and what each says of the trunk's velocity, 4 x 3     |
| gait          | 29   | mixed   | channel      | clocks of the legs and the figures of the gait, `gait_numbers`      |
| history       | 34 (n - 1) | as above | history = n | the n - 1 proprioceptive frames before this one, newest first |
| task          | K    | 0 or 1  | yes          | one-hot task id, in the order of the environment's `tasks`         |
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, astuple, dataclass
from types import MappingProxyType

import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import Limits, check_numbers, integer_in, one_of

PROPRIOCEPTION = MappingProxyType({"accelerometer": 3, "gyroscope": 3, "q": 12, "dq": 12, "contacts": 4})
"""Sizes of the raw proprioceptive parts; together the 34 numbers of arXiv 2505.08574."""
CHANNELS = MappingProxyType(
    {"command": 3, "gravity": 3, "phase": 2, "last_action": 12, "leg_kinematics": 24, "gait": 29}
)
"""Sizes of the parts that are there when asked for."""
UNITS = MappingProxyType(
    {
        "accelerometer": "m/s^2",
        "gyroscope": "rad/s",
        "q": "rad",
        "dq": "rad/s",
        "command": "m/s, m/s, rad/s",
        "leg_kinematics": "m, m/s",
        "gait": "-, s, s, -, -, Hz, m, -, -, -",
    }
)
"""Units of the parts that have one."""
FRAME_SIZE = sum(PROPRIOCEPTION.values())

_BOUND = {
    "accelerometer": np.full(3, 160.0),  # a 16 g accelerometer saturates here
    "gyroscope": np.full(3, 35.0),  # a 2000 deg/s gyroscope saturates here
    "q": np.full(12, 2 * np.pi),
    "dq": 3 * robot.SPEED_LIMIT,
    "command": np.array([5.0, 5.0, 5.0]),
    "gravity": np.ones(3),
    "phase": np.ones(2),
    "last_action": np.ones(12),
    "leg_kinematics": np.repeat([1.0, 40.0], 12),
    "gait": np.concatenate([np.ones(8), np.full(8, 3.0), np.ones(8), [7.0, 0.2, 1.5, 1.2, 1.0]]),
}


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations of white Gaussian noise added to each reading.

    The defaults are of the size that MEMS inertial units and joint encoders of small quadrupeds show.

    Attributes:
        accelerometer: [m/s^2].
        gyroscope: [rad/s].
        q: [rad].
        dq: [rad/s].
        gravity: per component of the unit vector.

    Raises:
        InvalidInputError: if a figure is negative, above 10, or not a number.
    """

    accelerometer: float = 0.3
    gyroscope: float = 0.05
    q: float = 0.005
    dq: float = 0.25
    gravity: float = 0.02

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_numbers(self, Limits(0.0, 10.0), "sensor noise of ")

    def scaled(self, factor: float) -> "SensorNoise":
        """The same with every standard deviation multiplied by a factor.

        Raises:
            InvalidInputError: if a figure then exceeds 10.
        """
        return SensorNoise(*(factor * deviation for deviation in astuple(self)))

    def apply(self, parts: dict[str, np.ndarray], rng: np.random.Generator) -> None:
        """Add noise to the readings in place, drawing in a fixed order."""
        for name, deviation in asdict(self).items():
            if name in parts:
                parts[name] = parts[name] + rng.normal(0.0, deviation, parts[name].shape)


class ObservationLayout:
    """Where each named part stands in the flat observation, and how large it can be.

    Args:
        tasks: names of the tasks, in the order of the one-hot id.
        channels: names from `CHANNELS`; they stand in the order of that table whatever the order here.
        history: number of proprioceptive frames, this one included.

    Attributes:
        slices: part name -> slice of the observation.
        size: length of the observation.
        tasks, channels, history: as given, the channels in the order of their table.
        n_tasks: K.
        low, high: bounds, float32, shape (size,).

    Raises:
        InvalidInputError: for an unknown or repeated channel, or a history outside 1 ... 50.
    """

    def __init__(self, tasks: Sequence[str], channels: Sequence[str] = (), history: int = 1) -> None:
        """Find out where everything stands."""
        if isinstance(channels, str) or not isinstance(channels, Sequence):
            raise InvalidInputError(f'channels must be a sequence of names such as ("command",), got {channels!r}')
        for name in channels:
            one_of(name, tuple(CHANNELS), "channel")
        if len(set(channels)) != len(channels):
            raise InvalidInputError(f"channels must differ from each other, got {tuple(channels)}")
        self.channels = tuple(name for name in CHANNELS if name in channels)
        self.history = integer_in(history, 1, 50, "history")
        self.tasks = tuple(tasks)
        self.n_tasks = len(self.tasks)
        sizes = dict(PROPRIOCEPTION) | {name: CHANNELS[name] for name in self.channels}
        if self.history > 1:
            sizes["history"] = FRAME_SIZE * (self.history - 1)
        sizes["task"] = self.n_tasks
        ends = np.cumsum(list(sizes.values()))
        self.slices: Mapping[str, slice] = MappingProxyType(
            {name: slice(int(end) - size, int(end)) for (name, size), end in zip(sizes.items(), ends, strict=True)}
        )
        self.size = int(ends[-1])
        self.low, self.high = self._bounds()

    def __reduce__(self) -> tuple[type["ObservationLayout"], tuple[object, ...]]:
        """Copies and pickles are built anew: views of dictionaries, such as `slices`, cannot be pickled."""
        return ObservationLayout, (self.tasks, self.channels, self.history)

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        high = np.ones(self.size)
        for name, where in self.slices.items():
            if name in _BOUND:
                high[where] = _BOUND[name]
        low = -high
        for name in ("contacts", "task"):
            low[self.slices[name]] = 0.0
        if self.history > 1:
            for bound in (low, high):
                bound[self.slices["history"]] = np.tile(bound[:FRAME_SIZE], self.history - 1)
        return low.astype(np.float32), high.astype(np.float32)

    def columns(self, other: "ObservationLayout") -> np.ndarray:
        """Where the entries of a smaller observation stand in this one: ``observation[columns]`` is the smaller one.

        Args:
            other: a layout with the same tasks, with no channel that is not here, and with no more frames.

        Returns:
            int, shape (other.size,).

        Raises:
            InvalidInputError: if the other layout has something that is not here, or other tasks.
        """
        if other.tasks != self.tasks:
            raise InvalidInputError(f"both layouts must have the tasks {self.tasks}, the other one has {other.tasks}")
        missing = [name for name in other.channels if name not in self.channels]
        if missing:
            raise InvalidInputError(f"the other layout's channels must be among {self.channels}, got also {missing}")
        if other.history > self.history:
            raise InvalidInputError(f"the other layout's history must be at most {self.history}, got {other.history}")
        first = {name: self.slices[name].start for name in other.slices}
        return np.concatenate([np.arange(w.stop - w.start) + first[name] for name, w in other.slices.items()])

    def proprioception(self, observation: np.ndarray) -> dict[str, np.ndarray]:
        """The proprioceptive parts of an observation by name, float64 copies."""
        return {name: observation[self.slices[name]].astype(np.float64) for name in PROPRIOCEPTION}

    def flatten(self, parts: Mapping[str, np.ndarray], older_frames: Sequence[np.ndarray], task: int) -> np.ndarray:
        """The observation, clipped to its bounds as a saturating sensor would.

        Args:
            parts: the proprioceptive parts and channels by name.
            older_frames: the `history` - 1 frames before this one, newest first, each of shape (34,).
            task: index of the task.

        Returns:
            float32, shape (size,).
        """
        observation = np.zeros(self.size)
        for name, where in self.slices.items():
            if name in parts:
                observation[where] = parts[name]
        if self.history > 1:
            observation[self.slices["history"]] = np.concatenate(older_frames)
        observation[self.slices["task"].start + task] = 1.0
        return np.clip(observation, self.low, self.high).astype(np.float32)
