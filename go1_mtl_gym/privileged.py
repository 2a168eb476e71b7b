"""What an expert is told where it may know more than a robot can: what is different, and what is still to come."""

from dataclasses import replace

from go1_mtl_gym.episode import Episode
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.sensors import robot_state
from go1_mtl_gym.sim.simulation import Simulation


def privileged_state(simulation: Simulation, episode: Episode, period: int) -> RobotState:
    """The state in which an action that is chosen now will take effect, and how the robot differs from its model.

    Neither the simulation nor the episode is changed, not by a bit.

    Args:
        simulation: of the robot.
        episode: in which it is.
        period: physics steps per control period.
    """
    delay_steps = simulation.physics_params.delay_steps
    later, then = simulation.ahead(), episode.ahead(delay_steps, period)
    resistance, damping = simulation.joint_resistance
    return replace(
        robot_state(later, then.task.gait, then.phase, then.filtered_command, then.time_s),
        payload_kg=simulation.physics_params.payload_kg,
        motor_strength=simulation.physics_params.motor_strength,
        friction=simulation.physics_params.friction,
        joint_friction=resistance,
        joint_damping=damping,
        foot_sink=simulation.foot_sink,
    )
