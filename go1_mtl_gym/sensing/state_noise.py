"""What a state estimator on the robot would get wrong; the expert can be asked for its answer to such a state."""

from collections.abc import Mapping
from dataclasses import astuple, dataclass, replace

import numpy as np

from go1_mtl_gym.rotations import quat_from_rpy
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.validation import Limits, check_numbers

_SIZE = {"height": 1, "attitude": 2, "velocity": 3, "angular_velocity": 3, "q": 12, "dq": 12}
_END = dict(zip(_SIZE, np.cumsum(list(_SIZE.values())).tolist()))
_PART = {name: slice(end - _SIZE[name], end) for name, end in _END.items()}


@dataclass(frozen=True)
class EstimatorNoise:
    """Standard deviations of Gaussian errors: white, drawn at every control step, and a bias, drawn per episode.

    The defaults are of the size that estimators of legged robots show, which join inertial unit and leg kinematics.
    Horizontal position and heading are left as they are: only their differences from the feet's matter to an expert.

    Attributes:
        height, height_bias: of the trunk's origin above the ground [m].
        attitude, attitude_bias: of roll and pitch [rad].
        velocity, velocity_bias: of the trunk's linear velocity, along its axes [m/s].
        angular_velocity, angular_velocity_bias: of the trunk, along its axes [rad/s].
        q, q_bias: of the joint positions [rad].
        dq, dq_bias: of the joint velocities [rad/s].

    Raises:
        InvalidInputError: if a figure is negative, above 10, or not a number.
    """

    height: float = 0.01
    height_bias: float = 0.01
    attitude: float = 0.01
    attitude_bias: float = 0.01
    velocity: float = 0.05
    velocity_bias: float = 0.03
    angular_velocity: float = 0.05
    angular_velocity_bias: float = 0.01
    q: float = 0.005
    q_bias: float = 0.0
    dq: float = 0.25
    dq_bias: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_numbers(self, Limits(0.0, 10.0), "estimator noise ")

    def scaled(self, factor: float) -> "EstimatorNoise":
        """The same with every standard deviation multiplied by a factor.

        Raises:
            InvalidInputError: if a figure then exceeds 10.
        """
        return EstimatorNoise(*(factor * deviation for deviation in astuple(self)))

    def spread(self, suffix: str = "") -> np.ndarray:
        """The standard deviation of every number that is estimated, white or (suffix "_bias") constant, shape (33,)."""
        return np.concatenate([np.full(size, getattr(self, name + suffix)) for name, size in _SIZE.items()])


class EstimatorError:
    """The errors of one episode, in steps of the control period; a `StateSource`.

    Args:
        noise: how large they are.
        seed: of a generator of their own.
    """

    def __init__(self, noise: EstimatorNoise, seed: int) -> None:
        """Draw the biases."""
        self._rng = np.random.default_rng(seed)
        self._white = noise.spread()
        self._bias = noise.spread("_bias") * self._rng.standard_normal(len(self._white))
        self._draw()

    def begin(self, state: RobotState, readings: Mapping[str, np.ndarray]) -> None:
        """Nothing: the errors of the first state are drawn already."""

    def advance(self, readings: Mapping[str, np.ndarray], seconds: float) -> None:
        """Draw the errors of the next control step."""
        self._draw()

    def _draw(self) -> None:
        self._now = self._bias + self._white * self._rng.standard_normal(len(self._white))

    def estimate(self, state: RobotState) -> RobotState:
        """What is estimated when this is the state; contacts, clock and command are known exactly."""
        error = {name: self._now[part] for name, part in _PART.items()}
        roll, pitch, yaw = state.rpy
        return replace(
            state,
            position_w=state.position_w + np.r_[0.0, 0.0, error["height"]],
            quat_wxyz=quat_from_rpy(roll + error["attitude"][0], pitch + error["attitude"][1], yaw),
            linear_velocity_w=state.linear_velocity_w + state.rotation @ error["velocity"],
            angular_velocity_b=state.angular_velocity_b + error["angular_velocity"],
            q=state.q + error["q"],
            v=state.v + error["dq"],
        )
