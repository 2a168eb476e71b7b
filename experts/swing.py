"""Swing feet: accelerations that carry a foot along a nominal arc, as a function of the present state alone."""

from dataclasses import dataclass

import numpy as np

from experts.footholds import FootholdRule
from experts.model import Dynamics
from experts.planar import carried
from go1_mtl_gym import robot
from go1_mtl_gym.state import RobotState


@dataclass(frozen=True)
class SwingRule:
    """PD tracking of a nominal swing.

    Horizontally the foot moves, relative to where it will land, from one step length behind to zero along a quintic;
    vertically along 16 h s^2 (1 - s)^2. No lift-off position is remembered: a foot that was pushed elsewhere is drawn
    back to the nominal arc.

    Attributes:
        stiffness: [1/s^2].
        damping: [1/s].
        press: how far below the ground the touchdown is aimed, so that contact is certain [m].
        early: share of the swing, at its end, for which the foot is down already and waits, so that it is not thrown at
            the ground when its stance begins.
    """

    stiffness: float = 400.0
    damping: float = 40.0
    press: float = 0.003
    early: float = 0.1

    def acceleration(self, state: RobotState, dynamics: Dynamics, footholds: FootholdRule) -> np.ndarray:
        """Accelerations of all feet as if they were in swing, world [m/s^2], shape (4, 3)."""
        gait = state.gait
        progress = gait.swing_progress(state.phase)
        remaining = (1.0 - progress) * gait.swing_s
        s = np.minimum(progress / (1.0 - self.early), 1.0)
        landing = footholds.plan(state, dynamics.com_w, dynamics.com_velocity_w, remaining)
        arm = landing[:, :2] - dynamics.com_w[:2]
        stride = (dynamics.com_velocity_w[:2] + carried(arm, state.command[2])) * gait.period

        left, rate, curvature = _quintic(s)
        height, climb, bend = _hump(s)
        time = gait.swing_s * (1.0 - self.early)
        position = landing.copy()
        position[:, :2] -= left[:, None] * stride
        position[:, 2] = robot.FOOT_RADIUS + gait.swing_height * height - self.press * s**2
        velocity = np.zeros((4, 3))
        velocity[:, :2] = -rate[:, None] * stride / time
        velocity[:, 2] = (gait.swing_height * climb - 2 * self.press * s) / time
        forward = np.zeros((4, 3))
        forward[:, :2] = -curvature[:, None] * stride / time**2
        forward[:, 2] = (gait.swing_height * bend - 2 * self.press) / time**2
        down = progress >= 1.0 - self.early
        velocity[down, 2], forward[down] = 0.0, 0.0
        return (
            forward
            + self.stiffness * (position - dynamics.feet_w)
            + self.damping * (velocity - dynamics.feet_velocity_w)
        )


def _quintic(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """1 - (10 s^3 - 15 s^4 + 6 s^5) and its first and second derivatives."""
    return 1 - s**3 * (10 - 15 * s + 6 * s**2), -30 * s**2 * (1 - s) ** 2, -60 * s * (1 - s) * (1 - 2 * s)


def _hump(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """16 s^2 (1 - s)^2 and its first and second derivatives."""
    return 16 * s**2 * (1 - s) ** 2, 32 * s * (1 - s) * (1 - 2 * s), 32 * (1 - 6 * s + 6 * s**2)
