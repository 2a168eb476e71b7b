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
        self,
        state: RobotState,
        ahead_s: np.ndarray,
        dynamics: Dynamics,
        velocity_w: np.ndarray,
        footholds: FootholdRule,
    ) -> np.ndarray:
        """Accelerations of all feet as if they were in swing, for a moment that is a little ahead.

        The feedback acts on where the foot will be then, h later, if it accelerates so:
        a = a_arc + k (p_arc - p - v h - a h^2/2) + d (v_arc - v - a h), solved for a.

        Args:
            state: the robot now.
            ahead_s: h, time until the middle of what the answer is held for [s], shape (4,).
            dynamics: at the state.
            velocity_w: horizontal velocity of the body, as in `FootholdRule.plan` [m/s], shape (2,).
            footholds: where the feet are to land.

        Returns:
            World [m/s^2], shape (4, 3).
        """
        gait = state.gait
        leg = (gait.leg_phase(state.phase) + ahead_s / gait.period) % 1.0
        progress = np.maximum(leg - gait.duty, 0.0) / (1.0 - gait.duty)
        s = np.minimum(progress / (1.0 - self.early), 1.0)
        time = gait.swing_s * (1.0 - self.early)
        remaining = (1.0 - progress) * gait.swing_s + ahead_s
        landing = to_complex(footholds.plan(state, dynamics.com_w, velocity_w, remaining))
        arm = landing - to_complex(dynamics.com_w)
        stride = (to_complex(velocity_w) + carried(arm, state.command[2])) * gait.period

        left, rate, curvature = cubic(s)
        height, climb, bend = hump(s)
        position = _spatial(landing - left * stride, gait.swing_height * height - self.press * s * s)
        velocity = _spatial(rate * stride / -time, (gait.swing_height * climb - 2 * self.press * s) / time)
        forward = _spatial(curvature * stride / -(time**2), (gait.swing_height * bend - 2 * self.press) / time**2)
        position[:, 2] += robot.FOOT_RADIUS
        down = progress >= 1.0 - self.early
        velocity[down, 2], forward[down] = 0.0, 0.0
        foot, foot_velocity = dynamics.feet_w, dynamics.feet_velocity_w
        h = ahead_s[:, None]
        wanted = (
            forward
            + self.stiffness * (position - foot - foot_velocity * h)
            + self.damping * (velocity - foot_velocity)
        )
        return wanted / (1.0 + self.damping * h + self.stiffness * h**2 / 2)


def _spatial(planar: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(x, y, z) of complex x + iy and z, shape (4, 3)."""
    return np.stack([planar.real, planar.imag, z], axis=1)


def cubic(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """1 - (3 s^2 - 2 s^3) and its first and second derivatives."""
    return 1 - s * s * (3 - 2 * s), -6 * s * (1 - s), -6 * (1 - 2 * s)


def hump(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """16 s^2 (1 - s)^2 and its first and second derivatives."""
    return 16 * s**2 * (1 - s) ** 2, 32 * s * (1 - s) * (1 - 2 * s), 32 * (1 - 6 * s + 6 * s**2)
