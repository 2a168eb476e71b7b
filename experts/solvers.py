"""Solvers of the MPC's quadratic program: OSQP, which is the default, and two exact ones to hold against it.

Each is set up once for a program's pattern, solves what the program holds at the time, and starts from the same guess
every time, never from its previous answer: equal problems give equal bits whatever was solved before.
"""

from collections import OrderedDict
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
import osqp
from scipy import sparse
from scipy.linalg import solve_triangular

if TYPE_CHECKING:
    from experts.mpc import QuadraticProgram

INEXACT = 1e-2
"""Largest residual of OSQP's scaled problem with which an unfinished solution is still used."""
MOST_WORKSPACES = 512
"""Workspaces that are kept, of some 0.3 MB each; the one that was not used for longest goes first."""
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
    have to be found anew for each problem; this one is right for all. With a relaxation of 1.3 instead of the usual
    1.6 the equality constraints settle in half the iterations. Forces of feet in the air are left out: there is one
    workspace, a third smaller, for each pattern of contacts met. A gait has some dozens.

    Args:
        program: sizes, pattern and settings.
    """

    def __init__(self, program: "QuadraticProgram") -> None:
        config, A = program.config, program.A
        self._split = config.steps * 12
        self._columns = program.weight**-0.5
        self._rows = np.full(A.shape[0], _ROW_SCALE * config.input_weight**0.5)
        self._rows[: self._split] = program.weight[: self._split] ** 0.5
        column_of = np.repeat(np.arange(A.shape[1]), np.diff(A.indptr))
        self._entries = self._rows[A.indices] * self._columns[column_of]
        self._workspaces: OrderedDict[bytes, _Workspace] = OrderedDict()

    def solve(self, program: "QuadraticProgram", guess: np.ndarray) -> Answer:
        """Solve what the program holds now, from `guess` and zero multipliers."""
        used = program.u[self._split + 4 :: 5] > 0
        key = used.tobytes()
        workspace = self._workspaces.get(key)
        if workspace is None:
            workspace = self._workspaces[key] = _Workspace(program, used, self._rows, self._columns, self._entries)
            if len(self._workspaces) > MOST_WORKSPACES:
                self._workspaces.popitem(last=False)
        self._workspaces.move_to_end(key)
        return workspace.solve(program, guess)


class _Workspace:
    """OSQP for one pattern of contacts.

    Args:
        program: as of `OSQPSolver`.
        used: foot and interval pairs with contact, bool, shape (4 N,).
        rows, columns, entries: scales of A's rows, of its columns, and of its entries.
    """

    def __init__(
        self,
        program: "QuadraticProgram",
        used: np.ndarray,
        rows: np.ndarray,
        columns: np.ndarray,
        entries: np.ndarray,
    ) -> None:
        config, split = program.config, program.config.steps * 12
        self._own_rows = np.concatenate([np.arange(split), split + np.flatnonzero(used.repeat(5))])
        self._own_columns = np.concatenate([np.arange(split), split + np.flatnonzero(used.repeat(3))])
        numbered = program.A.copy()
        numbered.data = np.arange(1.0, numbered.nnz + 1)
        numbered = sparse.csc_matrix(numbered[self._own_rows][:, self._own_columns])
        numbered.sort_indices()
        self._own_entries = numbered.data.astype(int) - 1
        self._rows, self._columns = rows[self._own_rows], columns[self._own_columns]
        self._entries = entries[self._own_entries]
        self._multipliers = np.zeros(len(self._rows))
        data = np.where(program.A.data == 0.0, 1.0, program.A.data)[self._own_entries] * self._entries
        self._solver = osqp.OSQP()
        self._solver.setup(
            sparse.eye(len(self._columns), format="csc"),
            np.zeros(len(self._columns)),
            sparse.csc_matrix((data, numbered.indices, numbered.indptr), numbered.shape),
            program.l[self._own_rows] * self._rows,
            program.u[self._own_rows] * self._rows,
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
        """Solve what the program holds now; forces that are left out are zero."""
        rows, columns = self._rows, self._columns
        self._solver.update(
            q=program.q[self._own_columns] * columns,
            l=program.l[self._own_rows] * rows,
            u=program.u[self._own_rows] * rows,
            Ax=program.A.data[self._own_entries] * self._entries,
        )
        self._solver.warm_start(x=guess[self._own_columns] / columns, y=self._multipliers)
        result = self._solver.solve(raise_error=False)
        info = result.info
        finite = bool(np.isfinite(result.x).all())
        solved = finite and info.status_val == osqp.SolverStatus.OSQP_SOLVED
        close = finite and max(info.prim_res, info.dual_res) < INEXACT
        z = np.zeros(len(guess))
        z[self._own_columns] = result.x * columns
        return Answer(z, int(info.iter), solved, solved or close)


class PIQPSolver:
    """Proximal interior point on the sparse program, to 1e-10 (R. Schwan et al., 2023)."""

    def __init__(self, program: "QuadraticProgram") -> None:
        piqp = _optional("piqp")
        self._done = piqp.PIQP_SOLVED
        self._split = program.config.steps * 12
        self._solver = piqp.SparseSolver()
        self._solver.settings.eps_abs = self._solver.settings.eps_rel = 1e-10
        self._solver.settings.eps_duality_gap_abs = self._solver.settings.eps_duality_gap_rel = 1e-10
        self._solver.settings.preconditioner_reuse_on_update = True  # equal bits: see `solve`
        self._P = sparse.csc_matrix(program.P)
        self._solver.setup(self._P, program.q, *self._constraints(program))

    def _constraints(self, program: "QuadraticProgram") -> tuple:
        at = self._split
        return program.A[:at], program.l[:at].copy(), program.A[at:], program.l[at:].copy(), program.u[at:].copy()

    def solve(self, program: "QuadraticProgram", guess: np.ndarray) -> Answer:
        """Solve what the program holds now; an interior point method starts where it wants to.

        P is given anew though it is constant: PIQP would scale its own copy back and forth, and gather rounding.
        """
        A, b, G, h_l, h_u = self._constraints(program)
        self._solver.update(P=self._P, c=program.q, A=A, b=b, G=G, h_l=h_l, h_u=h_u)
        solved = self._solver.solve() == self._done
        result = self._solver.result
        return Answer(np.array(result.x), int(result.info.iter), solved, solved and bool(np.isfinite(result.x).all()))


class DAQPSolver:
    """Dual active set on the forces alone (D. Arnström et al., 2022).

    The states are eliminated through the dynamics, and feet in the air with them: min over the stance feet's u of
    (S u + s - x_ref)' Q (S u + s - x_ref) / 2 + (u - u_ref)' R (u - u_ref) / 2 within the friction pyramids.
    """

    def __init__(self, program: "QuadraticProgram") -> None:
        self._daqp = _optional("daqp")
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


def _optional(name: str) -> ModuleType:
    try:
        return import_module(name)
    except ImportError as error:
        message = f"the MPC's solver {name!r} needs the package {name}: pip install 'go1-mtl-gym[solvers]'"
        raise ImportError(message) from error


SOLVERS = {"osqp": OSQPSolver, "piqp": PIQPSolver, "daqp": DAQPSolver}
"""Solver classes by name."""
