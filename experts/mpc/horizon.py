"""One problem of the MPC from a state: reference, contacts, feet and nominal forces over one gait cycle."""

from typing import NamedTuple

import numpy as np

from experts.mpc.frame import Frame
from experts.mpc.srbd import FORCE_UNIT
from experts.planning.body_reference import body_reference
from experts.planning.footholds import FootholdRule
from experts.planning.nominal_motion import NominalMotion
from experts.planning.plane import to_complex_array, turn
from experts.robot_model import Dynamics, whole_body_attitude
from go1_mtl_gym import robot
from go1_mtl_gym.sensing.state import RobotState


class Horizon(NamedTuple):
    """What the rigid body starts from, is to follow, and pushes with; everything in `frame`.

    Attributes:
        frame: below the centre of mass, facing where the robot does, so that the problem is the same wherever it is.
        dt: interval [s].
        x0: state of the whole robot now, shape (12,).
        reference: states at the N + 1 ends of the intervals, shape (N + 1, 12).
        nominal: inputs that carry the weight along the reference, in units of `FORCE_UNIT`, shape (N, 12).
        contact: fractions of each interval that the feet spend on the ground, shape (N, 4).
        feet: where they push from [m], shape (N, 4, 3).
        inertia_b: composite inertia, trunk axes [kg m^2], shape (3, 3).
        mass: of the whole robot [kg].
        friction: coefficient of friction of the ground, if the expert is told of it.
    """

    frame: Frame
    dt: float
    x0: np.ndarray
    reference: np.ndarray
    nominal: np.ndarray
    contact: np.ndarray
    feet: np.ndarray
    inertia_b: np.ndarray
    mass: float
    friction: float | None


def pose_horizon(
    state: RobotState,
    dynamics: Dynamics,
    motion: NominalMotion,
    velocity_w: np.ndarray,
    footholds: FootholdRule,
    com_height: float,
    steps: int,
) -> Horizon:
    """The problem of one state.

    Args:
        state: the robot now.
        dynamics: at the state.
        motion: nominal, of the state's gait or of standing.
        velocity_w: horizontal velocity of the body without its sway, world [m/s], shape (2,).
        footholds: where the feet will land.
        com_height: mean height of the centre of mass [m].
        steps: N.
    """
    gait = state.gait
    dt = gait.period / steps
    roll, pitch, yaw = whole_body_attitude(state, dynamics)
    frame = Frame(dynamics.com_w, yaw)
    # In that frame the robot stands at the origin and faces along x, by construction.
    com = np.array([0.0, 0.0, dynamics.com_w[2]])
    reference = body_reference(state, 0.0, com, motion, com_height, dt, steps)
    middle = state.phase + (np.arange(steps) + 0.5) / steps
    feet_w = footholds.over_horizon(state, dynamics.com_w, velocity_w, dynamics.feet_w, middle)
    # The rigid body is the whole robot, so it turns at the mean rate of trunk and legs, not at the trunk's.
    turning, moving = frame.vectors(np.stack([dynamics.mean_omega_w, dynamics.com_velocity_w]))
    return Horizon(
        frame=frame,
        dt=dt,
        x0=np.concatenate([(roll, pitch, 0.0), com, turning, moving]),
        reference=reference,
        nominal=_nominal_inputs(motion, middle, reference, dynamics.mass),
        contact=np.ones((steps, 4)) if state.standing else gait.contact_schedule(state.phase, dt, steps),
        feet=frame.points(feet_w),
        inertia_b=state.rotation.T @ dynamics.inertia_w @ state.rotation,
        mass=dynamics.mass,
        friction=state.friction,
    )


def _nominal_inputs(motion: NominalMotion, phase: np.ndarray, reference: np.ndarray, mass: float) -> np.ndarray:
    """The nominal motion's forces at phases of the intervals, turned with the reference's yaw, shape (N, 12)."""
    nominal = motion.force_at(phase) * (mass * robot.GRAVITY / FORCE_UNIT)
    sideways = to_complex_array(nominal) * turn(reference[:-1, 2:3])
    nominal[..., 0], nominal[..., 1] = sideways.real, sideways.imag
    return nominal.reshape(len(phase), 12)
