"""Joint torques the simple way: the transpose of the Jacobian in stance, one leg at a time in swing.

The usual form of small quadrupeds (G. Bledt et al., "MIT Cheetah 3", IROS 2018, equations 3 and 4): the ground force of
a foot acts through massless legs, and a swinging leg is driven as if its hip stood still.
`experts.whole_body.inverse_dynamics` uses the full dynamics instead.
"""

import numpy as np

from experts.robot_model import Dynamics
from experts.whole_body.inverse_dynamics import STANCE_DAMPING
from go1_mtl_gym import robot


def jacobian_transpose_torques(
    dynamics: Dynamics, forces_w: np.ndarray, stance: np.ndarray, swing_acceleration_w: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Torques of legs that do not feel each other.

    With J_i, M_i, h_i the blocks of leg i in the Jacobian of its foot, the mass matrix and the bias,

        tau_i = h_i - J_i' f_i  on the ground,    tau_i = h_i + M_i J_i^-1 (a_i - Jdot_i v)  in the air.

    Args:
        dynamics: at the present state.
        forces_w: of the ground on the feet, world [N], shape (4, 3); used only where `stance` is True.
        stance: feet on the ground, bool, shape (4,).
        swing_acceleration_w: world [m/s^2], shape (4, 3); used only where `stance` is False.

    Returns:
        Joint torques [N m], shape (12,), clipped at the torque limits, and the joint accelerations [rad/s^2], shape
        (12,), that belong to the feet's accelerations (-10 v_foot on the ground) while the base does not accelerate.
    """
    legs = np.arange(12).reshape(4, 3)
    jacobian = dynamics.jacobian[legs[:, :, None], 6 + legs[:, None, :]]
    mass = dynamics.mass_matrix[6 + legs[:, :, None], 6 + legs[:, None, :]]
    foot = np.where(stance[:, None], -STANCE_DAMPING * dynamics.feet_velocity_w, swing_acceleration_w)
    target = (foot - dynamics.drift)[..., None]
    try:
        acceleration = np.linalg.solve(jacobian, target)
    except np.linalg.LinAlgError:  # a leg stretched to the singular point
        acceleration = np.linalg.pinv(jacobian) @ target
    push = jacobian.transpose(0, 2, 1) @ np.where(stance[:, None], forces_w, 0.0)[..., None]
    effort = np.where(stance[:, None, None], -push, mass @ acceleration)
    torque = dynamics.bias[6:] + effort.ravel()
    return np.clip(torque, -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT), acceleration.ravel()
