"""Where the feet will stand: the Raibert heuristic, applied to every coming stance of the horizon."""

from dataclasses import dataclass

import numpy as np

from experts.compilation import compiled
from experts.planning.plane import to_complex
from go1_mtl_gym import robot
from go1_mtl_gym.gaits import Gait
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.validation import number_in


@dataclass(frozen=True)
class FootholdRule:
    """p = hip(touchdown) + v_hip T_stance / 2 + gain (v - v_ref), after Raibert, "Legged robots that balance" (1986).

    Attributes:
        velocity_gain: feedback of the velocity error [s].
        reach: largest horizontal distance between a foothold and the point under its hip [m].

    Raises:
        InvalidInputError: if a number is outside its range.
    """

    velocity_gain: float = 0.03
    reach: float = 0.34

    def __post_init__(self) -> None:
        number_in(self.velocity_gain, -0.1, 1.0, "velocity_gain [s]")
        number_in(self.reach, 0.02, 0.4, "reach [m]")

    def plan(self, state: RobotState, com_w: np.ndarray, velocity_w: np.ndarray, touchdown_s: np.ndarray) -> np.ndarray:
        """Footholds of touchdowns at given times from now.

        The body is taken to go on with its present velocity until the touchdown and to turn at the commanded rate.

        Args:
            state: the robot now.
            com_w: its centre of mass, world [m], shape (3,).
            velocity_w: its horizontal velocity without the gait's sway, world [m/s], shape (2,).
            touchdown_s: time until each touchdown [s], shape (..., 4).

        Returns:
            Centres of the feet on the ground, world [m], shape (..., 4, 3).
        """
        points = _plan(
            to_complex(com_w),
            to_complex(velocity_w),
            state.rpy[2],
            state.command,
            state.gait.nominal_feet_b,
            state.gait.stance_s / 2,
            (float(self.velocity_gain), float(self.reach), robot.FOOT_RADIUS),
            touchdown_s.reshape(-1, 4),
        )
        return points.reshape(*touchdown_s.shape, 3)

    def over_horizon(
        self, state: RobotState, com_w: np.ndarray, velocity_w: np.ndarray, feet_w: np.ndarray, middle: np.ndarray
    ) -> np.ndarray:
        """Where each foot pushes from during each interval of the horizon; meaningless while it is in the air.

        Feet on the ground now stay where they are until they lift off; later stances stand on planned footholds.

        Args:
            state: the robot now.
            com_w: its centre of mass, world [m], shape (3,).
            velocity_w: as in `plan` [m/s], shape (2,).
            feet_w: centres of the feet now, world [m], shape (4, 3).
            middle: the clock in the middle of each interval, not wrapped [cycles], shape (N,).

        Returns:
            World [m], shape (N, 4, 3).
        """
        if state.standing:
            return np.broadcast_to(feet_w, (len(middle), 4, 3))
        touchdown_s = next_touchdown(state.gait, state.phase, middle)
        planned = self.plan(state, com_w, velocity_w, touchdown_s)
        return np.where((touchdown_s <= 0.0)[..., None], feet_w, planned)


def next_touchdown(gait: Gait, phase: float, later: np.ndarray) -> np.ndarray:
    """Time from `phase` until the touchdown that begins the leg cycle running at clocks `later` [s], shape (N, 4)."""
    offsets = np.array(gait.offsets)
    return (np.floor(later[:, None] + offsets) - offsets - phase) * gait.period


@compiled
def _plan(
    com: complex,
    velocity: complex,
    yaw: float,
    command: np.ndarray,
    feet_b: np.ndarray,
    half_stance_s: np.ndarray,
    rule: tuple[float, float, float],
    touchdown_s: np.ndarray,
) -> np.ndarray:
    """`FootholdRule.plan` in complex numbers, x + iy. `rule`: gain [s], reach and foot radius [m]."""
    gain, reach, radius = rule
    heading = np.exp(1j * yaw)
    commanded = (command[0] + 1j * command[1]) * heading
    points = np.empty((len(touchdown_s), 4, 3))
    for i in range(len(touchdown_s)):
        for leg in range(4):
            time = touchdown_s[i, leg]
            # From the centre of mass to the hip when the foot touches down: the body turns on meanwhile.
            arm = (feet_b[leg, 0] + 1j * feet_b[leg, 1]) * heading * np.exp(1j * command[2] * time)
            # i yaw_rate arm is what turning adds to the hip's velocity.
            step = (velocity + 1j * command[2] * arm) * half_stance_s[leg] + gain * (velocity - commanded)
            step *= min(1.0, reach / max(abs(step), 1e-9))
            point = com + velocity * time + arm + step
            points[i, leg, 0], points[i, leg, 1], points[i, leg, 2] = point.real, point.imag, radius
    return points
