"""Where the body should be over the horizon: the command, integrated from here, plus the gait's nominal motion."""

import numpy as np

from experts.compilation import compiled
from experts.planning.nominal_motion import NominalMotion
from go1_mtl_gym.sensing.state import RobotState

COM_HEIGHT = 0.28
"""Mean height of the centre of mass [m], unless the expert's configuration says otherwise."""


def body_reference(
    state: RobotState, yaw: float, com_w: np.ndarray, motion: NominalMotion, com_height: float, dt: float, steps: int
) -> np.ndarray:
    """Integrate the command over the horizon.

    Position and yaw start from where the robot is, so the reference has no memory: the same state, phase and command
    always give the same reference. Height, sway, roll and pitch follow the nominal motion.

    Args:
        state: the robot now.
        yaw: its heading [rad].
        com_w: its centre of mass, world [m], shape (3,).
        motion: the gait's nominal motion, or that of standing.
        com_height: mean height of the centre of mass [m].
        dt: interval [s].
        steps: N.

    Returns:
        The MPC's states [rpy, com, omega, velocity] at the N + 1 ends of the intervals, world frame, shape
        (N + 1, 12); index 0 is now.
    """
    time = np.arange(steps + 1) * dt
    deviation = motion.at(state.phase + time / state.gait.period)
    return _integrate(deviation, yaw, com_w, com_height, state.command, dt)


@compiled
def _integrate(
    deviation: np.ndarray, yaw: float, com_w: np.ndarray, com_height: float, command: np.ndarray, dt: float
) -> np.ndarray:
    """`body_reference` from the nominal motion's deviations, shape (N + 1, 12)."""
    x = np.empty((len(deviation), 12))
    vx, vy, yaw_rate = command
    px, py = com_w[0], com_w[1]
    before_x, before_y = 0.0, 0.0
    for k in range(len(x)):
        angle = yaw + yaw_rate * k * dt
        cos, sin = np.cos(angle), np.sin(angle)
        going_x, going_y = cos * vx - sin * vy, sin * vx + cos * vy
        if k:
            # By trapezoids, as the commanded velocity turns with the heading.
            px, py = px + (going_x + before_x) * dt / 2, py + (going_y + before_y) * dt / 2
        before_x, before_y = going_x, going_y
        # The sway counts from the robot's place in the cycle, so that the reference begins where the robot is; height
        # and tilt are those of the cycle itself, so that they come back to it.
        d, first = deviation[k], deviation[0]
        x[k, 0], x[k, 1], x[k, 2] = d[0], d[1], angle + d[2] - first[2]
        cos_0, sin_0 = np.cos(yaw), np.sin(yaw)
        x[k, 3] = px + (cos * d[3] - sin * d[4]) - (cos_0 * first[3] - sin_0 * first[4])
        x[k, 4] = py + (sin * d[3] + cos * d[4]) - (sin_0 * first[3] + cos_0 * first[4])
        x[k, 5] = com_height + d[5]
        x[k, 6], x[k, 7], x[k, 8] = cos * d[6] - sin * d[7], sin * d[6] + cos * d[7], yaw_rate + d[8]
        x[k, 9], x[k, 10] = going_x + cos * d[9] - sin * d[10], going_y + sin * d[9] + cos * d[10]
        x[k, 11] = d[11]
    return x
