"""The MPC's prediction model: a single rigid body pushed by four feet, linearized along a trajectory.

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
from numba import njit

from go1_mtl_gym import robot

FORCE_UNIT = robot.MASS * robot.GRAVITY / 2
"""One unit of the MPC's inputs [N]."""
RPY, COM, OMEGA, VELOCITY = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
"""Where the parts of a state stand."""
_PER_MASS = FORCE_UNIT / robot.MASS


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


def linearize(
    states: np.ndarray, inputs: np.ndarray, feet_w: np.ndarray, inertia_b: np.ndarray, dt: float
) -> LinearModel:
    """Equations (5)-(7) along a trajectory.

    Args:
        states: x at the N + 1 ends of the intervals, shape (N + 1, 12); an interval is linearized in its middle.
        inputs: u during the intervals, shape (N, 12).
        feet_w: where the feet push from, world [m], shape (N, 4, 3).
        inertia_b: composite inertia about the centre of mass, trunk axes [kg m^2], shape (3, 3).
        dt: interval [s].
    """
    middle = (states[:-1] + states[1:]) / 2
    return LinearModel(*_linearize(middle, inputs * FORCE_UNIT, feet_w, inertia_b, np.linalg.inv(inertia_b), dt))


@njit(cache=True)
def _cross(r, out, scale):
    out[0, 0] = out[1, 1] = out[2, 2] = 0.0
    out[0, 1], out[0, 2], out[1, 2] = -r[2] * scale, r[1] * scale, -r[0] * scale
    out[1, 0], out[2, 0], out[2, 1] = r[2] * scale, -r[1] * scale, r[0] * scale


@njit(cache=True)
def _rotation(rpy, R):
    cr, cp, cy = np.cos(rpy[0]), np.cos(rpy[1]), np.cos(rpy[2])
    sr, sp, sy = np.sin(rpy[0]), np.sin(rpy[1]), np.sin(rpy[2])
    R[0, 0], R[0, 1], R[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    R[1, 0], R[1, 1], R[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    R[2, 0], R[2, 1], R[2, 2] = -sp, cp * sr, cp * cr


@njit(cache=True)
def _euler_rates(rpy, omega, E, W):
    """E and W of equations (1) and (5)."""
    cos, sin, tan, sec = np.cos(rpy[2]), np.sin(rpy[2]), np.tan(rpy[1]), 1 / np.cos(rpy[1])
    E[0, 0], E[0, 1], E[0, 2] = cos * sec, sin * sec, 0.0
    E[1, 0], E[1, 1], E[1, 2] = -sin, cos, 0.0
    E[2, 0], E[2, 1], E[2, 2] = cos * tan, sin * tan, 1.0
    forward, side = cos * omega[0] + sin * omega[1], cos * omega[1] - sin * omega[0]
    W[:, 0] = 0.0
    W[0, 1], W[0, 2] = forward * tan * sec, side * sec
    W[1, 1], W[1, 2] = 0.0, -forward
    W[2, 1], W[2, 2] = forward * sec * sec, side * tan


@njit(cache=True)
def _congruent(R, inner, out):
    """out = R inner R'."""
    for i in range(3):
        for j in range(3):
            out[i, j] = 0.0
            for a in range(3):
                for b in range(3):
                    out[i, j] += R[i, a] * inner[a, b] * R[j, b]


@njit(cache=True)
def _linearize(x, forces, feet_w, inertia_b, inverse_b, dt):
    """`linearize` at states x with forces in N; compiled, without temporary arrays inside the loop."""
    steps, half = len(x), dt * dt / 2
    A, B, c = np.zeros((steps, 12, 12)), np.zeros((steps, 12, 12)), np.zeros((steps, 12))
    R, E, W, K, G = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    inertia, inverse, moment, total = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 19)), np.empty(3)
    rows, discrete, momentum = np.zeros((6, 22)), np.empty((6, 22)), np.empty(3)
    for k in range(steps):
        rpy, com, omega = x[k, 0:3], x[k, 3:6], x[k, 6:9]
        _rotation(rpy, R)
        _euler_rates(rpy, omega, E, W)
        _congruent(R, inertia_b, inertia)
        _congruent(R, inverse_b, inverse)
        for i in range(3):
            momentum[i] = inertia[i, 0] * omega[0] + inertia[i, 1] * omega[1] + inertia[i, 2] * omega[2]
            total[i] = forces[k, i] + forces[k, 3 + i] + forces[k, 6 + i] + forces[k, 9 + i]

        # I domega/dt: columns [omega | p | u | constant], then times I^-1.
        _cross(total, moment[:, 3:6], 1.0)
        for leg in range(4):
            _cross(feet_w[k, leg] - com, moment[:, 6 + 3 * leg : 9 + 3 * leg], FORCE_UNIT)
        _cross(momentum, G, 1.0)
        _cross(omega, K, 1.0)
        for i in range(3):
            moment[i, 18] = 0.0
            for j in range(3):
                moment[i, j] = G[i, j] - (K[i, 0] * inertia[0, j] + K[i, 1] * inertia[1, j] + K[i, 2] * inertia[2, j])
                moment[i, 18] -= K[i, j] * momentum[j]

        # Rows [rpy, omega] of the continuous model; columns [rpy, omega | p | u | c].
        for i in range(3):
            for j in range(3):
                rows[i, j], rows[i, 3 + j] = W[i, j], E[i, j]
            rows[i, 21] = -(W[i, 0] * rpy[0] + W[i, 1] * rpy[1] + W[i, 2] * rpy[2])
            for j in range(19):
                rows[3 + i, 3 + j] = (
                    inverse[i, 0] * moment[0, j] + inverse[i, 1] * moment[1, j] + inverse[i, 2] * moment[2, j]
                )
            for j in range(3):
                rows[3 + i, 21] -= rows[3 + i, 3 + j] * omega[j] + rows[3 + i, 6 + j] * com[j]

        for i in range(6):
            for j in range(22):
                value = rows[i, j] * dt
                for l in range(6):
                    value += rows[i, l] * rows[l, j] * half
                discrete[i, j] = value
        for i in range(3):
            for j in range(3):
                A[k, i, j], A[k, i, 3 + j], A[k, i, 6 + j] = discrete[i, j], discrete[i, 6 + j], discrete[i, 3 + j]
                A[k, 6 + i, j], A[k, 6 + i, 6 + j] = discrete[3 + i, j], discrete[3 + i, 3 + j]
                A[k, 6 + i, 3 + j], A[k, 6 + i, 9 + j] = discrete[3 + i, 6 + j], rows[3 + i, 6 + j] * half
            for j in range(12):
                B[k, i, j], B[k, 6 + i, j] = discrete[i, 9 + j], discrete[3 + i, 9 + j]
            for leg in range(4):
                B[k, 3 + i, 3 * leg + i], B[k, 9 + i, 3 * leg + i] = _PER_MASS * half, _PER_MASS * dt
            A[k, 3 + i, 9 + i] = dt
            c[k, i], c[k, 6 + i] = discrete[i, 21], discrete[3 + i, 21]
        for i in range(12):
            A[k, i, i] += 1.0
        c[k, 5], c[k, 11] = -robot.GRAVITY * half, -robot.GRAVITY * dt
    return A, B, c
