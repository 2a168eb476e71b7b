"""The linear prediction model against finite differences of the nonlinear single rigid body."""

import numpy as np
import pytest
from scipy.linalg import expm

from experts.dynamics import FORCE_UNIT, cross_matrix, euler_rate_matrix, linearise
from experts.reference import BodyReference
from go1_mtl_gym import robot

INERTIA = np.array([[0.127, 0.001, -0.015], [0.001, 0.394, 0.002], [-0.015, 0.002, 0.423]])
LOAD = np.array([55.0, 10.0, 20.0, 40.0])
FEET = robot.NOMINAL_FOOT_B + np.array([0.3, -0.2, 0.023])


def frozen(rpy=(0.05, -0.1, 0.7), com=(0.31, -0.19, 0.28), velocity=(0.4, 0.1, -0.05), omega=(0.0, 0.0, 0.0), steps=2):
    """A reference that stays where it is, so that the middle of each interval is the same point."""
    return BodyReference(*(np.tile(value, (steps + 1, 1)) for value in (rpy, com, omega, velocity)))


def rotation(rpy: np.ndarray) -> np.ndarray:
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    yaw, pitch = [[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]], [[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]]
    return np.array(yaw) @ np.array(pitch) @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])


def nonlinear(x: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Equations (1)-(4) of experts.dynamics; (1) with E inverted from rotation kinematics in the test below."""
    force = u.reshape(4, 3) * FORCE_UNIT
    moment = sum(np.cross(r - x[3:6], f) for r, f in zip(FEET, force))
    return np.concatenate(
        [
            euler_rate_matrix(x[:3]) @ x[6:9],
            x[9:12],
            np.linalg.solve(INERTIA, moment),
            force.sum(axis=0) / robot.MASS + [0, 0, -9.81],
        ]
    )


def jacobian(function, at: np.ndarray, step: float = 1e-6) -> np.ndarray:
    columns = [(function(at + d) - function(at - d)) / (2 * step) for d in step * np.eye(len(at))]
    return np.stack(columns, axis=1)


def nominal_input() -> np.ndarray:
    u = np.zeros((4, 3))
    u[:, 2] = LOAD / FORCE_UNIT
    return u.ravel()


def continuous(reference: BodyReference, dt: float = 1e-7):
    model = linearise(reference, np.tile(FEET, (2, 1, 1)), np.tile(LOAD, (2, 1)), INERTIA, dt)
    return (model.A[0] - np.eye(12)) / dt, model.B[0] / dt, model.c[0] / dt


def test_cross_matrix_is_the_cross_product():
    rng = np.random.default_rng(0)
    r, f = rng.normal(size=(5, 4, 3)), rng.normal(size=(5, 4, 3))
    np.testing.assert_allclose((cross_matrix(r) @ f[..., None])[..., 0], np.cross(r, f), atol=1e-14)


def test_euler_rates_turn_the_body_at_omega():
    """E omega must be the rate of (roll, pitch, yaw) for which Rdot = [omega] R."""
    rng, step = np.random.default_rng(1), 1e-6
    for _ in range(30):
        rpy, omega = rng.uniform([-3, -1.3, -3], [3, 1.3, 3]), rng.normal(size=3)
        rate = euler_rate_matrix(rpy) @ omega
        numeric = (rotation(rpy + step * rate) - rotation(rpy - step * rate)) / (2 * step)
        np.testing.assert_allclose(numeric, cross_matrix(omega) @ rotation(rpy), atol=1e-7)


def test_euler_rates_at_zero_attitude_are_omega():
    np.testing.assert_array_equal(euler_rate_matrix(np.zeros((3, 3))), np.tile(np.eye(3), (3, 1, 1)))


def test_linear_model_is_the_jacobian_of_the_nonlinear_one():
    reference = frozen()
    x, u = reference.states[0], nominal_input()
    A, B, _ = continuous(reference)
    np.testing.assert_allclose(A, jacobian(lambda x: nonlinear(x, u), x), atol=1e-4)
    np.testing.assert_allclose(B, jacobian(lambda u: nonlinear(x, u), u), atol=1e-4)
    assert np.abs(A[6:9, 3:6]).max() > 100, "the moment of the load about a displaced centre of mass matters"


@pytest.mark.parametrize("omega", [(0.0, 0.0, 0.0), (0.3, -1.0, 0.5)])
def test_linear_model_is_exact_at_the_reference(omega):
    reference = frozen(omega=omega)
    A, B, c = continuous(reference)
    x, u = reference.states[0], nominal_input()
    np.testing.assert_allclose(A @ x + B @ u + c, nonlinear(x, u), atol=2e-4)


def test_discretisation_is_of_second_order():
    reference = frozen()
    A, B, c = continuous(reference)
    errors = []
    for dt in (0.04, 0.02, 0.01):
        model = linearise(reference, np.tile(FEET, (2, 1, 1)), np.tile(LOAD, (2, 1)), INERTIA, dt)
        exact = expm(dt * np.block([[A, B, c[:, None]], [np.zeros((13, 25))]]))[:12]
        got = np.hstack([model.A[0], model.B[0], model.c[0][:, None]])
        errors.append(np.abs(got - exact).max())
    assert errors[0] > errors[1] > errors[2] > 0
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx(8.0, rel=0.2)  # the first term left out is dt^3


def test_free_fall_by_hand():
    model = linearise(frozen(), np.tile(FEET, (2, 1, 1)), np.tile(LOAD, (2, 1)), INERTIA, 0.1)
    x = np.zeros(12)
    x[3:6] = frozen().com_w[0]  # at the reference position, so that the load has no moment
    x[9:12] = [1.0, 0.0, 2.0]
    after = model.A[0] @ x + model.c[0]
    np.testing.assert_allclose(after[3:6] - x[3:6], [0.1, 0.0, 0.2 - 9.81 * 0.005], atol=1e-12)
    np.testing.assert_allclose(after[9:12], [1.0, 0.0, 2.0 - 0.981], atol=1e-12)


def test_two_units_of_force_carry_the_robot():
    model = linearise(frozen(), np.tile(FEET, (2, 1, 1)), np.tile(LOAD, (2, 1)), INERTIA, 0.02)
    u = np.zeros((4, 3))
    u[[0, 3], 2] = 1.0
    velocity = model.B[0] @ u.ravel() + model.c[0]
    np.testing.assert_allclose(FORCE_UNIT, 12.743448 * 9.81 / 2)
    np.testing.assert_allclose(velocity[9:12], 0, atol=1e-12)


def test_middle_of_the_interval_and_yaw_of_the_inertia_follow_the_reference():
    turned = frozen(steps=1)
    turned.rpy[1, 2] = turned.rpy[0, 2] + np.pi  # the middle is a quarter turn on
    feet, load = FEET[None], LOAD[None]
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    straight = frozen(steps=1, rpy=(*turned.rpy[0, :2], turned.rpy[0, 2] + np.pi / 2))
    a = linearise(turned, feet, load, INERTIA, 0.02)
    b = linearise(straight, feet, load, quarter @ INERTIA @ quarter.T, 0.02)
    np.testing.assert_allclose(a.B, b.B, atol=1e-12)
    np.testing.assert_allclose(a.A, b.A, atol=1e-12)
