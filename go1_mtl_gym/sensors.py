"""What there is to see at one instant: the true state, and what the sensors say. Pure: nothing here remembers."""

from collections.abc import Container, Mapping

import numpy as np

from go1_mtl_gym.gaits import Gait
from go1_mtl_gym.kinematics import leg_kinematics
from go1_mtl_gym.sensing.gait_numbers import gait_numbers
from go1_mtl_gym.sensing.observation import PROPRIOCEPTION, SensorNoise
from go1_mtl_gym.sensing.sensor_faults import Reading
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.sim.simulation import Simulation


def robot_state(simulation: Simulation, gait: Gait, phase: float, command: np.ndarray, time_s: float) -> RobotState:
    """The true state, now; nothing in it is shared with the simulation or the caller.

    Args:
        simulation: of the robot.
        gait: that is asked for.
        phase: of the gait clock [cycles].
        command: filtered (vx [m/s], vy [m/s], yaw rate [rad/s]), shape (3,).
        time_s: since the reset [s].
    """
    data = simulation.data
    return RobotState(
        position_w=data.qpos[:3].copy(),
        quat_wxyz=data.qpos[3:7].copy(),
        linear_velocity_w=data.qvel[:3].copy(),
        angular_velocity_b=data.qvel[3:6].copy(),
        q=simulation.q,
        v=simulation.v,
        contacts=simulation.contacts,
        gait=gait,
        phase=phase,
        command=command.copy(),
        time_s=time_s,
    )


def measure(
    reading: Reading,
    state: RobotState,
    last_action: np.ndarray,
    noise: SensorNoise | None,
    rng: np.random.Generator,
    channels: Container[str],
    control_s: float,
) -> dict[str, np.ndarray]:
    """Every part of an observation by name, now; finite even if the physics diverged.

    Args:
        reading: that arrives from the sensors now.
        state: of the robot, now.
        last_action: the action applied during the last step, shape (12,).
        noise: of the sensors, or None.
        rng: that the noise is drawn from.
        channels: that are shown; what costs time and is not among them is left out. Noise is drawn for all others, so
            that it is the same whichever are shown.
        control_s: the control period [s].
    """
    turn = 2 * np.pi * state.phase
    parts = {
        "accelerometer": reading.accelerometer,
        "gyroscope": reading.gyroscope,
        "q": reading.q,
        "dq": reading.dq,
        "contacts": reading.contacts,
        "command": state.command,
        "gravity": reading.gravity,
        "phase": np.array([np.sin(turn), np.cos(turn)]),
        "last_action": last_action,
    }
    if noise is not None:
        noise.apply(parts, rng)
    if "leg_kinematics" in channels:
        parts["leg_kinematics"] = leg_kinematics(parts["q"], parts["dq"], parts["gyroscope"])
    if "gait" in channels:
        parts["gait"] = gait_numbers(state.gait, state.phase, state.standing, control_s)
    if np.isfinite(sum(float(part.sum()) for part in parts.values())):
        return parts
    return {name: np.nan_to_num(part) for name, part in parts.items()}


def frame(parts: Mapping[str, np.ndarray]) -> np.ndarray:
    """The proprioceptive parts of an instant in a row, shape (34,); what a history consists of."""
    return np.concatenate([parts[name] for name in PROPRIOCEPTION])
