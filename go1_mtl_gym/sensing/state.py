"""Everything that an expert may read, as one immutable value."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from go1_mtl_gym.gaits import Gait, is_standing
from go1_mtl_gym.rotations import matrix_from_quat, rpy_from_quat, yaw_matrix


@dataclass(frozen=True)
class RobotState:
    """The robot, its gait clock and its command at one instant.

    An expert's action is a function of this value and of nothing else.

    Attributes:
        position_w: trunk origin in the world [m], shape (3,); the ground is z = 0.
        quat_wxyz: attitude of the trunk, unit quaternion (w, x, y, z) from base to world, shape (4,).
        linear_velocity_w: velocity of the trunk origin, world frame [m/s], shape (3,).
        angular_velocity_b: angular velocity of the trunk, base frame [rad/s], shape (3,).
        q: joint positions [rad], shape (12,).
        v: joint velocities [rad/s], shape (12,).
        contacts: which feet press on the ground, bool, shape (4,).
        gait: the contact plan asked for.
        phase: the gait clock [cycles], in [0, 1).
        command: filtered (vx [m/s], vy [m/s], yaw rate [rad/s]) in the heading frame, shape (3,).
        time_s: since the reset [s].
        payload_kg: mass of a cube at the trunk's centre of mass that the expert is told of [kg].
        motor_strength: factor on the torques of the actuators, likewise.
        friction: coefficient of sliding friction between feet and ground that the expert is told of, or None.
        joint_friction: dry friction of every joint beyond the model's, likewise [N m].
        joint_damping: of every joint beyond the model's, likewise [N m s/rad].
        foot_sink: how much deeper than the model's the feet of the standing robot sink into the ground, likewise [m].
    """

    position_w: np.ndarray
    quat_wxyz: np.ndarray
    linear_velocity_w: np.ndarray
    angular_velocity_b: np.ndarray
    q: np.ndarray
    v: np.ndarray
    contacts: np.ndarray
    gait: Gait
    phase: float
    command: np.ndarray
    time_s: float = 0.0
    payload_kg: float = 0.0
    motor_strength: float = 1.0
    friction: float | None = None
    joint_friction: float = 0.0
    joint_damping: float = 0.0
    foot_sink: float = 0.0

    @cached_property
    def standing(self) -> bool:
        """Whether the gait clock rests, so that all feet stay on the ground; a function of gait, phase and command."""
        return is_standing(self.gait, self.phase, self.command)

    @cached_property
    def rotation(self) -> np.ndarray:
        """Rotation matrix from base to world, shape (3, 3)."""
        return matrix_from_quat(self.quat_wxyz)

    @cached_property
    def rpy(self) -> np.ndarray:
        """Roll, pitch, yaw [rad] of R = Rz(yaw) Ry(pitch) Rx(roll), shape (3,)."""
        return rpy_from_quat(self.quat_wxyz)

    @cached_property
    def gravity_b(self) -> np.ndarray:
        """Unit vector of gravity in the base frame, shape (3,); (0, 0, -1) when level."""
        return -self.rotation[2]

    @cached_property
    def base_velocity(self) -> np.ndarray:
        """Measured (vx, vy [m/s], yaw rate [rad/s]) in the heading frame (world turned by yaw), shape (3,)."""
        (cos, _), (sin, _) = yaw_matrix(self.rpy[2])
        vx, vy, _ = self.linear_velocity_w
        yaw_rate = self.rotation[2] @ self.angular_velocity_b
        return np.array([cos * vx + sin * vy, cos * vy - sin * vx, yaw_rate])
