"""Ways in which a real robot differs from the model that its expert has in mind: mass, motors, contacts, delay."""

from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PHYSICS_HZ
from go1_mtl_gym.validation import Limits, check_numbers

if TYPE_CHECKING:
    import mujoco

INERTIAL_ARRAYS = ("body_mass", "body_inertia", "dof_armature")
"""Those arrays of a model after whose change `mj_setConst` is due."""
CHANGED_ARRAYS = (
    *INERTIAL_ARRAYS,
    "geom_friction",
    "geom_solref",
    "dof_frictionloss",
    "dof_damping",
    "actuator_gainprm",
    "actuator_biasprm",
    "actuator_forcerange",
)
"""The arrays of a model that `PhysicsParams.apply` writes to."""
_NONE = -1.0
LIMITS = {
    "friction": Limits(0.05, 2.0),
    "payload_kg": Limits(0.0, 10.0, " [kg]"),
    "action_delay_s": Limits(0.0, 0.05, " [s]"),
    "motor_strength": Limits(0.5, 1.5),
    "joint_friction": Limits(0.0, 5.0, " [N m]"),
    "rotor_inertia": Limits(0.0, 0.1, " [kg m^2]"),
    "contact_time_s": Limits(0.002, 0.2, " [s]"),
    "joint_damping": Limits(0.0, 3.0, " [N m s/rad]"),
}
"""What each figure of `PhysicsParams` may be."""


@dataclass(frozen=True)
class PhysicsParams:
    """What is different about the physics; the defaults change nothing. The expert of a privileged environment knows.

    Attributes:
        friction: coefficient of sliding friction between robot and ground, or None for the model's own.
        payload_kg: mass of a cube fixed at the trunk's centre of mass [kg].
        action_delay_s: time after which a joint target takes effect [s], rounded to milliseconds.
        motor_strength: factor on the actuators' torques and on their limits.
        joint_friction: dry friction of every joint [N m], or None for the model's own.
        rotor_inertia: of every motor, as its joint feels it [kg m^2], or None for the model's own.
        contact_time_s: time constant of the contacts of the feet [s], small is stiff; None for the model's own.
        joint_damping: torque per speed that brakes every joint [N m s/rad], or None for the model's own.

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    friction: float | None = None
    payload_kg: float = 0.0
    action_delay_s: float = 0.0
    motor_strength: float = 1.0
    joint_friction: float | None = None
    rotor_inertia: float | None = None
    contact_time_s: float | None = None
    joint_damping: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_numbers(self, LIMITS)

    @property
    def delay_steps(self) -> int:
        """The delay in physics steps."""
        return round(self.action_delay_s * PHYSICS_HZ)

    def as_vector(self) -> np.ndarray:
        """All figures in their order, shape (8,); None is -1."""
        return np.array([_NONE if value is None else value for value in astuple(self)], dtype=np.float64)

    @classmethod
    def from_vector(cls, vector: np.ndarray) -> "PhysicsParams":
        """The inverse of `as_vector`."""
        values: list[Any] = [None if value == _NONE else value for value in vector.tolist()]
        return cls(*values)

    def apply(self, model: "mujoco.MjModel") -> None:
        """Change a model whose PD gains are set already; `mj_setConst` is left to the caller.

        A contact takes the friction of the geom of higher priority, and the larger one of two equals: only if all
        geoms have one coefficient is it the contact's. The feet have the higher priority, so that the time constant
        of theirs is the contact's on any floor. A cube of mass m and side s has the inertia m s^2 / 6 about every axis
        through its centre. The first six degrees of freedom are the trunk's.
        """
        if self.friction is not None:
            model.geom_friction[:, 0] = self.friction
        trunk = model.body("trunk").id
        model.body_mass[trunk] += self.payload_kg
        model.body_inertia[trunk] += self.payload_kg * robot.PAYLOAD_SIDE**2 / 6
        for array in (model.actuator_gainprm, model.actuator_biasprm, model.actuator_forcerange):
            array *= self.motor_strength
        if self.joint_friction is not None:
            model.dof_frictionloss[6:] = self.joint_friction
        if self.rotor_inertia is not None:
            model.dof_armature[6:] = self.rotor_inertia
        if self.joint_damping is not None:
            model.dof_damping[6:] = self.joint_damping
        if self.contact_time_s is not None:
            model.geom_solref[[model.geom(f"{leg}_foot").id for leg in robot.LEGS], 0] = self.contact_time_s


class ActionDelay:
    """Joint targets on their way to the actuators, one per physics step.

    Args:
        steps: the delay in physics steps.

    Attributes:
        waiting: the targets of the coming physics steps [rad], soonest first, shape (steps, 12).
    """

    def __init__(self, steps: int) -> None:
        """Let nothing be on its way but zeros."""
        self.waiting = np.zeros((steps, 12))

    def reset(self, target: np.ndarray) -> None:
        """Let nothing but one target [rad], shape (12,), be on its way."""
        self.waiting[:] = target

    def send(self, target: np.ndarray, physics_steps: int) -> list[tuple[np.ndarray, int]]:
        """Command a target [rad], shape (12,), for some physics steps.

        Returns:
            What the actuators hold meanwhile: targets, and for how many physics steps each.
        """
        if not len(self.waiting):
            return [(target, physics_steps)]
        line = np.vstack([self.waiting, np.tile(target, (physics_steps, 1))])
        now, self.waiting = np.split(line, [physics_steps])
        return _runs(now)

    def pending(self) -> list[tuple[np.ndarray, int]]:
        """What the actuators will hold until a target that is commanded now takes effect, as of `send`."""
        return _runs(self.waiting) if len(self.waiting) else []


def _runs(line: np.ndarray) -> list[tuple[np.ndarray, int]]:
    """Equal neighbors among targets, shape (steps, 12), together: each target, and how often it stands there."""
    starts = np.r_[0, 1 + np.flatnonzero((np.diff(line, axis=0) != 0).any(axis=1)), len(line)]
    return [(line[start], int(end - start)) for start, end in zip(starts[:-1], starts[1:])]
