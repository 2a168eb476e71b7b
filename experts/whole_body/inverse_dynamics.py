"""From ground forces and swing accelerations to joint torques, through the full rigid-body dynamics."""

import numpy as np

from experts.robot_model import Dynamics
from go1_mtl_gym import robot

STANCE_DAMPING = 10.0
"""A foot on the ground is asked to decelerate at this rate [1/s]."""


def joint_torques(
    dynamics: Dynamics, forces_w: np.ndarray, stance: np.ndarray, swing_acceleration_w: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Torques that realise forces of the feet on the ground and accelerations of the feet in the air.

    With M, h, J of `Dynamics` the accelerations solve one 18 x 18 system, the base's equations of motion above and the
    feet's accelerations below,

        [M_base; J] vdot = [J_base' f - h_base; a_foot - Jdot v],    tau = (M vdot + h - J' f) of the joints,

    with a_foot = -10 v_foot on the ground.

    Args:
        dynamics: at the present state.
        forces_w: of the ground on the feet, world [N], shape (4, 3); used only where `stance` is True.
        stance: feet on the ground, bool, shape (4,).
        swing_acceleration_w: world [m/s^2], shape (4, 3); used only where `stance` is False.

    Returns:
        Joint torques [N m], shape (12,), clipped at the torque limits, and the joint accelerations [rad/s^2], shape
        (12,), that they were computed for.
    """
    force = np.where(stance[:, None], forces_w, 0.0).ravel()
    foot = np.where(stance[:, None], -STANCE_DAMPING * dynamics.feet_velocity_w, swing_acceleration_w)
    generalised = dynamics.jacobian.T @ force
    system = np.vstack([dynamics.mass_matrix[:6], dynamics.jacobian])
    target = np.concatenate([generalised[:6] - dynamics.bias[:6], (foot - dynamics.drift).ravel()])
    try:
        acceleration = np.linalg.solve(system, target)
    except np.linalg.LinAlgError:  # a leg stretched to the singular point
        acceleration = np.linalg.lstsq(system, target, rcond=None)[0]
    torque = (dynamics.mass_matrix @ acceleration + dynamics.bias - generalised)[6:]
    return np.clip(torque, -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT), acceleration[6:]
