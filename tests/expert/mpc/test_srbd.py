"""The linear prediction model against finite differences of the nonlinear single rigid body, written anew here."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from experts.mpc.srbd import FORCE_UNIT, LinearModel, _cross, _euler_rates, _rotation, linearize
from go1_mtl_gym import robot

INERTIA_B = np.array([[0.127, 0.001, -0.015], [0.001, 0.394, 0.002], [-0.015, 0.002, 0.423]])
FEET = robot.NOMINAL_FOOT_B + np.array([0.3, -0.2, 0.023])
POINT = np.array([0.05, -0.1, 0.7, 0.31, -0.19, 0.28, 0.6, -1.0, 0.5, 0.4, 0.1, -0.05])
INPUT = np.array([[4.0, -9.0, 55.0], [0, 3.0, 10.0], [-5.0, 0, 20.0], [2.0, 7.0, 40.0]]).ravel() / FORCE_UNIT


def at_point(dt: float, x: np.ndarray = POINT, u: np.ndarray = INPUT) -> LinearModel:
    """The model of an interval in which the trajectory rests at one point."""
    return linearize(np.array([x, x]), u[None], FEET[None], INERTIA_B, dt)


def cross_matrix(r: np.ndarray) -> np.ndarray:
    """[r] with [r] f = r x f, shape (3, 3)."""
    out = np.empty((3, 3))
    _cross(*r, out, 0)
    return out


def rotation_matrix(rpy: np.ndarray) -> np.ndarray:
    """R = Rz(yaw) Ry(pitch) Rx(roll), body to world, shape (3, 3)."""
    out = np.empty((3, 3))
    _rotation(rpy, out)
    return out


def euler_rate_matrix(rpy: np.ndarray) -> np.ndarray:
    """E of the model's equation (1), shape (3, 3)."""
    E, W = np.empty((3, 3)), np.empty((3, 3))
    _euler_rates(np.r_[rpy, np.zeros(9)], E, W)
    return E


def rotation(rpy: np.ndarray) -> np.ndarray:
    return Rotation.from_euler("ZYX", rpy[::-1]).as_matrix()


def euler_rates(rpy: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """The rates for which Rdot = [omega] R, from the three axes about which roll, pitch and yaw turn."""
    yaw = rotation(np.array([0.0, 0.0, rpy[2]]))
    pitch = rotation(np.array([0.0, rpy[1], rpy[2]]))
    axes = np.column_stack([pitch[:, 0], yaw[:, 1], [0.0, 0.0, 1.0]])
    return np.linalg.solve(axes, omega)


def nonlinear(x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Newton and Euler; the inertia counts as given, so it is that of POINT's attitude."""
    force = u.reshape(4, 3) * FORCE_UNIT
    inertia = rotation(POINT[:3]) @ INERTIA_B @ rotation(POINT[:3]).T
    omega = x[6:9]
    moment = sum(np.cross(r - x[3:6], f) for r, f in zip(FEET, force))
    turning = np.linalg.solve(inertia, moment - np.cross(omega, inertia @ omega))
    falling = force.sum(axis=0) / robot.MASS + [0, 0, -9.81]
    return np.concatenate([euler_rates(x[:3], omega), x[9:12], turning, falling])


def jacobian(function, at: np.ndarray, step: float = 1e-6) -> np.ndarray:
    columns = [(function(at + d) - function(at - d)) / (2 * step) for d in step * np.eye(len(at))]
    return np.stack(columns, axis=1)


def continuous() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    dt = 1e-7
    model = at_point(dt)
    return (model.A[0] - np.eye(12)) / dt, model.B[0] / dt, model.c[0] / dt


def test_cross_matrix_is_the_cross_product():
    rng = np.random.default_rng(0)
    for r, f in rng.normal(size=(10, 2, 3)):
        np.testing.assert_allclose(cross_matrix(r) @ f, np.cross(r, f), atol=1e-14)


def test_rotation_matrix_is_yaw_then_pitch_then_roll():
    for rpy in np.random.default_rng(2).uniform(-3, 3, (20, 3)):
        np.testing.assert_allclose(rotation_matrix(rpy), rotation(rpy), atol=1e-14)
    quarter = rotation_matrix(np.array([0.0, 0.0, np.pi / 2]))
    np.testing.assert_allclose(quarter @ [1.0, 0, 0], [0, 1, 0], atol=1e-15)
    assert rotation_matrix(np.array([0.0, 0.1, 0.0]))[2, 0] < 0, "a positive pitch lowers the nose"


def test_euler_rates_turn_the_body_at_omega():
    """E omega must be the rate of (roll, pitch, yaw) for which Rdot = [omega] R."""
    rng, step = np.random.default_rng(1), 1e-6
    for _ in range(30):
        rpy, omega = rng.uniform([-3, -1.3, -3], [3, 1.3, 3]), rng.normal(size=3)
        rate = euler_rate_matrix(rpy) @ omega
        numeric = (rotation(rpy + step * rate) - rotation(rpy - step * rate)) / (2 * step)
        np.testing.assert_allclose(numeric, cross_matrix(omega) @ rotation(rpy), atol=1e-7)


def test_euler_rates_at_zero_attitude_are_omega():
    np.testing.assert_array_equal(euler_rate_matrix(np.zeros(3)), np.eye(3))


def test_A_and_B_are_the_jacobians_of_the_nonlinear_model():
    A, B, _ = continuous()
    np.testing.assert_allclose(A, jacobian(lambda x: nonlinear(x, INPUT), POINT), atol=1e-4)
    np.testing.assert_allclose(B, jacobian(lambda u: nonlinear(POINT, u), INPUT), atol=1e-4)
    assert np.abs(A[6:9, 3:6]).max() > 100, "the moment of the load about a displaced centre of mass matters"
    assert np.abs(A[6:9, 6:9]).max() > 0.3, "so does the gyroscopic one"
    assert np.abs(A[:3, :3]).max() > 0.3, "and the attitude in the rates of roll, pitch and yaw"


def test_the_affine_model_agrees_with_the_nonlinear_one_at_the_point():
    A, B, c = continuous()
    np.testing.assert_allclose(A @ POINT + B @ INPUT + c, nonlinear(POINT, INPUT), atol=2e-4)


def test_discretization_is_of_second_order():
    A, B, c = continuous()
    errors = []
    for dt in (0.04, 0.02, 0.01):
        model = at_point(dt)
        exact = expm(dt * np.block([[A, B, c[:, None]], [np.zeros((13, 25))]]))[:12]
        got = np.hstack([model.A[0], model.B[0], model.c[0][:, None]])
        errors.append(np.abs(got - exact).max())
    assert errors[0] > errors[1] > errors[2] > 0
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx(8.0, rel=0.2)  # the first term left out is dt^3


def test_one_step_follows_the_nonlinear_motion():
    """Integrated finely, with the inertia turning along: a hundredth of what changes during the step."""
    dt, parts = 0.02, 200
    x = POINT.copy()
    for _ in range(parts):
        k1 = nonlinear(x, INPUT)
        x = x + dt / parts * nonlinear(x + dt / parts / 2 * k1, INPUT)
    model = linearize(np.array([POINT, x]), INPUT[None], FEET[None], INERTIA_B, dt)
    predicted = model.A[0] @ POINT + model.B[0] @ INPUT + model.c[0]
    np.testing.assert_allclose(predicted - x, 0, atol=0.02 * np.abs(x - POINT).max())
    assert np.abs(x - POINT).max() > 0.1


def test_free_fall_by_hand():
    model = at_point(0.1, u=np.zeros(12))
    x = POINT.copy()
    x[6:9], x[9:12] = 0.0, [1.0, 0.0, 2.0]
    after = model.A[0] @ x + model.c[0]
    np.testing.assert_allclose(after[3:6] - x[3:6], [0.1, 0.0, 0.2 - 9.81 * 0.005], atol=1e-12)
    np.testing.assert_allclose(after[9:12], [1.0, 0.0, 2.0 - 0.981], atol=1e-12)


def test_two_units_of_force_carry_the_robot():
    u = np.zeros((4, 3))
    u[[0, 3], 2] = 1.0
    model = at_point(0.02)
    np.testing.assert_allclose(FORCE_UNIT, 12.743448 * 9.81 / 2)
    np.testing.assert_allclose((model.B[0] @ u.ravel() + model.c[0])[9:12], 0, atol=1e-12)


def test_a_foot_ahead_that_pushes_up_lifts_the_nose_by_hand():
    x = np.zeros(12)
    x[5] = 0.28
    feet = np.zeros((1, 4, 3))
    feet[0, 0] = [0.2, 0.0, 0.0]
    model = linearize(np.array([x, x]), np.zeros((1, 12)), feet, np.diag([0.1, 0.4, 0.5]), 0.01)
    np.testing.assert_allclose(model.B[0, 6:9, 2], [0, -0.2 * FORCE_UNIT / 0.4 * 0.01, 0], atol=1e-12)
    np.testing.assert_allclose(model.B[0, 6:9, 0], [0, -0.28 * FORCE_UNIT / 0.4 * 0.01, 0], atol=1e-12)


def test_an_interval_is_linearized_in_its_middle():
    ends = np.array([POINT, POINT])
    ends[1, :3] += [0.1, -0.2, np.pi / 2]
    ends[0, 3:6] -= 0.05
    middle = (ends[0] + ends[1]) / 2
    a = linearize(ends, INPUT[None], FEET[None], INERTIA_B, 0.02)
    b = at_point(0.02, middle)
    for name in ("A", "B", "c"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), atol=1e-12)
    assert np.abs(at_point(0.02).B - b.B).max() > 1e-3, "the inertia turns with the attitude"


def test_intervals_do_not_mix():
    rng = np.random.default_rng(3)
    states, inputs = POINT + 0.1 * rng.normal(size=(5, 12)), INPUT + 0.1 * rng.normal(size=(4, 12))
    feet = FEET + 0.05 * rng.normal(size=(4, 4, 3))
    together = linearize(states, inputs, feet, INERTIA_B, 0.02)
    for k in range(4):
        alone = linearize(states[k : k + 2], inputs[k : k + 1], feet[k : k + 1], INERTIA_B, 0.02)
        for name in ("A", "B", "c"):
            np.testing.assert_allclose(getattr(together, name)[k], getattr(alone, name)[0], atol=1e-13)


def test_a_heavier_body_is_accelerated_less_by_its_feet_and_as_much_by_gravity():
    x = np.array([POINT, POINT])
    light = linearize(x, INPUT[None], FEET[None], INERTIA_B, 0.01)
    heavy = linearize(x, INPUT[None], FEET[None], INERTIA_B, 0.01, 2 * robot.MASS)
    np.testing.assert_allclose(heavy.B[0, 9:], light.B[0, 9:] / 2)
    np.testing.assert_array_equal(heavy.B[0, 6:9], light.B[0, 6:9])
    np.testing.assert_array_equal(heavy.c, light.c)
