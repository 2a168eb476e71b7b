"""The MPC's prediction model: a single rigid body pushed by four feet, linearized along a trajectory.

State x = [rpy, p, omega, v] (attitude as roll-pitch-yaw, centre of mass, angular velocity, velocity; world frame) and
input u = the four ground forces in the world, in units of half the unloaded robot's weight. The nonlinear model is

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
The affine model dx/dt = A x + B u + c that agrees with (1)-(4) at (x', u') is discretized to second order:

    (7)  A_d = 1 + A dt + A^2 dt^2/2,  B_d = B dt + A B dt^2/2,  c_d = c dt + A c dt^2/2.
"""

from dataclasses import dataclass

import numpy as np

from experts.compilation import compiled, inlined
from go1_mtl_gym import robot

FORCE_UNIT = robot.MASS * robot.GRAVITY / 2
"""One unit of the MPC's inputs [N]."""
RPY, COM, OMEGA, VELOCITY = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
"""Where the parts of a state stand."""

# Columns of the rows of `_linearize_turning`: (1) and (3) depend on every part of the state but the velocity.
_RPY, _OMEGA, _COM, _FORCE, _ONE = 0, 3, 6, 9, 21
_WIDTH = _ONE + 1
_TURNING = 6  # those rows themselves: d(rpy)/dt, d(omega)/dt


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
    states: np.ndarray,
    inputs: np.ndarray,
    feet_w: np.ndarray,
    inertia_b: np.ndarray,
    dt: float,
    mass: float | None = None,
) -> LinearModel:
    """Equations (5)-(7) along a trajectory.

    Args:
        states: x at the N + 1 ends of the intervals, shape (N + 1, 12); an interval is linearized in its middle.
        inputs: u during the intervals, shape (N, 12).
        feet_w: where the feet push from, world [m], shape (N, 4, 3).
        inertia_b: composite inertia about the centre of mass, trunk axes [kg m^2], shape (3, 3).
        dt: interval [s].
        mass: of the body [kg]; None for the unloaded robot's.
    """
    middle = (states[:-1] + states[1:]) / 2
    inverse_b = np.linalg.inv(inertia_b)
    constants = FORCE_UNIT, robot.MASS if mass is None else mass, robot.GRAVITY
    return LinearModel(*_linearize(middle, inputs * FORCE_UNIT, feet_w, inertia_b, inverse_b, dt, constants))


@compiled
def _linearize(
    x: np.ndarray,
    forces: np.ndarray,
    feet_w: np.ndarray,
    inertia_b: np.ndarray,
    inverse_b: np.ndarray,
    dt: float,
    constants: tuple[float, float, float],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`linearize` at states x with forces in N. `constants`: unit of the inputs [N], mass [kg], gravity [m/s^2]."""
    force_unit, mass, gravity = constants
    steps = len(x)
    A, B, c = np.zeros((steps, 12, 12)), np.zeros((steps, 12, 12)), np.zeros((steps, 12))
    # Scratch, written again at each point: making arrays anew would take as long as filling them.
    R, E, W = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    inertia, inverse, moment = np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, _WIDTH))
    rows, discrete = np.zeros((_TURNING, _WIDTH)), np.empty((_TURNING, _WIDTH))
    for k in range(steps):
        _rotation(x[k], R)
        _congruent(R, inertia_b, inertia)
        _congruent(R, inverse_b, inverse)
        _euler_rates(x[k], E, W)
        _linearize_rpy(x[k], E, W, rows)
        _differentiate_moment(x[k], forces[k], feet_w[k], inertia, force_unit, moment)
        _linearize_omega(x[k], inverse, moment, rows)
        _discretize(rows, dt, discrete)
        _write_turning(rows, discrete, dt, A[k], B[k], c[k])
        _write_moving(dt, force_unit / mass, gravity, A[k], B[k], c[k])
    return A, B, c


@inlined
def _rotation(x: np.ndarray, R: np.ndarray) -> None:
    """Write R = Rz(yaw) Ry(pitch) Rx(roll), body to world."""
    cr, cp, cy = np.cos(x[0]), np.cos(x[1]), np.cos(x[2])
    sr, sp, sy = np.sin(x[0]), np.sin(x[1]), np.sin(x[2])
    R[0, 0], R[0, 1], R[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    R[1, 0], R[1, 1], R[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    R[2, 0], R[2, 1], R[2, 2] = -sp, cp * sr, cp * cr


@inlined
def _congruent(R: np.ndarray, inner: np.ndarray, out: np.ndarray) -> None:
    """Write R inner R'."""
    for i in range(3):
        for j in range(3):
            out[i, j] = 0.0
            for a in range(3):
                for b in range(3):
                    out[i, j] += R[i, a] * inner[a, b] * R[j, b]


@inlined
def _euler_rates(x: np.ndarray, E: np.ndarray, W: np.ndarray) -> None:
    """Write E and W of equations (1) and (5)."""
    cos, sin, tan, sec = np.cos(x[2]), np.sin(x[2]), np.tan(x[1]), 1 / np.cos(x[1])
    E[0, 0], E[0, 1], E[0, 2] = cos * sec, sin * sec, 0.0
    E[1, 0], E[1, 1], E[1, 2] = -sin, cos, 0.0
    E[2, 0], E[2, 1], E[2, 2] = cos * tan, sin * tan, 1.0
    # omega along the heading and to its left. Roll does not enter, so W's first column is zero.
    forward, side = cos * x[6] + sin * x[7], cos * x[7] - sin * x[6]
    W[0, 0] = W[1, 0] = W[2, 0] = 0.0
    W[0, 1], W[0, 2] = forward * tan * sec, side * sec
    W[1, 1], W[1, 2] = 0.0, -forward
    W[2, 1], W[2, 2] = forward * sec * sec, side * tan


@inlined
def _linearize_rpy(x: np.ndarray, E: np.ndarray, W: np.ndarray, rows: np.ndarray) -> None:
    """Rows of (1): by (5), with the constant that makes them agree at the point.

    E omega is linear in omega, so what is left of E' omega' is -W rpy'.
    """
    for i in range(3):
        for j in range(3):
            rows[i, _RPY + j], rows[i, _OMEGA + j] = W[i, j], E[i, j]
        rows[i, _ONE] = -(W[i, 0] * x[0] + W[i, 1] * x[1] + W[i, 2] * x[2])


@inlined
def _differentiate_moment(
    x: np.ndarray, forces: np.ndarray, feet_w: np.ndarray, inertia: np.ndarray, force_unit: float, moment: np.ndarray
) -> None:
    """Right sides of (6), and the part of the moment in (3) that no force makes, -omega x I omega.

    Written to the columns that they have in the rows.
    """
    _cross(_total(forces, 0), _total(forces, 1), _total(forces, 2), moment, _COM)
    for leg in range(4):
        x_arm, y_arm, z_arm = feet_w[leg, 0] - x[3], feet_w[leg, 1] - x[4], feet_w[leg, 2] - x[5]
        _cross(x_arm * force_unit, y_arm * force_unit, z_arm * force_unit, moment, _FORCE + 3 * leg)
    momentum = _momentum(inertia, x, 0), _momentum(inertia, x, 1), _momentum(inertia, x, 2)
    # [I omega'] - [omega'] I, column by column of I, and -omega' x I omega', with omega' = (p, q, r).
    p, q, r = x[6], x[7], x[8]
    _cross(momentum[0], momentum[1], momentum[2], moment, _OMEGA)
    for j in range(3):
        moment[0, _OMEGA + j] -= q * inertia[2, j] - r * inertia[1, j]
        moment[1, _OMEGA + j] -= r * inertia[0, j] - p * inertia[2, j]
        moment[2, _OMEGA + j] -= p * inertia[1, j] - q * inertia[0, j]
    moment[0, _ONE] = r * momentum[1] - q * momentum[2]
    moment[1, _ONE] = p * momentum[2] - r * momentum[0]
    moment[2, _ONE] = q * momentum[0] - p * momentum[1]


@inlined
def _total(forces: np.ndarray, axis: int) -> float:
    """One component of F, the sum of the four forces."""
    total: float = forces[axis] + forces[3 + axis] + forces[6 + axis] + forces[9 + axis]
    return total


@inlined
def _momentum(inertia: np.ndarray, x: np.ndarray, axis: int) -> float:
    """One component of I omega."""
    momentum: float = inertia[axis, 0] * x[6] + inertia[axis, 1] * x[7] + inertia[axis, 2] * x[8]
    return momentum


@inlined
def _cross(x: float, y: float, z: float, out: np.ndarray, column: int) -> None:
    """Write [a] of a = (x, y, z), with [a] b = a x b, to three columns of `out`."""
    out[0, column], out[0, column + 1], out[0, column + 2] = 0.0, -z, y
    out[1, column], out[1, column + 1], out[1, column + 2] = z, 0.0, -x
    out[2, column], out[2, column + 1], out[2, column + 2] = -y, x, 0.0


@inlined
def _linearize_omega(x: np.ndarray, inverse: np.ndarray, moment: np.ndarray, rows: np.ndarray) -> None:
    """Rows of (3): I^-1 times (6), with the constant that makes them agree at the point.

    The moment is linear in the forces, so of it is left what no force makes, less the Jacobians times omega' and p'.
    """
    for i in range(3):
        row = 3 + i
        for j in range(_OMEGA, _WIDTH):
            rows[row, j] = inverse[i, 0] * moment[0, j] + inverse[i, 1] * moment[1, j] + inverse[i, 2] * moment[2, j]
        for j in range(3):
            rows[row, _ONE] -= rows[row, _OMEGA + j] * x[6 + j] + rows[row, _COM + j] * x[3 + j]


@inlined
def _discretize(rows: np.ndarray, dt: float, discrete: np.ndarray) -> None:
    """Equation (7) for the rows of (1) and (3), but for the identity and for what goes through the velocity.

    The first six columns of the rows are the part of A that leads from these six states to their rates.
    """
    half = dt * dt / 2
    for i in range(_TURNING):
        for j in range(_WIDTH):
            value = rows[i, j] * dt
            for l in range(_TURNING):
                value += rows[i, l] * rows[l, j] * half
            discrete[i, j] = value


@inlined
def _write_turning(
    rows: np.ndarray, discrete: np.ndarray, dt: float, A: np.ndarray, B: np.ndarray, c: np.ndarray
) -> None:
    """Put the rows of rpy and omega into the order of the state, and add the identity."""
    half = dt * dt / 2
    for i in range(3):
        turning = 6 + i
        for j in range(3):
            A[i, j], A[i, 3 + j], A[i, 6 + j] = discrete[i, _RPY + j], discrete[i, _COM + j], discrete[i, _OMEGA + j]
            A[turning, j], A[turning, 6 + j] = discrete[3 + i, _RPY + j], discrete[3 + i, _OMEGA + j]
            # The moment depends on p, and dp/dt is v: the one entry of A^2 that leads from v to omega.
            A[turning, 3 + j], A[turning, 9 + j] = discrete[3 + i, _COM + j], rows[3 + i, _COM + j] * half
        for j in range(12):
            B[i, j], B[turning, j] = discrete[i, _FORCE + j], discrete[3 + i, _FORCE + j]
        c[i], c[turning] = discrete[i, _ONE], discrete[3 + i, _ONE]
        A[i, i] += 1.0
        A[turning, turning] += 1.0


@inlined
def _write_moving(dt: float, per_mass: float, gravity: float, A: np.ndarray, B: np.ndarray, c: np.ndarray) -> None:
    """Equation (7) for (2) and (4), which are linear: a body that is thrown, and pushed by each foot alike."""
    half = dt * dt / 2
    for i in range(3):
        place, moving = 3 + i, 9 + i
        A[place, place] = A[moving, moving] = 1.0
        A[place, moving] = dt
        for leg in range(4):
            B[place, 3 * leg + i], B[moving, 3 * leg + i] = per_mass * half, per_mass * dt
    c[5], c[11] = -gravity * half, -gravity * dt
