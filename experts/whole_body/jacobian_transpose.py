"""Joint torques the simple way: the transpose of the Jacobian in stance, one leg at a time in swing.

The usual form of small quadrupeds (G. Bledt et al., "MIT Cheetah 3", IROS 2018, equations 3 and 4): the ground force of
a foot acts through massless legs, and a swinging leg is driven as if its hip stood still.
`experts.whole_body.inverse_dynamics` uses the full dynamics instead.
"""

import numpy as np

from experts.robot_model import Dynamics
from experts.whole_body.request import Request, within_limits

_LEGS = np.arange(12).reshape(4, 3)
_ROWS, _COLUMNS = _LEGS[:, :, None], _LEGS[:, None, :]  # the four blocks of a matrix over joints, shape (4, 3, 3)


def jacobian_transpose_torques(
    dynamics: Dynamics, forces_w: np.ndarray, stance: np.ndarray, swing_acceleration_w: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Torques of legs that do not feel each other.

    With J_i, M_i, h_i the blocks of leg i in the Jacobian of its foot, the mass matrix and the bias,

        tau_i = h_i - J_i' f_i  on the ground,    tau_i = h_i + M_i J_i^-1 (a_i - Jdot_i v)  in the air.

    The arguments are those of `Request.of`.

    Returns:
        Joint torques [N m], shape (12,), clipped at the torque limits, and the joint accelerations [rad/s^2], shape
        (12,), that belong to the feet's accelerations (-10 v_foot on the ground) while the base does not accelerate.
    """
    request = Request.of(dynamics, forces_w, stance, swing_acceleration_w)
    jacobian = dynamics.jacobian[_ROWS, 6 + _COLUMNS]
    mass = dynamics.mass_matrix[6 + _ROWS, 6 + _COLUMNS]
    target = request.foot_target[..., None]
    try:
        acceleration = np.linalg.solve(jacobian, target)
    except np.linalg.LinAlgError:  # a leg stretched to the singular point
        acceleration = np.linalg.pinv(jacobian) @ target
    push = jacobian.transpose(0, 2, 1) @ request.force_w.reshape(4, 3, 1)
    effort = np.where(stance[:, None, None], -push, mass @ acceleration)
    return within_limits(dynamics.bias[6:] + effort.ravel()), acceleration.ravel()
