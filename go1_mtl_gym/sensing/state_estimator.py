"""A state estimator as robots carry one: the expert's state from the student's sensors.

Attitude is the gyroscope's, integrated, and drawn slowly towards where the accelerometer sees up: R. Mahony et al.,
"Nonlinear complementary filters on the special orthogonal group", 2008, with the specific force as it is, not made a
unit vector, so that the accelerations of a gait average out, less that of walking a circle. Velocity and height are a
Kalman filter's that integrates the accelerometer and is corrected by the legs, because a foot that stands does not
move: M. Bloesch et al., "State estimation for legged robots", 2012, without the feet's places in its state, which serve
the robot's own place in the world; nobody here asks for that.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.kinematics import contact_points
from go1_mtl_gym.rotations import matrix_from_vector, quat_from_matrix
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.validation import Limits, check_numbers

_GRAVITY_W = np.array([0.0, 0.0, -robot.GRAVITY])
_SETTLED = 1e-6
"""Variance of velocity [m^2/s^2] and height [m^2] after standing still."""
_POSITIVE = Limits(1e-4, 1e3)
_ALLOWED = dict.fromkeys(("attitude_s", "acceleration", "foot_speed", "foot_height"), _POSITIVE)
_ALLOWED["settle_s"] = Limits(0.0, 1e3)


@dataclass(frozen=True)
class StateEstimatorConfig:
    """What the filter believes of its sensors.

    The defaults suit the sensors' default noise at 500 Hz; they were found by hand, on a trot and a jump.

    Attributes:
        attitude_s: time in which the accelerometer corrects roll and pitch [s].
        acceleration: standard deviation of what is integrated, noise and what happens between two readings [m/s^2].
        foot_speed: of a standing foot's speed, noise of the joints' and sliding [m/s].
        foot_height: of a standing foot's height [m].
        settle_s: a foot is believed to stand when it has been on the ground for this long [s].

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    attitude_s: float = 3.0
    acceleration: float = 1.0
    foot_speed: float = 0.1
    foot_height: float = 0.005
    settle_s: float = 0.01

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_numbers(self, _ALLOWED, "state estimator ")


class StateEstimator:
    """The filter in one episode; a `StateSource`.

    Args:
        config: see there.
    """

    def __init__(self, config: StateEstimatorConfig) -> None:
        """Make a filter that has seen nothing yet."""
        self._config = config

    def begin(self, state: RobotState, readings: Mapping[str, np.ndarray]) -> None:
        """Begin with a robot that stands still: its attitude, heading and place are known, its speed is zero.

        Args:
            state: the true one.
            readings: as of `advance`.
        """
        self._rotation = state.rotation
        self._position_w = state.position_w + state.rotation @ robot.IMU_POSITION_B  # of the inertial unit
        self._velocity_w = np.zeros(3)  # likewise
        self._covariance = _SETTLED * np.eye(4)  # of velocity and height
        self._standing_s = np.zeros(4)
        self._readings = readings

    def advance(self, readings: Mapping[str, np.ndarray], seconds: float) -> None:
        """Take in the next readings.

        Args:
            readings: "accelerometer", "gyroscope", "q", "dq" and "contacts", as in the observation; kept as they are.
            seconds: since the last ones [s].
        """
        before, self._readings = self._readings, readings
        omega, force = ((before[name] + readings[name]) / 2 for name in ("gyroscope", "accelerometer"))
        self._predict(omega, force, seconds)
        on_ground = readings["contacts"] > 0.5
        self._standing_s = np.where(on_ground, self._standing_s + seconds, 0.0)
        standing = self._standing_s > self._config.settle_s
        if standing.any():
            self._correct(standing)

    def _predict(self, omega_b: np.ndarray, force_b: np.ndarray, seconds: float) -> None:
        """Attitude, velocity and place after some time of mean angular velocity and mean specific force."""
        before = self._rotation
        turning_b = np.cross(omega_b, self._velocity_w @ before)  # acceleration of a robot that walks a circle
        towards_up = np.cross((force_b - turning_b) / robot.GRAVITY, before[2]) / self._config.attitude_s
        self._rotation = before @ matrix_from_vector((omega_b + towards_up) * seconds)
        acceleration = (before + self._rotation) @ force_b / 2 + _GRAVITY_W
        self._position_w = self._position_w + (self._velocity_w + acceleration * seconds / 2) * seconds
        self._velocity_w = self._velocity_w + acceleration * seconds
        step = np.eye(4)
        step[3, 2] = seconds
        noise = np.diag([1.0, 1.0, 1.0, seconds**2 / 4]) * (self._config.acceleration * seconds) ** 2
        self._covariance = step @ self._covariance @ step.T + noise

    def _correct(self, standing: np.ndarray) -> None:
        """The mean of the standing feet says how fast and how high the inertial unit is."""
        points, velocities = contact_points(self._readings["q"], self._readings["dq"], self._rotation[2])
        arms = points[standing] - robot.IMU_POSITION_B
        moving_b = np.cross(self._readings["gyroscope"], arms) + velocities[standing]
        velocity = -self._rotation @ moving_b.mean(axis=0)
        height = -self._rotation[2] @ arms.mean(axis=0)
        error = np.append(velocity - self._velocity_w, height - self._position_w[2])
        noise = [self._config.foot_speed**2] * 3 + [self._config.foot_height**2]
        gain = np.linalg.solve(self._covariance + np.diag(noise) / standing.sum(), self._covariance).T
        change = gain @ error
        self._velocity_w = self._velocity_w + change[:3]
        self._position_w = self._position_w + [0.0, 0.0, change[3]]
        self._covariance = self._covariance - gain @ self._covariance

    def estimate(self, state: RobotState) -> RobotState:
        """What the filter makes of the readings so far; contacts, clock and command are the given state's."""
        rotation, arm, omega = self._rotation, robot.IMU_POSITION_B, self._readings["gyroscope"]
        return replace(
            state,
            position_w=self._position_w - rotation @ arm,
            quat_wxyz=quat_from_matrix(rotation),
            linear_velocity_w=self._velocity_w - rotation @ np.cross(omega, arm),
            angular_velocity_b=omega.copy(),
            q=self._readings["q"].copy(),
            v=self._readings["dq"].copy(),
        )
