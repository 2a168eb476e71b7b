"""Swing feet: accelerations that carry a foot along a nominal arc, as a function of the present state alone."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from experts.compilation import compiled, inlined
from experts.planning.footholds import FootholdRule
from experts.planning.plane import to_complex
from experts.robot_model import Dynamics
from go1_mtl_gym import robot
from go1_mtl_gym.sensing.state import RobotState


@dataclass(frozen=True)
class SwingRule:
    """PD tracking of a nominal swing.

    Horizontally the foot moves, relative to where it will land, from one step length behind to zero along a cubic;
    vertically along 16 h s^2 (1 - s)^2, where h is the gait's swing height and as much again as feet sink into soft
    ground. No lift-off position is remembered: a foot that was pushed elsewhere is drawn back to the nominal arc.

    Attributes:
        stiffness: [1/s^2].
        damping: [1/s].
        press: how far below the ground the touchdown is aimed, so that contact is certain [m].
        early: fraction of the swing, at its end, for which the foot is down already and waits, so that it is not thrown
            at the ground when its stance begins.
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
        # In stance the swing to come counts as just begun: the answer is not used, but must be finite.
        progress = np.maximum(leg - gait.duties, 0.0) / (1.0 - gait.duties)
        remaining = (1.0 - progress) * gait.swing_s + ahead_s
        landing = footholds.plan(state, dynamics.com_w, velocity_w, remaining)
        arc = gait.swing_height + state.foot_sink, self.press, self.early, gait.period, robot.FOOT_RADIUS
        return _track(
            progress,
            ahead_s,
            landing,
            dynamics.feet_w,
            dynamics.feet_velocity_w,
            to_complex(dynamics.com_w),
            to_complex(velocity_w),
            float(state.command[2]),
            gait.swing_s,
            tuple(map(float, arc)),
            (float(self.stiffness), float(self.damping)),
        )


def cubic(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """1 - (3 s^2 - 2 s^3) and its first and second derivatives."""
    return 1 - s * s * (3 - 2 * s), -6 * s * (1 - s), -6 * (1 - 2 * s)


def hump(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """16 s^2 (1 - s)^2 and its first and second derivatives."""
    return 16 * s**2 * (1 - s) ** 2, 32 * s * (1 - s) * (1 - 2 * s), 32 * (1 - 6 * s + 6 * s**2)


_cubic: Any = inlined(cubic)
_hump: Any = inlined(hump)


@compiled
def _track(
    progress: np.ndarray,
    ahead_s: np.ndarray,
    landing: np.ndarray,
    feet: np.ndarray,
    feet_velocity: np.ndarray,
    com: complex,
    velocity: complex,
    yaw_rate: float,
    swing_s: np.ndarray,
    arc: tuple[float, ...],
    gains: tuple[float, float],
) -> np.ndarray:
    """`SwingRule.acceleration` for known landing points.

    Args:
        progress: fraction of each leg's swing that is over, shape (4,).
        ahead_s: h of `SwingRule.acceleration` [s], shape (4,).
        landing: where the feet are to land, world [m], shape (4, 3).
        feet: where they are, world [m], shape (4, 3).
        feet_velocity: world [m/s], shape (4, 3).
        com: of the robot, horizontal, x + iy [m].
        velocity: of the body, horizontal, x + iy [m/s].
        yaw_rate: commanded [rad/s].
        swing_s: time of each leg in the air per cycle [s], shape (4,).
        arc: height, press [m], early, period [s], foot radius [m].
        gains: stiffness [1/s^2], damping [1/s].

    Returns:
        World [m/s^2], shape (4, 3).
    """
    height, press, early, period, radius = arc
    stiffness, damping = gains
    acceleration = np.empty((4, 3))
    for leg in range(4):
        time = swing_s[leg] * (1.0 - early)
        s = min(progress[leg] / (1.0 - early), 1.0)
        down = progress[leg] >= 1.0 - early
        left, rate, curvature = _cubic(s)
        lift, climb, bend = _hump(s)
        # The body carries the landing point along; a stride is how far in one period.
        arm = landing[leg, 0] + 1j * landing[leg, 1] - com
        stride = (velocity + 1j * yaw_rate * arm) * period
        h = ahead_s[leg]
        for axis in range(3):
            if axis == 2:
                position = radius + height * lift - press * s * s
                speed, forward = (height * climb - 2 * press * s) / time, (height * bend - 2 * press) / time**2
                if down:
                    speed = 0.0
            else:
                along = stride.real if axis == 0 else stride.imag
                position = landing[leg, axis] - left * along
                speed, forward = -rate * along / time, -curvature * along / time**2
            if down:
                forward = 0.0
            here, going = feet[leg, axis], feet_velocity[leg, axis]
            # The implicit law of `SwingRule.acceleration`: a (1 + d h + k h^2/2) = this.
            pull = forward + stiffness * (position - here - going * h) + damping * (speed - going)
            acceleration[leg, axis] = pull / (1.0 + damping * h + stiffness * h * h / 2)
    return acceleration
