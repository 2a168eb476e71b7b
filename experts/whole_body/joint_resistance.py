"""What joints do against their motors: the torque to be added so that a robot moves as its model would."""

import numpy as np

from go1_mtl_gym.sensing.state import RobotState

REVERSAL = 0.5
"""Speed within which the compensation of dry friction changes its sign [rad/s]; a jump would make joints chatter."""


def joint_resistance(state: RobotState, v: np.ndarray) -> np.ndarray:
    """Torque against friction and damping that the state tells of [N m], shape (12,).

    tau = tau_f tanh(v / REVERSAL) + d v, with the dry friction tau_f and the damping d that the robot has beyond its
    model; zero for a state that tells of none.

    Args:
        state: of the robot.
        v: joint velocities that the torque is for [rad/s], shape (12,).
    """
    return state.joint_friction * np.tanh(v / REVERSAL) + state.joint_damping * v
