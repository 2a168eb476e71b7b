"""Solutions of the quadratic program: what they obey, and a solver that forgets."""

import numpy as np
import pytest

from experts.mpc.config import MPCConfig
from experts.mpc.controller import MPC
from experts.mpc.srbd import FORCE_UNIT, linearize
from go1_mtl_gym import robot

N = MPCConfig().steps
WEIGHT_N = robot.MASS * robot.GRAVITY


@pytest.fixture(scope="module")
def mpc() -> MPC:
    return MPC()


def level(height=0.28) -> tuple:
    """The problem of a robot that stands on all four feet exactly where it should."""
    x = np.zeros(12)
    x[5] = height
    u_ref = np.zeros((N, 4, 3))
    u_ref[..., 2] = WEIGHT_N / 4 / FORCE_UNIT
    feet = np.tile(robot.NOMINAL_FOOT_B + [0, 0, 0.023], (N, 1, 1))
    model = linearize(np.tile(x, (N + 1, 1)), u_ref.reshape(N, 12), feet, np.diag([0.127, 0.394, 0.423]), 0.025)
    return model, x, np.tile(x, (N, 1)), u_ref.reshape(N, 12), np.ones((N, 4))


def test_solutions_obey_dynamics_friction_and_schedule(mpc, driven):
    for problem in driven.problems:
        model, x0, _, _, contact = problem
        solution = mpc.solve(*problem)
        assert solution.solved and solution.usable
        before = np.vstack([x0, solution.states[:-1]])
        predicted = np.einsum("kij,kj->ki", model.A, before) + np.einsum("kij,kj->ki", model.B, solution.inputs)
        np.testing.assert_allclose(solution.states, predicted + model.c, atol=1e-3)
        force = solution.inputs.reshape(N, 4, 3) * FORCE_UNIT
        np.testing.assert_array_equal(solution.forces_w, force[0])
        slack = 0.1  # N
        assert (np.abs(force[..., :2]) <= 0.5 * force[..., 2:] + slack).all()
        assert (force[..., 2] <= 160 * contact + slack).all()
        assert (force[..., 2][contact > 1 - 1e-9] >= 10 - slack).all()
        assert not force[contact == 0].any(), "exactly zero in the air"
        assert (contact == 0).any() and (contact == 1).any()


def test_standing_feet_carry_the_weight(mpc):
    solution = mpc.solve(*level())
    assert solution.solved
    assert solution.forces_w[:, 2].sum() == pytest.approx(WEIGHT_N, rel=1e-3)
    np.testing.assert_allclose(solution.forces_w[:, 2], WEIGHT_N / 4, rtol=1e-3)
    np.testing.assert_allclose(solution.forces_w[:, :2], 0, atol=0.05)
    np.testing.assert_allclose(solution.states, level()[2], atol=1e-3)


def test_a_robot_that_is_too_low_is_pushed_up_and_one_too_fast_is_braked(mpc):
    model, x0, *rest = level()
    low, fast = x0.copy(), x0.copy()
    low[5] -= 0.03
    fast[9] += 0.3
    assert mpc.solve(model, low, *rest).forces_w[:, 2].sum() > 1.1 * WEIGHT_N
    assert mpc.solve(model, fast, *rest).forces_w[:, 0].sum() < -10


def test_one_rolled_to_the_right_is_righted(mpc):
    model, x0, *rest = level()
    rolled = x0.copy()
    rolled[0] = 0.1  # left side up
    load = mpc.solve(model, rolled, *rest).forces_w[:, 2]
    assert load[[1, 3]].sum() > load[[0, 2]].sum() + 5


def test_friction_limits_what_a_hard_push_gets(mpc):
    model, x0, *rest = level()
    thrown = x0.copy()
    thrown[10] = 1.2
    force = mpc.solve(model, thrown, *rest).forces_w
    np.testing.assert_allclose(force[:, 1], -0.5 * force[:, 2], atol=1.0)


def test_a_slippery_ground_that_is_told_of_limits_more_and_a_rough_one_no_less(mpc):
    model, x0, *rest = level()
    thrown = x0.copy()
    thrown[10] = 1.2
    told = mpc.solve(model, thrown, *rest, friction=0.2)
    force = told.forces_w
    np.testing.assert_allclose(force[:, 1], -0.2 * force[:, 2], atol=1.0)
    configured = MPC(MPCConfig(friction=0.2)).solve(model, thrown, *rest)
    np.testing.assert_array_equal(told.inputs, configured.inputs)
    untold = mpc.solve(model, thrown, *rest)
    np.testing.assert_array_equal(mpc.solve(model, thrown, *rest, friction=0.9).inputs, untold.inputs)


def test_the_same_problem_gives_the_same_bits_whatever_came_before(mpc, driven):
    problem, *others = driven.problems
    first = mpc.solve(*problem)
    for other in (problem, *others, level()):
        mpc.solve(*other)
    again, fresh = mpc.solve(*problem), MPC().solve(*problem)
    for solution in (again, fresh):
        np.testing.assert_array_equal(solution.inputs, first.inputs)
        np.testing.assert_array_equal(solution.states, first.states)
        assert solution.iterations == first.iterations


@pytest.mark.parametrize("where", ["x0", "x_ref", "u_ref", "A", "B", "c", "contact"])
@pytest.mark.parametrize("poison", [np.nan, -np.inf, np.inf, 1e30])
def test_poisoned_problems_are_refused_and_leave_no_trace(mpc, where, poison):
    model, x0, x_ref, u_ref, contact = level()
    before = mpc.solve(*level())
    arrays = {"x0": x0, "x_ref": x_ref, "u_ref": u_ref, "A": model.A, "B": model.B, "c": model.c, "contact": contact}
    spoilt = arrays[where]
    spoilt[np.nonzero(spoilt) if where in ("A", "B") else ...] = poison
    with np.errstate(invalid="ignore"):
        solution = mpc.solve(model, x0, x_ref, u_ref, contact)
    assert not solution.usable and not solution.solved
    after = mpc.solve(*level())
    assert after.usable
    np.testing.assert_array_equal(after.inputs, before.inputs)
    np.testing.assert_array_equal(after.states, before.states)


def test_one_poisoned_number_is_enough(mpc, trotting):
    model, x0, x_ref, u_ref, contact = trotting.problems[0]
    x0 = x0.copy()
    x0[7] = np.nan
    assert not mpc.solve(model, x0, x_ref, u_ref, contact).usable
    assert mpc.solve(*trotting.problems[0]).usable


def test_a_solver_cut_short_says_so(trotting):
    hasty = MPC(MPCConfig(max_iterations=10, tolerance=1e-9))
    solution = hasty.solve(*trotting.problems[0])
    assert not solution.solved and solution.iterations == 10
    patient = MPC(MPCConfig(max_iterations=30, tolerance=1e-9)).solve(*trotting.problems[0])
    assert not patient.solved and patient.usable, "close enough to use"
