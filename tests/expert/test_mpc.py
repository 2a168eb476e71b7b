"""The quadratic program certified by its KKT residuals and against an exact solution; the workspace's memory."""

import numpy as np
import osqp
import pytest

from experts.dynamics import FORCE_UNIT, linearise
from experts.mpc import MPC, NU, NX, MPCConfig, QuadraticProgram
from experts.reference import BodyReference
from go1_mtl_gym import robot
from go1_mtl_gym.errors import InvalidInputError

N = MPCConfig().steps
ROWS = 20 * N  # friction and force limits


@pytest.fixture(scope="module")
def mpc() -> MPC:
    return MPC()


def unpack(mpc: MPC, problem: tuple):
    """(z, y, P, q, A, l, u) of a solved problem, dense; y are the solver's own multipliers."""
    results = []
    solver, solve = mpc._solver, mpc._solver.solve
    solver.solve = lambda **kwargs: results.append(solve(**kwargs)) or results[-1]
    try:
        solution = mpc.solve(*problem)
    finally:
        del solver.solve
    program = QuadraticProgram(mpc.config)
    program.update(*problem)
    return solution, np.array(results[0].y), program


def exact(problem: tuple) -> np.ndarray:
    """Forces of the first interval [N] by OSQP at 1e-9 with polishing, shape (4, 3)."""
    program = QuadraticProgram(MPCConfig())
    program.update(*problem)
    solver = osqp.OSQP()
    solver.setup(
        program.P, program.q, program.A, program.l, program.u,
        verbose=False, eps_abs=1e-9, eps_rel=1e-9, max_iter=200_000, polishing=True,
    )  # fmt: skip
    result = solver.solve(raise_error=True)
    return result.x[N * NX : N * NX + NU].reshape(4, 3) * FORCE_UNIT


def test_solutions_meet_the_kkt_conditions(mpc, driven):
    for problem in driven.problems:
        solution, y, program = unpack(mpc, problem)
        assert solution.usable
        z = np.concatenate([solution.states.ravel(), solution.inputs.ravel()])
        rows = program.A @ z
        tolerance = 1e-2
        assert np.abs(program.P @ z + program.q + program.A.T @ y).max() < tolerance, "stationarity"
        assert max((program.l - rows).max(), (rows - program.u).max()) < tolerance, "primal feasibility"
        above, below = np.maximum(y, 0), np.minimum(y, 0)
        finite_u, finite_l = np.isfinite(program.u), np.isfinite(program.l)
        assert max(above[~finite_u].max(initial=0), -below[~finite_l].min(initial=0)) < 1e-9, "dual feasibility"
        slack = np.where(finite_u, program.u - rows, 0) * above + np.where(finite_l, program.l - rows, 0) * below
        assert (np.abs(slack) / np.maximum(1.0, np.abs(y))).max() < tolerance, "complementarity"
        assert np.abs(y).max() > 0.1


def test_solutions_obey_dynamics_friction_and_schedule(mpc, driven):
    for problem in driven.problems:
        model, x0, _, _, contact = problem
        solution = mpc.solve(*problem)
        before = np.vstack([x0, solution.states[:-1]])
        predicted = np.einsum("kij,kj->ki", model.A, before) + np.einsum("kij,kj->ki", model.B, solution.inputs)
        np.testing.assert_allclose(solution.states, predicted + model.c, atol=1e-2)
        force = solution.inputs.reshape(N, 4, 3) * FORCE_UNIT
        np.testing.assert_array_equal(solution.forces_w, force[0])
        slack = 0.6  # N, a hundredth of the force unit
        assert (np.abs(force[..., :2]) <= 0.5 * force[..., 2:] + slack).all()
        assert (force[..., 2] <= 160 * contact + slack).all()
        assert (force[..., 2][contact > 1 - 1e-9] >= 10 - slack).all()
        assert np.abs(force[contact == 0]).max(initial=0) < slack
        assert (contact == 0).any() and (contact == 1).any()


def test_forces_are_those_of_the_exact_optimum(mpc, driven):
    errors = [np.abs(mpc.solve(*problem).forces_w - exact(problem)).max() for problem in driven.problems[::2]]
    assert max(errors) < 2.0, "N"


def level(height=0.28) -> tuple:
    """The problem of a robot that stands on all four feet exactly where it should."""
    rows = [np.tile(value, (N + 1, 1)) for value in ([0, 0, 0], [0, 0, height], [0, 0, 0], [0, 0, 0])]
    reference = BodyReference(*(np.array(row, float) for row in rows))
    load = np.full((N, 4), robot.MASS * robot.GRAVITY / 4)
    feet = np.tile(robot.NOMINAL_FOOT_B + [0, 0, 0.023], (N, 1, 1))
    model = linearise(reference, feet, load, np.diag([0.127, 0.394, 0.423]), 0.025)
    u_ref = np.zeros((N, 4, 3))
    u_ref[..., 2] = load / FORCE_UNIT
    return model, reference.states[0], reference.states[1:], u_ref.reshape(N, 12), np.ones((N, 4))


def test_standing_feet_carry_the_weight(mpc):
    solution = mpc.solve(*level())
    assert solution.solved
    assert solution.forces_w[:, 2].sum() == pytest.approx(robot.MASS * 9.81, rel=0.02)
    np.testing.assert_allclose(solution.forces_w[:, 2], robot.MASS * 9.81 / 4, rtol=0.02)
    np.testing.assert_allclose(solution.forces_w[:, :2], 0, atol=0.5)


def test_a_robot_that_is_too_low_is_pushed_up_and_one_too_fast_is_braked(mpc):
    model, x0, *rest = level()
    low, fast = x0.copy(), x0.copy()
    low[5] -= 0.03
    fast[9] += 0.3
    assert mpc.solve(model, low, *rest).forces_w[:, 2].sum() > 1.1 * robot.MASS * 9.81
    assert mpc.solve(model, fast, *rest).forces_w[:, 0].sum() < -10


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


def test_a_solver_cut_short_says_so(trotting):
    hasty = MPC(MPCConfig(max_iterations=10, tolerance=1e-9))
    solution = hasty.solve(*trotting.problems[0])
    assert not solution.solved and solution.iterations == 10
    patient = MPC(MPCConfig(max_iterations=60, tolerance=1e-9)).solve(*trotting.problems[0])
    assert not patient.solved and patient.usable, "close enough to use"


def test_sparsity_pattern_does_not_depend_on_the_problem(trotting):
    program = QuadraticProgram(MPCConfig())
    indices, pointers = program.A.indices.copy(), program.A.indptr.copy()
    for problem in trotting.problems:
        program.update(*problem)
    np.testing.assert_array_equal(program.A.indices, indices)
    np.testing.assert_array_equal(program.A.indptr, pointers)
    dense = program.A.toarray()
    model = trotting.problems[-1][0]
    np.testing.assert_array_equal(dense[12:24, :12], -model.A[1])
    np.testing.assert_array_equal(dense[12:24, N * 12 + 12 : N * 12 + 24], -model.B[1])
    assert program.A.shape == (N * 12 + ROWS, N * 24)


@pytest.mark.parametrize(
    ("figure", "words"),
    [
        ({"steps": 3}, "steps"), ({"input_weight": 0.0}, "input_weight"), ({"friction": -0.5}, "friction"),
        ({"max_force": float("nan")}, "max_force"), ({"min_force": -1.0}, "min_force"), ({"rho": 0.0}, "rho"),
        ({"tolerance": 1.0}, "tolerance"), ({"max_iterations": 1}, "max_iterations"),
        ({"state_weight": (1.0,) * 11}, "number of state weights.*11"),
        ({"state_weight": (-1.0,) + (1.0,) * 11}, "smallest state weight.*-1"),
    ],
)  # fmt: skip
def test_impossible_figures_are_refused(figure, words):
    with pytest.raises(InvalidInputError, match=words):
        MPCConfig(**figure)
