"""Where the feet will stand: the Raibert heuristic, applied to every coming stance of the horizon."""

from dataclasses import dataclass

import numpy as np

from experts.planar import carried, turned
from go1_mtl_gym import robot
from go1_mtl_gym.state import RobotState


@dataclass(frozen=True)
class FootholdRule:
    """p = hip(touchdown) + v_hip T_stance / 2 + gain (v - v_ref), after Raibert, "Legged robots that balance" (1986).

    Attributes:
        velocity_gain: feedback of the velocity error [s].
        reach: largest horizontal distance between a foothold and the point under its hip [m].
    """

    velocity_gain: float = 0.10
    reach: float = 0.22

    def plan(
        self, state: RobotState, com_w: np.ndarray, com_velocity_w: np.ndarray, touchdown_s: np.ndarray
    ) -> np.ndarray:
        """Footholds of touchdowns at given times from now.

        The body is taken to go on with its present velocity until the touchdown and to turn at the commanded rate.

        Args:
            state: the robot now.
            com_w: its centre of mass, world [m], shape (3,).
            com_velocity_w: world [m/s], shape (3,).
            touchdown_s: time until each touchdown [s], shape (..., 4).

        Returns:
            Centres of the feet on the ground, world [m], shape (..., 4, 3).
        """
        stance_s = state.gait.stance_s
        vx, vy, yaw_rate = state.command
        yaw = state.rpy[2]
        velocity_ref = turned(np.array([vx, vy]), yaw)
        arm = turned(robot.NOMINAL_FOOT_B[:, :2], yaw + yaw_rate * touchdown_s)
        hip_velocity = velocity_ref + carried(arm, yaw_rate)
        step = hip_velocity * (stance_s / 2) + self.velocity_gain * (com_velocity_w[:2] - velocity_ref)
        step *= np.minimum(1.0, self.reach / np.maximum(np.linalg.norm(step, axis=-1, keepdims=True), 1e-9))
        feet = np.full((*touchdown_s.shape, 3), robot.FOOT_RADIUS)
        feet[..., :2] = com_w[:2] + com_velocity_w[:2] * touchdown_s[..., None] + arm + step
        return feet

    def over_horizon(
        self,
        state: RobotState,
        com_w: np.ndarray,
        com_velocity_w: np.ndarray,
        feet_w: np.ndarray,
        dt: float,
        steps: int,
    ) -> np.ndarray:
        """Where each foot pushes from during each interval of the horizon; meaningless while it is in the air.

        Feet on the ground now stay where they are until they lift off; later stances stand on planned footholds.

        Returns:
            World [m], shape (steps, 4, 3).
        """
        gait = state.gait
        middle = state.phase + (np.arange(steps) + 0.5) * (dt / gait.period)
        started = np.floor(middle[:, None] + np.array(gait.offsets))
        touchdown_s = (started - np.array(gait.offsets) - state.phase) * gait.period
        planned = self.plan(state, com_w, com_velocity_w, touchdown_s)
        present = (touchdown_s <= 0.0)[..., None]
        return np.where(present, feet_w, planned)
