"""The joint actuators: a PD law, its inverse, and the map between actions and joint targets."""

from dataclasses import dataclass

import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.validation import Limits, check_numbers

PHYSICS_HZ = 1000
"""Rate of the physics, and with it of the actuators [Hz]."""
_ALLOWED = {"kp": Limits(5.0, 500.0, " [N m/rad]"), "kd": Limits(0.0, 20.0, " [N m s/rad]")}


@dataclass(frozen=True)
class PDGains:
    """Gains of tau = kp (a - q) - kd v, the same for all joints and all tasks.

    Attributes:
        kp: stiffness [N m/rad].
        kd: damping [N m s/rad].

    Raises:
        InvalidInputError: if kp is outside [5, 500] or kd outside [0, 20].
    """

    kp: float = 50.0
    kd: float = 2.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_numbers(self, _ALLOWED)

    def torque(self, target: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Torque before the limits [N m], shape (12,): tau = kp (a - q) - kd v."""
        return self.kp * (target - q) - self.kd * v

    def target(self, tau: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The joint target that yields a torque [rad], shape (12,): a = q + (tau + kd v)/kp (arXiv 2505.08574)."""
        return q + (tau + self.kd * v) / self.kp


@dataclass(frozen=True)
class ActionMap:
    """Affine map between actions in [-1, 1] and joint targets in radians: target = center + half_range * action.

    Action 0 asks for the standing robot's `robot.HOME_POSE`. The map reaches every target that a torque within the
    limits can need, at every joint position and speed within theirs: the joint range [lower, upper], widened by
    (tau_max + kd v_max)/kp on both sides. As it is symmetric about the home pose, it reaches beyond one of the two:
    half_range = max(upper + margin - home, home - lower + margin), joint by joint.

    Attributes:
        center: shape (12,) [rad], read-only.
        half_range: shape (12,) [rad], read-only.
    """

    center: np.ndarray
    half_range: np.ndarray

    def __post_init__(self) -> None:
        """Keep read-only copies."""
        for name in ("center", "half_range"):
            values = np.array(getattr(self, name), dtype=np.float64)
            values.flags.writeable = False
            object.__setattr__(self, name, values)

    @classmethod
    def for_gains(cls, gains: PDGains) -> "ActionMap":
        """The map that belongs to one pair of gains."""
        low, high = _needed_targets(gains)
        return cls(center=robot.HOME_POSE, half_range=np.maximum(high - robot.HOME_POSE, robot.HOME_POSE - low))

    @classmethod
    def of_version_0_1(cls, gains: PDGains) -> "ActionMap":
        """The map of version 0.1, which is centered on the middle of the targets that are needed: a deep crouch."""
        low, high = _needed_targets(gains)
        return cls(center=(low + high) / 2, half_range=(high - low) / 2)

    def to_radians(self, action: np.ndarray) -> np.ndarray:
        """Joint targets [rad] of actions, shape (..., 12)."""
        return self.center + self.half_range * action

    def from_radians(self, target: np.ndarray) -> np.ndarray:
        """Actions of joint targets [rad], shape (..., 12), clipped to [-1, 1]."""
        return np.clip((target - self.center) / self.half_range, -1.0, 1.0)


def _needed_targets(gains: PDGains) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest joint target [rad] that a torque within the limits can need, shape (12,) each.

    From a = q + (tau + kd v)/kp with q, tau and v at the ends of their ranges.
    """
    margin = (robot.TORQUE_LIMIT + gains.kd * robot.SPEED_LIMIT) / gains.kp
    return robot.JOINT_LOWER - margin, robot.JOINT_UPPER + margin
