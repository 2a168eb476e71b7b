"""The MPC's prediction model: a single rigid body pushed by four feet, linearised along a reference.

State x = [rpy, p, omega, v] (attitude as roll-pitch-yaw, centre of mass, angular velocity, velocity; world frame) and
input u = the four ground forces in the world, in units of half the robot's weight. The nonlinear model is

    (1)  d(rpy)/dt = E(rpy) omega          (2)  dp/dt = v
    (3)  I domega/dt = sum_i (r_i - p) x f_i (4)  m dv/dt = sum_i f_i + m g

with the composite inertia I in world axes (J. Di Carlo et al., IROS 2018, which neglects omega x I omega as (3) does).
Linearised about (x_ref, f_ref), with F the total of f_ref and [F] its cross-product matrix,

    (5)  I domega/dt = sum_i (r_i - p_ref) x f_i + [F] (p - p_ref).

Discretised to second order: A_d = 1 + A dt + A^2 dt^2/2, B_d = B dt + A B dt^2/2, c_d = c dt + A c dt^2/2.
"""

from dataclasses import dataclass

import numpy as np

from experts.reference import BodyReference
from go1_mtl_gym import robot

FORCE_UNIT = robot.MASS * robot.GRAVITY / 2
"""One unit of the MPC's inputs [N]."""


@dataclass(frozen=True)
class LinearModel:
    """x[k+1] = A[k] x[k] + B[k] u[k] + c[k].

    Attributes:
        A: shape (N, 12, 12).
        B: shape (N, 12, 12), per unit of `FORCE_UNIT`.
        c: shape (N, 12).
    """

    A: np.ndarray
    B: np.ndarray
    c: np.ndarray


def euler_rate_matrix(rpy: np.ndarray) -> np.ndarray:
    """E of equation (1), shape (..., 3, 3), from roll, pitch, yaw [rad] of shape (..., 3)."""
    pitch, yaw = rpy[..., 1], rpy[..., 2]
    cos, sin, tan = np.cos(yaw), np.sin(yaw), np.tan(pitch)
    sec = 1 / np.cos(pitch)
    E = np.zeros((*rpy.shape[:-1], 3, 3))
    E[..., 0, 0], E[..., 0, 1] = cos * sec, sin * sec
    E[..., 1, 0], E[..., 1, 1] = -sin, cos
    E[..., 2, 0], E[..., 2, 1], E[..., 2, 2] = cos * tan, sin * tan, 1.0
    return E


def cross_matrix(r: np.ndarray) -> np.ndarray:
    """[r] with [r] f = r x f, shape (..., 3, 3)."""
    out = np.zeros((*r.shape, 3))
    x, y, z = r[..., 0], r[..., 1], r[..., 2]
    out[..., 0, 1], out[..., 0, 2] = -z, y
    out[..., 1, 0], out[..., 1, 2] = z, -x
    out[..., 2, 0], out[..., 2, 1] = -y, x
    return out


def linearise(
    reference: BodyReference, feet_w: np.ndarray, nominal_force: np.ndarray, inertia_w: np.ndarray, dt: float
) -> LinearModel:
    """The model of equations (1)-(5) along a reference.

    Args:
        reference: N + 1 points.
        feet_w: where the feet push from, world [m], shape (N, 4, 3).
        nominal_force: vertical force of each foot [N], shape (N, 4); sets F of equation (5).
        inertia_w: composite inertia now, world axes [kg m^2], shape (3, 3); it is turned with the reference's yaw.
        dt: interval [s].
    """
    steps = len(feet_w)
    rpy = (reference.rpy[:-1] + reference.rpy[1:]) / 2
    com_w = (reference.com_w[:-1] + reference.com_w[1:]) / 2
    turn = _yaw_rotation(rpy[:, 2] - reference.rpy[0, 2])
    inverse_inertia = turn @ np.linalg.inv(inertia_w) @ turn.transpose(0, 2, 1)
    total = np.zeros((steps, 3))
    total[:, 2] = nominal_force.sum(axis=1)

    A = np.zeros((steps, 12, 12))
    A[:, 0:3, 6:9] = euler_rate_matrix(rpy)
    A[:, 3:6, 9:12] = np.eye(3)
    A[:, 6:9, 3:6] = inverse_inertia @ cross_matrix(total)
    arm = cross_matrix(feet_w - com_w[:, None])  # (N, 4, 3, 3)
    B = np.zeros((steps, 12, 12))
    B[:, 6:9] = (inverse_inertia[:, None] @ arm).transpose(0, 2, 1, 3).reshape(steps, 3, 12) * FORCE_UNIT
    B[:, 9:12] = np.tile(np.eye(3), 4) * (FORCE_UNIT / robot.MASS)
    c = np.zeros((steps, 12))
    c[:, 6:9] = -np.einsum("kij,kj->ki", A[:, 6:9, 3:6], com_w)
    c[:, 11] = -robot.GRAVITY

    half = A * (dt * dt / 2)
    return LinearModel(
        A=np.eye(12) + A * dt + half @ A,
        B=B * dt + half @ B,
        c=c * dt + np.einsum("kij,kj->ki", half, c),
    )


def _yaw_rotation(yaw: np.ndarray) -> np.ndarray:
    out = np.zeros((*yaw.shape, 3, 3))
    cos, sin = np.cos(yaw), np.sin(yaw)
    out[..., 0, 0], out[..., 0, 1], out[..., 1, 0], out[..., 1, 1] = cos, -sin, sin, cos
    out[..., 2, 2] = 1.0
    return out
