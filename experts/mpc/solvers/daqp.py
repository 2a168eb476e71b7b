"""DAQP: a dual active-set method on the condensed program, exact."""

import numpy as np
from scipy.linalg import solve_triangular

from experts.friction import ROWS_PER_FOOT
from experts.mpc.program import QuadraticProgram
from experts.mpc.solvers.base import Answer, optional

_UNBOUNDED = 1e30  # DAQP's infinity
_SOLVED = 1  # DAQP's exit flag


class DAQPSolver:
    """Dual active set on the forces alone (D. Arnström et al., 2022).

    The states are eliminated through the dynamics, and feet in the air with them: min over the stance feet's u of
    (S u + s - x_ref)' Q (S u + s - x_ref) / 2 + (u - u_ref)' R (u - u_ref) / 2 within the friction pyramids.

    Args:
        program: of the pattern that is to be solved.

    Raises:
        ImportError: if daqp is not installed.
    """

    def __init__(self, program: QuadraticProgram) -> None:
        self._daqp = optional("daqp")

    def solve(self, program: QuadraticProgram, guess: np.ndarray) -> Answer:
        """Solve what the program holds now; an active-set method starts without active limits."""
        at, contacts, dense = program.state_size, program.contacts(), program.A.toarray()
        inputs = at + np.flatnonzero(contacts.repeat(3))
        limits = at + np.flatnonzero(contacts.repeat(ROWS_PER_FOOT))
        # The dynamics' rows are [L, -B] with L unit lower triangular: x = s + S u by one forward substitution.
        sides = np.column_stack([program.l[:at], -dense[:at, inputs]])
        eliminated = solve_triangular(dense[:at, :at], sides, lower=True, unit_diagonal=True)
        s, S = eliminated[:, 0], np.ascontiguousarray(eliminated[:, 1:])
        Q, R = program.weight[:at], program.weight[inputs]
        H = S.T @ (Q[:, None] * S)
        H[np.diag_indices_from(H)] += R
        f = S.T @ (Q * s + program.q[:at]) + program.q[inputs]
        rows = np.ascontiguousarray(dense[np.ix_(limits, inputs)])
        upper, lower = np.minimum(program.u[limits], _UNBOUNDED), program.l[limits]
        u, _, flag, info = self._daqp.solve(H, f, rows, upper, lower, np.zeros(len(upper), dtype=np.intc))
        z = np.zeros(len(program.q))
        z[:at], z[inputs] = s + S @ u, u
        solved = flag == _SOLVED and bool(np.isfinite(z).all())
        return Answer(z, int(info["iterations"]), solved, solved)
