"""Ways in which a real robot differs from the model that its expert has in mind: friction, payload, delay."""

from dataclasses import dataclass

import mujoco
import numpy as np

from go1_mtl_gym.actuation import PHYSICS_HZ
from go1_mtl_gym.validation import number_in

PAYLOAD_SIDE = 0.1
"""Side of the cube that the payload is [m]."""


@dataclass(frozen=True)
class Realism:
    """What is different about the physics; the defaults change nothing. The expert is told none of it.

    Attributes:
        friction: coefficient of sliding friction between robot and ground, or None for the model's own.
        payload_kg: mass of a cube fixed at the trunk's centre of mass [kg].
        action_delay_s: time after which a joint target takes effect [s], rounded to milliseconds.

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    friction: float | None = None
    payload_kg: float = 0.0
    action_delay_s: float = 0.0

    def __post_init__(self) -> None:
        if self.friction is not None:
            number_in(self.friction, 0.05, 2.0, "friction")
        number_in(self.payload_kg, 0.0, 10.0, "payload_kg [kg]")
        number_in(self.action_delay_s, 0.0, 0.05, "action_delay_s [s]")

    @property
    def delay_steps(self) -> int:
        """The delay in physics steps."""
        return round(self.action_delay_s * PHYSICS_HZ)

    def apply(self, model: mujoco.MjModel) -> None:
        """Change friction and masses of a model.

        A contact takes the friction of the geom of higher priority, and the larger one of two equals: only if all
        geoms have one coefficient is it the contact's. A cube of mass m and side s has the inertia m s^2 / 6 about
        every axis through its centre.
        """
        if self.friction is not None:
            model.geom_friction[:, 0] = self.friction
        if self.payload_kg > 0:
            trunk = model.body("trunk").id
            model.body_mass[trunk] += self.payload_kg
            model.body_inertia[trunk] += self.payload_kg * PAYLOAD_SIDE**2 / 6
            mujoco.mj_setConst(model, mujoco.MjData(model))


class ActionDelay:
    """Joint targets on their way to the actuators, one per physics step.

    Args:
        steps: the delay in physics steps.

    Attributes:
        waiting: the targets of the coming physics steps [rad], soonest first, shape (steps, 12).
    """

    def __init__(self, steps: int) -> None:
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
        starts = np.r_[0, 1 + np.flatnonzero((np.diff(now, axis=0) != 0).any(axis=1)), physics_steps]
        return [(now[start], int(end - start)) for start, end in zip(starts[:-1], starts[1:])]
