"""Where the body should be over the horizon: the command, integrated from here, plus the gait's nominal motion."""

import numpy as np

from experts.nominal import NominalMotion
from experts.planar import to_complex, turn
from go1_mtl_gym.state import RobotState


def body_reference(
    state: RobotState, com_w: np.ndarray, motion: NominalMotion, com_height: float, dt: float, steps: int
) -> np.ndarray:
    """Integrate the command over the horizon.

    Position and yaw start from where the robot is, so the reference has no memory: the same state, phase and command
    always give the same reference. Height, sway, roll and pitch follow the nominal motion.

    Args:
        state: the robot now.
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
    vx, vy, yaw_rate = state.command.tolist()
    deviation = motion.at(state.phase + time / state.gait.period)
    yaw = state.rpy[2] + yaw_rate * time
    heading = turn(yaw)
    sway, swaying, rolling = (to_complex(deviation[:, at : at + 2]) * heading for at in (3, 9, 6))
    velocity = complex(vx, vy) * heading
    position = np.empty(steps + 1, complex)
    position[0] = 0.0
    np.cumsum((velocity[1:] + velocity[:-1]) * (dt / 2), out=position[1:])
    position += to_complex(com_w) + sway - sway[0]
    velocity += swaying
    x = np.empty((steps + 1, 12))
    x[:, 0:2], x[:, 2] = deviation[:, 0:2], yaw + deviation[:, 2] - deviation[0, 2]
    x[:, 3], x[:, 4], x[:, 5] = position.real, position.imag, com_height + deviation[:, 5]
    x[:, 6], x[:, 7], x[:, 8] = rolling.real, rolling.imag, yaw_rate + deviation[:, 8]
    x[:, 9], x[:, 10], x[:, 11] = velocity.real, velocity.imag, deviation[:, 11]
    return x
