"""What the three ways from forces to torques are asked for, and what they have in common."""

from typing import NamedTuple

import numpy as np

from experts.robot_model import Dynamics
from go1_mtl_gym import robot

STANCE_DAMPING = 10.0
"""A foot on the ground is asked to decelerate at this rate [1/s]."""


class Request(NamedTuple):
    """Ground forces for the feet that stand and accelerations for all feet.

    Attributes:
        dynamics: at the present state.
        stance: feet on the ground, bool, shape (4,).
        force_w: of the ground on the feet, world [N], shape (12,); zero in the air.
        generalized_force: J' f, what these forces do to base and joints, shape (18,).
        foot_acceleration_w: world [m/s^2], shape (4, 3); -10 v_foot on the ground.
    """

    dynamics: Dynamics
    stance: np.ndarray
    force_w: np.ndarray
    generalized_force: np.ndarray
    foot_acceleration_w: np.ndarray

    @classmethod
    def of(
        cls, dynamics: Dynamics, forces_w: np.ndarray, stance: np.ndarray, swing_acceleration_w: np.ndarray
    ) -> "Request":
        """From what the planners say.

        Args:
            dynamics: at the present state.
            forces_w: of the ground on the feet, world [N], shape (4, 3); used only where `stance` is True.
            stance: feet on the ground, bool, shape (4,).
            swing_acceleration_w: world [m/s^2], shape (4, 3); used only where `stance` is False.
        """
        on_ground = stance[:, None]
        force = np.where(on_ground, forces_w, 0.0).ravel()
        foot = np.where(on_ground, -STANCE_DAMPING * dynamics.feet_velocity_w, swing_acceleration_w)
        return cls(dynamics, stance, force, dynamics.jacobian.T @ force, foot)

    @property
    def foot_target(self) -> np.ndarray:
        """What J vdot should be, a_foot - Jdot v [m/s^2], shape (4, 3)."""
        return self.foot_acceleration_w - self.dynamics.drift


def within_limits(torque: np.ndarray) -> np.ndarray:
    """Joint torques [N m], shape (12,), clipped at the robot's limits."""
    return np.clip(torque, -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT)
