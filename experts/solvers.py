"""Solvers of the MPC's quadratic program: OSQP, which is the default, and two exact ones to hold against it.

Each is set up once for a program's pattern, solves what the program holds at the time, and starts from the same guess
every time, never from its previous answer: equal problems give equal bits whatever was solved before.
"""

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
import osqp
from scipy import sparse
from scipy.linalg import solve_triangular

if TYPE_CHECKING:
    from experts.mpc import QuadraticProgram

INEXACT = 1e-2
"""Largest residual of OSQP's scaled problem with which an unfinished solution is still used."""
_ROW_SCALE = 1.4  # friction rows against the inputs' own scale; found by measurement, as were rho and relaxation


class Answer(NamedTuple):
    """A solver's answer: z, iterations, whether the tolerance was met, and whether z may be used."""

    z: np.ndarray
    iterations: int
    solved: bool
    usable: bool


class QPSolver(Protocol):
    """What the MPC asks of a solver; made from the program whose pattern it is for."""

    def solve(self, program: "QuadraticProgram", guess: np.ndarray) -> Answer:
        """Solve what the program holds now."""


class OSQPSolver:
    """ADMM, scaled by hand: z = D z', rows times E, so that the Hessian is the identity.

    D = P^(-1/2) and, on the dynamics' rows, E = Q^(1/2) keep the ones on the diagonal there. OSQP's own scaling would
    have to be found anew for each problem; this one is right for all. With a relaxation of 1.35 instead of the usual 1.6
    the equality constraints settle in half the iterations. The bounds of feet in the air, 0 <= f_z <= 0, are opened: their
    forces do not enter the dynamics, so they are zero at the optimum anyhow, and a row that turns from inequality to
    equality costs a second factorisation.

    Args:
        program: sizes, pattern and settings.
    """

    def __init__(self, program: "QuadraticProgram") -> None:
        config, A = program.config, program.A
        dynamics = config.steps * 12
        self._columns = program.weight**-0.5
        self._rows = np.full(A.shape[0], _ROW_SCALE * config.input_weight**0.5)
        self._rows[:dynamics] = program.weight[:dynamics] ** 0.5
        column_of = np.repeat(np.arange(A.shape[1]), np.diff(A.indptr))
        self._entries = self._rows[A.indices] * self._columns[column_of]
        self._multipliers = np.zeros(A.shape[0])
        self._split, self._load = dynamics, slice(dynamics + 4, None, 5)
        scaled = sparse.csc_matrix((A.data * self._entries, A.indices, A.indptr), A.shape)
        self._solver = osqp.OSQP()
        self._solver.setup(
            sparse.eye(A.shape[1], format="csc"),
            program.q * self._columns,
            scaled,
            program.l * self._rows,
            program.u * self._rows,
            verbose=False,
            scaling=0,
            adaptive_rho=0,
            rho=config.rho,
            alpha=config.relaxation,
            eps_abs=config.tolerance,
            eps_rel=config.tolerance,
            max_iter=config.max_iterations,
            check_termination=5,
            polishing=False,
            warm_starting=True,
        )

    def solve(self, program: "QuadraticProgram", guess: np.ndarray) -> Answer:
        """Solve what the program holds now, from `guess` and zero multipliers."""
        rows, columns = self._rows, self._columns
        upper = program.u * rows
        load = upper[self._load]
        load[load == 0.0] = np.inf
        self._solver.update(q=program.q * columns, l=program.l * rows, u=upper, Ax=program.A.data * self._entries)
        self._solver.warm_start(x=guess / columns, y=self._multipliers)
        result = self._solver.solve(raise_error=False)
        info = result.info
        finite = bool(np.isfinite(result.x).all())
        solved = finite and info.status_val == osqp.SolverStatus.OSQP_SOLVED
        close = finite and max(info.prim_res, info.dual_res) < INEXACT
        z = result.x * columns
        z[self._split :].reshape(-1, 3)[load == np.inf] = 0.0
        return Answer(z, int(info.iter), solved, solved or close)


class PIQPSolver:
    """Proximal interior point on the sparse program, to 1e-8 (R. Schwan et al., 2023)."""

    def __init__(self, program: "QuadraticProgram") -> None:
        import piqp

        self._done = piqp.PIQP_SOLVED
        self._split = program.config.steps * 12
        self._solver = piqp.SparseSolver()
        self._solver.setup(sparse.csc_matrix(program.P), program.q, *self._constraints(program))

    def _constraints(self, program: "QuadraticProgram") -> tuple:
        at = self._split
        return program.A[:at], program.l[:at].copy(), program.A[at:], program.l[at:].copy(), program.u[at:].copy()

    def solve(self, program: "QuadraticProgram", guess: np.ndarray) -> Answer:
        """Solve what the program holds now; an interior point method starts where it wants to."""
        A, b, G, h_l, h_u = self._constraints(program)
        self._solver.update(c=program.q, A=A, b=b, G=G, h_l=h_l, h_u=h_u)
        solved = self._solver.solve() == self._done
        result = self._solver.result
        return Answer(np.array(result.x), int(result.info.iter), solved, solved and bool(np.isfinite(result.x).all()))


class DAQPSolver:
    """Dual active set on the forces alone (D. Arnström et al., 2022).

    The states are eliminated through the dynamics, and feet in the air with them: min over the stance feet's u of
    (S u + s - x_ref)' Q (S u + s - x_ref) / 2 + (u - u_ref)' R (u - u_ref) / 2 within the friction pyramids.
    """

    def __init__(self, program: "QuadraticProgram") -> None:
        import daqp

        self._daqp = daqp
        self._split = program.config.steps * 12

    def solve(self, program: "QuadraticProgram", guess: np.ndarray) -> Answer:
        """Solve what the program holds now."""
        at = self._split
        used = np.flatnonzero((program.u[at + 4 :: 5] > 0).repeat(3))
        dense = program.A.toarray()
        pyramid = (program.u[at + 4 :: 5] > 0).repeat(5)
        rhs = np.column_stack([program.l[:at], -dense[:at, at + used]])
        eliminated = solve_triangular(dense[:at, :at], rhs, lower=True, unit_diagonal=True)
        offset, S = eliminated[:, 0], np.ascontiguousarray(eliminated[:, 1:])
        Q, R = program.weight[:at], program.weight[at + used]
        H = S.T @ (Q[:, None] * S)
        H[np.diag_indices_from(H)] += R
        f = S.T @ (Q * offset + program.q[:at]) + program.q[at + used]
        upper, lower = np.minimum(program.u[at:][pyramid], 1e30), program.l[at:][pyramid]
        rows = np.ascontiguousarray(dense[at:, at + used][pyramid])
        u, _, flag, info = self._daqp.solve(H, f, rows, upper, lower, np.zeros(len(upper), dtype=np.intc))
        z = np.zeros(len(program.q))
        z[:at], z[at + used] = offset + S @ u, u
        solved = flag == 1 and bool(np.isfinite(z).all())
        return Answer(z, int(info["iterations"]), solved, solved)


SOLVERS = {"osqp": OSQPSolver, "piqp": PIQPSolver, "daqp": DAQPSolver}
"""Solver classes by name."""
