"""Where the body should be over the horizon: the command, integrated from here, plus the gait's nominal motion."""

from dataclasses import dataclass

import numpy as np

from experts.nominal import NominalMotion
from experts.planar import turned
from go1_mtl_gym.state import RobotState


@dataclass(frozen=True)
class BodyReference:
    """The body's reference at the N + 1 ends of the horizon's intervals; index 0 is now.

    Attributes:
        rpy: roll, pitch, yaw [rad], shape (N + 1, 3).
        com_w: centre of mass, world [m], shape (N + 1, 3).
        omega_w: angular velocity, world [rad/s], shape (N + 1, 3).
        velocity_w: of the centre of mass, world [m/s], shape (N + 1, 3).
    """

    rpy: np.ndarray
    com_w: np.ndarray
    omega_w: np.ndarray
    velocity_w: np.ndarray

    @property
    def states(self) -> np.ndarray:
        """The MPC's states [rpy, com, omega, velocity], shape (N + 1, 12)."""
        return np.concatenate([self.rpy, self.com_w, self.omega_w, self.velocity_w], axis=1)


def body_reference(
    state: RobotState, com_w: np.ndarray, motion: NominalMotion, com_height: float, dt: float, steps: int
) -> BodyReference:
    """Integrate the command over the horizon.

    Position and yaw start from where the robot is, so the reference has no memory: the same state, phase and command
    always give the same reference. Height, roll and pitch follow the gait's nominal motion.

    Args:
        state: the robot now.
        com_w: its centre of mass, world [m], shape (3,).
        motion: the gait's nominal motion.
        com_height: mean height of the centre of mass [m].
        dt: interval [s].
        steps: N.
    """
    time = np.arange(steps + 1) * dt
    yaw_rate = state.command[2]
    yaw = state.rpy[2] + yaw_rate * time
    deviation, rate = motion.at(state.phase + time / state.gait.period)

    velocity_w = np.column_stack([turned(state.command[:2], yaw), rate[:, 2]])
    position_w = np.empty((steps + 1, 3))
    position_w[0, :2] = com_w[:2]
    position_w[1:, :2] = com_w[:2] + np.cumsum((velocity_w[1:, :2] + velocity_w[:-1, :2]) * (dt / 2), axis=0)
    position_w[:, 2] = com_height + deviation[:, 2]
    return BodyReference(
        rpy=np.column_stack([deviation[:, :2], yaw]),
        com_w=position_w,
        omega_w=np.column_stack([turned(rate[:, :2], yaw), np.full(steps + 1, yaw_rate)]),
        velocity_w=velocity_w,
    )
