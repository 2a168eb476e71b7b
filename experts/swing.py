"""Swing feet: accelerations that carry a foot along a nominal arc, as a function of the present state alone."""

from dataclasses import dataclass

import numpy as np

from experts.footholds import FootholdRule
from experts.model import Dynamics
from experts.planar import carried, to_complex
from go1_mtl_gym import robot
from go1_mtl_gym.state import RobotState


@dataclass(frozen=True)
class SwingRule:
    """PD tracking of a nominal swing.

    Horizontally the foot moves, relative to where it will land, from one step length behind to zero along a cubic;
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
    press: float = 0.006
    early: float = 0.15

    def acceleration(
        self, state: RobotState, ahead_s: float, dynamics: Dynamics, velocity_w: np.ndarray, footholds: FootholdRule
    ) -> np.ndarray:
        """Accelerations of all feet as if they were in swing, for a moment that is a little ahead.

        The feedback acts on where the foot will be then, h later, if it accelerates so:
        a = a_arc + k (p_arc - p - v h - a h^2/2) + d (v_arc - v - a h), solved for a.

        Args:
            state: the robot now.
            ahead_s: h, half of the time for which the answer is held [s].
            dynamics: at the state.
            velocity_w: horizontal velocity of the body, as in `FootholdRule.plan` [m/s], shape (2,).
            footholds: where the feet are to land.

        Returns:
            World [m/s^2], shape (4, 3).
        """
        gait = state.gait
        progress = gait.swing_progress(state.phase + ahead_s / gait.period)
        s = np.minimum(progress / (1.0 - self.early), 1.0)
        remaining = (1.0 - progress) * gait.swing_s + ahead_s
        landing = footholds.plan(state, dynamics.com_w, velocity_w, remaining)
        arm = to_complex(landing - dynamics.com_w)
        stride = (to_complex(velocity_w) + carried(arm, state.command[2])) * gait.period

        left, rate, curvature = cubic(s)
        height, climb, bend = hump(s)
        time = gait.swing_s * (1.0 - self.early)
        position, velocity, forward = landing, np.empty((4, 3)), np.empty((4, 3))
        for axis, along in ((0, stride.real), (1, stride.imag)):
            position[:, axis] -= left * along
            velocity[:, axis] = -rate * along / time
            forward[:, axis] = -curvature * along / time**2
        position[:, 2] = robot.FOOT_RADIUS + gait.swing_height * height - self.press * s**2
        velocity[:, 2] = (gait.swing_height * climb - 2 * self.press * s) / time
        forward[:, 2] = (gait.swing_height * bend - 2 * self.press) / time**2
        down = progress >= 1.0 - self.early
        velocity[down, 2], forward[down] = 0.0, 0.0
        foot, foot_velocity = dynamics.feet_w, dynamics.feet_velocity_w
        wanted = (
            forward
            + self.stiffness * (position - foot - foot_velocity * ahead_s)
            + self.damping * (velocity - foot_velocity)
        )
        return wanted / (1.0 + self.damping * ahead_s + self.stiffness * ahead_s**2 / 2)


def cubic(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """1 - (3 s^2 - 2 s^3) and its first and second derivatives."""
    return 1 - s * s * (3 - 2 * s), -6 * s * (1 - s), -6 * (1 - 2 * s)


def hump(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """16 s^2 (1 - s)^2 and its first and second derivatives."""
    return 16 * s**2 * (1 - s) ** 2, 32 * s * (1 - s) * (1 - 2 * s), 32 * (1 - 6 * s + 6 * s**2)
