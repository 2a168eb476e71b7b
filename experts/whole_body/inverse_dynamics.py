"""From ground forces and swing accelerations to joint torques, through the full rigid-body dynamics.

With M, h, J of `Dynamics` the accelerations solve one 18 x 18 system, the base's equations of motion above and the
feet's accelerations below,

    (1)  [M_base; J] vdot = [J_base' f - h_base; a_foot - Jdot v],
    (2)  tau = (M vdot + h - J' f) of the joints,

with a_foot = -10 v_foot on the ground. (Hybrid dynamics: accelerations are given for
the feet and forces for the base; R. Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter 9.)
"""

import numpy as np

from experts.robot_model import Dynamics
from experts.whole_body.request import Request, within_limits


def joint_torques(
    dynamics: Dynamics, forces_w: np.ndarray, stance: np.ndarray, swing_acceleration_w: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Torques that realize forces of the feet on the ground and accelerations of the feet in the air.

    The arguments are those of `Request.of`.

    Returns:
        Joint torques [N m], shape (12,), clipped at the torque limits, and the joint accelerations [rad/s^2], shape
        (12,), that they were computed for.
    """
    request = Request.of(dynamics, forces_w, stance, swing_acceleration_w)
    system, target = equations(request)
    try:
        acceleration = np.linalg.solve(system, target)
    except np.linalg.LinAlgError:  # a leg stretched to the singular point
        acceleration = np.linalg.lstsq(system, target, rcond=None)[0]
    return within_limits(required_torque(request, acceleration)), acceleration[6:]


def equations(request: Request) -> tuple[np.ndarray, np.ndarray]:
    """Equation (1): matrix, shape (18, 18), and right side, shape (18,)."""
    dynamics = request.dynamics
    system = np.vstack([dynamics.mass_matrix[:6], dynamics.jacobian])
    on_base = request.generalized_force[:6] - dynamics.bias[:6]
    return system, np.concatenate([on_base, request.foot_target.ravel()])


def required_torque(request: Request, acceleration: np.ndarray) -> np.ndarray:
    """Equation (2): joint torques before the limits [N m], shape (12,), of accelerations vdot, shape (18,)."""
    dynamics = request.dynamics
    return (dynamics.mass_matrix @ acceleration + dynamics.bias - request.generalized_force)[6:]
