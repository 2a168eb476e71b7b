"""The solvers against each other and against optimality itself, on the problems of driven episodes."""

import sys

import numpy as np
import osqp
import pytest
from scipy.optimize import nnls
from scipy.sparse.linalg import spsolve_triangular

from experts.mpc import MPC, MPCConfig
from experts.mpc.program import QuadraticProgram
from experts.mpc.solvers import SOLVERS
from experts.mpc.srbd import FORCE_UNIT

N = MPCConfig().steps
DYNAMICS = 12 * N
EXACT = ("piqp", "daqp")


@pytest.fixture(scope="module")
def mpc() -> MPC:
    return MPC()


def solver(name: str) -> MPC:
    pytest.importorskip(name)
    return MPC(MPCConfig(solver=name))


def optimum(problem: tuple) -> tuple[QuadraticProgram, np.ndarray]:
    """The program and its z by OSQP on the unscaled program, at 1e-9 and polished."""
    program = QuadraticProgram(MPCConfig())
    program.update(*problem)
    oracle = osqp.OSQP()
    oracle.setup(
        program.P, program.q, program.A, program.l, program.u,
        verbose=False, eps_abs=1e-9, eps_rel=1e-9, max_iter=200_000, polishing=True,
    )  # fmt: skip
    result = oracle.solve(raise_error=True)
    return program, result.x


def solved(mpc: MPC, problem: tuple) -> np.ndarray:
    solution = mpc.solve(*problem)
    assert solution.solved and solution.usable
    return np.concatenate([solution.states.ravel(), solution.inputs.ravel()])


def first_forces(z: np.ndarray) -> np.ndarray:
    return z[DYNAMICS : DYNAMICS + 12] * FORCE_UNIT


def violation(program: QuadraticProgram, z: np.ndarray) -> np.ndarray:
    rows = program.A @ z
    return np.maximum(np.maximum(program.l - rows, rows - program.u), 0.0)


def stationarity(program: QuadraticProgram, z: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """What multipliers cannot make zero of the cost's gradient, per foot and interval with contact, shape (M,).

    Those of the dynamics are the costates, for which the gradient with respect to every state vanishes exactly. Those
    of a foot's force are then the non-negative ones of its active limits, if it has any, that come closest.
    """
    gradient, A = program.P @ z + program.q, program.A.tocsc()
    states, limits = A[:DYNAMICS], A[DYNAMICS:, DYNAMICS:]
    costate = spsolve_triangular(states[:, :DYNAMICS].T.tocsr(), gradient[:DYNAMICS], lower=False)
    force = (gradient[DYNAMICS:] - states[:, DYNAMICS:].T @ costate).reshape(-1, 3)
    rows = (limits @ z[DYNAMICS:]).reshape(-1, 5)
    low, high = program.l[DYNAMICS:].reshape(-1, 5), program.u[DYNAMICS:].reshape(-1, 5)
    pyramid = limits[:5, :3].toarray()
    left = []
    for foot in np.flatnonzero(contact.ravel() > 0):
        at_low, at_high = rows[foot] < low[foot] + 2e-3, rows[foot] > high[foot] - 2e-3
        active = np.vstack([pyramid[at_low], -pyramid[at_high], np.zeros((1, 3))])  # never empty: nnls would abort
        left.append(nnls(active.T, force[foot])[1])
    return np.array(left)


def test_osqps_answers_meet_the_kkt_conditions_of_the_unscaled_program(mpc, driven):
    """A gradient of 0.4 / 62.5 N in a force that is within its limits moves it by 1 N, with R alone to hold it."""
    for problem in driven.problems:
        program, _ = optimum(problem)
        z = solved(mpc, problem)
        broken = violation(program, z)
        assert broken[:DYNAMICS].max() < 2e-4, "dynamics"
        assert broken[DYNAMICS:].max() * FORCE_UNIT < 0.2, "force limits [N]"
        left = stationarity(program, z, problem[-1])
        assert np.median(left) < 1e-3 and left.max() < 2e-2
        worse = z.copy()
        worse[DYNAMICS:] *= 1.02
        assert stationarity(program, worse, problem[-1]).max() > 3 * left.max(), "2 % more force would be noticed"


def test_osqps_cost_is_optimal(mpc, driven):
    for problem in driven.problems:
        program, best = optimum(problem)
        z = solved(mpc, problem)
        gap = (z - best) @ (program.P @ (z + best)) / 2 + program.q @ (z - best)
        moved = (best - program_guess(problem)) @ program.P @ (best - program_guess(problem)) / 2
        assert abs(gap) < 5e-3 * max(moved, 1.0)


def program_guess(problem: tuple) -> np.ndarray:
    _, _, x_ref, u_ref, _ = problem
    return np.concatenate([x_ref, u_ref]).ravel()


def test_forces_are_those_of_the_exact_optimum(mpc, driven):
    error = [
        np.abs(first_forces(solved(mpc, problem)) - first_forces(optimum(problem)[1])).max()
        for problem in driven.problems
    ]
    assert np.median(error) < 0.1, "N"
    assert np.percentile(error, 99) < 1.0, "N"


@pytest.mark.parametrize("name", EXACT)
def test_exact_solvers_find_the_optimum(driven, name):
    """An interior point that stops at 1e-8 is a few mN away where a constraint is only just active."""
    ours = solver(name)
    for problem in driven.problems:
        program, best = optimum(problem)
        z = solved(ours, problem)
        assert violation(program, z).max() < 1e-8
        np.testing.assert_allclose(z[:DYNAMICS], best[:DYNAMICS], atol=1e-4)
        np.testing.assert_allclose(z[DYNAMICS:] * FORCE_UNIT, best[DYNAMICS:] * FORCE_UNIT, atol=2e-2)


def test_exact_solvers_agree_on_the_forces(driven):
    piqp, daqp = (solver(name) for name in EXACT)
    error = [
        np.abs(first_forces(solved(piqp, problem)) - first_forces(solved(daqp, problem))).max()
        for problem in driven.problems
    ]
    assert np.median(error) < 1e-3 and max(error) < 5e-3, "N"


@pytest.mark.parametrize("name", SOLVERS)
def test_feet_in_the_air_push_with_exactly_nothing(driven, name):
    ours = solver(name)
    for problem in driven.problems:
        force = ours.solve(*problem).inputs.reshape(N, 4, 3)
        in_air = problem[-1] == 0
        np.testing.assert_allclose(force[in_air], 0.0, atol=0.0 if name != "piqp" else 1e-9)
        assert in_air.any() and np.abs(force[~in_air]).max() > 0.1


@pytest.mark.parametrize("name", SOLVERS)
def test_equal_problems_give_equal_bits_whatever_was_solved_before(driven, name):
    used, fresh = solver(name), solver(name)
    expected = fresh.solve(*driven.problems[3])
    for problem in driven.problems:
        used.solve(*problem)
    np.testing.assert_array_equal(used.solve(*driven.problems[3]).inputs, expected.inputs)


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("poison", [np.nan, 1e30])
def test_every_solver_recovers_from_poison(trotting, name, poison):
    ours = solver(name)
    model, x0, *rest = trotting.problems[1]
    before = ours.solve(model, x0, *rest)
    with np.errstate(invalid="ignore"):
        assert not ours.solve(model, np.full(12, poison), *rest).usable
    np.testing.assert_array_equal(ours.solve(model, x0, *rest).inputs, before.inputs)


@pytest.mark.parametrize("name", EXACT)
def test_a_missing_package_is_named(monkeypatch, name):
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match=rf"pip install {name}"):
        MPC(MPCConfig(solver=name))
