"""OSQP: the alternating direction method of multipliers, on a program that is scaled by hand."""

from collections import OrderedDict

import numpy as np
import osqp
from scipy import sparse

from experts.friction import ROWS_PER_FOOT
from experts.mpc.program import QuadraticProgram
from experts.mpc.solvers.base import Answer

INEXACT = 1e-2
"""Largest residual of OSQP's scaled problem with which an unfinished solution is still used."""
MOST_WORKSPACES = 512
"""Workspaces that are kept, of some 0.3 MB each; the one that was not used for longest goes first."""
_LIMIT_ROW_SCALE = 1.4  # friction rows against the inputs' scale; chosen by measurement, as were rho and relaxation


class OSQPSolver:
    """ADMM (B. Stellato et al., 2020), scaled by hand: z = D z', rows times E, so that the Hessian is the identity.

    D = P^(-1/2) and, on the dynamics' rows, E = Q^(1/2) keep the ones on the diagonal there. OSQP's scaling would have
    to be computed anew for each problem; this one is right for all. With a relaxation of 1.3 instead of the usual 1.6
    the equality constraints settle in half the iterations. Forces of feet in the air are left out: there is one
    workspace, a third smaller, for each pattern of contacts met. A gait has some dozens.

    Args:
        program: sizes, pattern and settings.
    """

    def __init__(self, program: QuadraticProgram) -> None:
        A, split = program.A, program.state_size
        self._columns = program.weight**-0.5
        self._rows = np.full(A.shape[0], _LIMIT_ROW_SCALE * program.config.input_weight**0.5)
        self._rows[:split] = program.weight[:split] ** 0.5
        column_of = np.repeat(np.arange(A.shape[1]), np.diff(A.indptr))
        self._entries = self._rows[A.indices] * self._columns[column_of]
        self._workspaces: OrderedDict[bytes, _Workspace] = OrderedDict()

    def solve(self, program: QuadraticProgram, guess: np.ndarray) -> Answer:
        """Solve what the program holds now, from `guess` and zero multipliers."""
        contacts = program.contacts()
        key = contacts.tobytes()
        workspace = self._workspaces.get(key)
        if workspace is None:
            workspace = _Workspace(program, contacts, self._rows, self._columns, self._entries)
            self._workspaces[key] = workspace
            if len(self._workspaces) > MOST_WORKSPACES:
                self._workspaces.popitem(last=False)
        self._workspaces.move_to_end(key)
        return workspace.solve(program, guess)


class _Workspace:
    """OSQP for one pattern of contacts.

    Args:
        program: as of `OSQPSolver`.
        contacts: foot and interval pairs with contact, bool, shape (4 N,).
        rows, columns, entries: scales of A's rows, of its columns, and of its entries.
    """

    def __init__(
        self,
        program: QuadraticProgram,
        contacts: np.ndarray,
        rows: np.ndarray,
        columns: np.ndarray,
        entries: np.ndarray,
    ) -> None:
        split = program.state_size
        self._kept_rows = np.concatenate([np.arange(split), split + np.flatnonzero(contacts.repeat(ROWS_PER_FOOT))])
        self._kept_columns = np.concatenate([np.arange(split), split + np.flatnonzero(contacts.repeat(3))])
        numbered = self._numbered(program)
        self._kept_entries = numbered.data.astype(int) - 1
        self._rows, self._columns = rows[self._kept_rows], columns[self._kept_columns]
        self._entries = entries[self._kept_entries]
        self._no_multipliers = np.zeros(len(self._rows))
        # A zero that happens to stand in the first problem met must not drop out of the pattern.
        data = np.where(program.A.data == 0.0, 1.0, program.A.data)[self._kept_entries] * self._entries
        A = sparse.csc_matrix((data, numbered.indices, numbered.indptr), numbered.shape)
        self._solver = self._set_up(program, A)

    def _numbered(self, program: QuadraticProgram) -> sparse.csc_matrix:
        """The rows and columns of A that are kept, with each entry's number in A, from one, as its value."""
        numbered = program.A.copy()
        numbered.data = np.arange(1.0, numbered.nnz + 1)
        kept = sparse.csc_matrix(numbered[self._kept_rows][:, self._kept_columns])
        kept.sort_indices()
        return kept

    def _set_up(self, program: QuadraticProgram, A: sparse.csc_matrix) -> osqp.OSQP:
        config, solver = program.config, osqp.OSQP()
        solver.setup(
            sparse.eye(len(self._columns), format="csc"),
            np.zeros(len(self._columns)),
            A,
            program.l[self._kept_rows] * self._rows,
            program.u[self._kept_rows] * self._rows,
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
        return solver

    def solve(self, program: QuadraticProgram, guess: np.ndarray) -> Answer:
        """Solve what the program holds now; forces that are left out are zero."""
        rows, columns = self._rows, self._columns
        self._solver.update(
            q=program.q[self._kept_columns] * columns,
            l=program.l[self._kept_rows] * rows,
            u=program.u[self._kept_rows] * rows,
            Ax=program.A.data[self._kept_entries] * self._entries,
        )
        # Zero multipliers, not the last ones: an answer must not depend on what was solved before.
        self._solver.warm_start(x=guess[self._kept_columns] / columns, y=self._no_multipliers)
        result = self._solver.solve(raise_error=False)
        info = result.info
        finite = bool(np.isfinite(result.x).all())
        solved = finite and info.status_val == osqp.SolverStatus.OSQP_SOLVED
        close = finite and max(info.prim_res, info.dual_res) < INEXACT
        z = np.zeros(len(guess))
        z[self._kept_columns] = result.x * columns
        return Answer(z, int(info.iter), solved, solved or close)
