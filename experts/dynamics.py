"""The MPC's prediction model: a single rigid body pushed by four feet, linearised along a trajectory.

State x = [rpy, p, omega, v] (attitude as roll-pitch-yaw, centre of mass, angular velocity, velocity; world frame) and
input u = the four ground forces in the world, in units of half the robot's weight. The nonlinear model is

    (1)  d(rpy)/dt = E(rpy) omega
    (2)  dp/dt = v
    (3)  I domega/dt = sum_i (r_i - p) x f_i - omega x (I omega)
    (4)  m dv/dt = sum_i f_i + m g

(Newton and Euler; J. Di Carlo et al., IROS 2018, use it without the gyroscopic term). I is the composite inertia of the
robot's present configuration, turned with the trajectory's attitude. With (x', u') a point of the trajectory and F the
total of its forces, the Jacobians that are not constant are

    (5)  d(E omega)/d(rpy) = W,  d(E omega)/d(omega) = E
    (6)  I d(domega/dt)/dp = [F],  I d(domega/dt)/d(omega) = [I omega'] - [omega'] I,  I d(domega/dt)/df_i = [r_i - p']

with [a] b = a x b. I counts as given for each interval: it is evaluated on the trajectory and not differentiated.
The affine model dx/dt = A x + B u + c that agrees with (1)-(4) at (x', u') is discretised to second order:

    (7)  A_d = 1 + A dt + A^2 dt^2/2,  B_d = B dt + A B dt^2/2,  c_d = c dt + A c dt^2/2.
"""

from dataclasses import dataclass

import numpy as np

from go1_mtl_gym import robot

FORCE_UNIT = robot.MASS * robot.GRAVITY / 2
"""One unit of the MPC's inputs [N]."""
RPY, COM, OMEGA, VELOCITY = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
"""Where the parts of a state stand."""
_SUM = np.tile(np.eye(3), 4)  # (3, 12): total of the four forces


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
    return _euler_rates(rpy, np.zeros_like(rpy))[0]


def cross_matrix(r: np.ndarray) -> np.ndarray:
    """[r] with [r] f = r x f, shape (..., 3, 3)."""
    out = np.zeros((*r.shape, 3))
    x, y, z = r[..., 0], r[..., 1], r[..., 2]
    out[..., 0, 1], out[..., 0, 2] = -z, y
    out[..., 1, 0], out[..., 1, 2] = z, -x
    out[..., 2, 0], out[..., 2, 1] = -y, x
    return out


def rotation_matrix(rpy: np.ndarray) -> np.ndarray:
    """R = Rz(yaw) Ry(pitch) Rx(roll), body to world, shape (N, 3, 3), of shape (N, 3)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy).T, np.sin(rpy).T
    out = np.empty((*rpy.shape, 3))
    out[..., 0, 0], out[..., 0, 1], out[..., 0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    out[..., 1, 0], out[..., 1, 1], out[..., 1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    out[..., 2, 0], out[..., 2, 1], out[..., 2, 2] = -sp, cp * sr, cp * cr
    return out


def linearise(
    states: np.ndarray, inputs: np.ndarray, feet_w: np.ndarray, inertia_b: np.ndarray, dt: float
) -> LinearModel:
    """Equations (5)-(7) along a trajectory.

    Args:
        states: x at the N + 1 ends of the intervals, shape (N + 1, 12); an interval is linearised in its middle.
        inputs: u during the intervals, shape (N, 12).
        feet_w: where the feet push from, world [m], shape (N, 4, 3).
        inertia_b: composite inertia about the centre of mass, trunk axes [kg m^2], shape (3, 3).
        dt: interval [s].
    """
    steps = len(inputs)
    x = (states[:-1] + states[1:]) / 2
    rpy, com, omega = x[:, RPY], x[:, COM], x[:, OMEGA]
    rotation = rotation_matrix(rpy)
    back = rotation.transpose(0, 2, 1)
    inertia, inverse = rotation @ inertia_b @ back, rotation @ np.linalg.inv(inertia_b) @ back
    spin, momentum = cross_matrix(omega), _times(inertia, omega)
    total = inputs.reshape(steps, 4, 3).sum(axis=1) * FORCE_UNIT

    # Rows [rpy, omega] of the continuous model; columns [rpy, omega | p | u | c].
    rows = np.zeros((steps, 6, 22))
    rows[:, 3:, 3:6] = cross_matrix(momentum) - spin @ inertia
    rows[:, 3:, 6:9] = cross_matrix(total)
    rows[:, 3:, 9:21] = cross_matrix(feet_w - com[:, None]).transpose(0, 2, 1, 3).reshape(steps, 3, 12) * FORCE_UNIT
    rows[:, 3:, 21] = -_times(spin, momentum)
    rows[:, 3:] = inverse @ rows[:, 3:]
    E, W = _euler_rates(rpy, omega)
    rows[:, :3, :3], rows[:, :3, 3:6] = W, E
    rows[:, :3, 21] = -_times(W, rpy)
    rows[:, 3:, 21] -= _times(rows[:, 3:, 3:9], np.hstack([omega, com]))

    half = dt * dt / 2
    discrete = (rows[:, :, :6] * half + dt * np.eye(6)) @ rows
    A, B, c = np.zeros((steps, 12, 12)), np.empty((steps, 12, 12)), np.empty((steps, 12))
    for at, own in ((RPY, discrete[:, :3]), (OMEGA, discrete[:, 3:])):
        A[:, at, RPY], A[:, at, OMEGA], A[:, at, COM] = own[..., :3], own[..., 3:6], own[..., 6:9]
        B[:, at], c[:, at] = own[..., 9:21], own[..., 21]
    A[:, OMEGA, VELOCITY] = rows[:, 3:, 6:9] * half
    A[:, COM, VELOCITY] = np.eye(3) * dt
    A.reshape(steps, 144)[:, ::13] += 1.0
    B[:, COM], c[:, COM] = _SUM * (FORCE_UNIT / robot.MASS * half), (0.0, 0.0, -robot.GRAVITY * half)
    B[:, VELOCITY], c[:, VELOCITY] = _SUM * (FORCE_UNIT / robot.MASS * dt), (0.0, 0.0, -robot.GRAVITY * dt)
    return LinearModel(A, B, c)


def _times(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return (matrices * vectors[:, None]).sum(axis=-1)


def _euler_rates(rpy: np.ndarray, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """E and W of equation (5), each of shape (..., 3, 3)."""
    pitch, yaw = rpy[..., 1], rpy[..., 2]
    cos, sin, tan = np.cos(yaw), np.sin(yaw), np.tan(pitch)
    sec = 1 / np.cos(pitch)
    E = np.zeros((*rpy.shape, 3))
    E[..., 0, 0], E[..., 0, 1] = cos * sec, sin * sec
    E[..., 1, 0], E[..., 1, 1] = -sin, cos
    E[..., 2, 0], E[..., 2, 1], E[..., 2, 2] = cos * tan, sin * tan, 1.0
    forward, side = cos * omega[..., 0] + sin * omega[..., 1], cos * omega[..., 1] - sin * omega[..., 0]
    W = np.zeros_like(E)
    W[..., 0, 1], W[..., 0, 2] = forward * tan * sec, side * sec
    W[..., 1, 2] = -forward
    W[..., 2, 1], W[..., 2, 2] = forward * sec**2, side * tan
    return E, W
