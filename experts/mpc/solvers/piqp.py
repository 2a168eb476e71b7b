"""PIQP: a proximal interior point method, exact."""

import numpy as np
from scipy import sparse

from experts.mpc.program import QuadraticProgram
from experts.mpc.solvers.base import Answer, optional

_TOLERANCE = 1e-10


class PIQPSolver:
    """Proximal interior point on the sparse program, to 1e-10 (R. Schwan et al., 2023).

    Args:
        program: sizes and pattern.

    Raises:
        ImportError: if piqp is not installed.
    """

    def __init__(self, program: QuadraticProgram) -> None:
        piqp = optional("piqp")
        self._done = piqp.PIQP_SOLVED
        self._solver = piqp.SparseSolver()
        settings = self._solver.settings
        settings.eps_abs = settings.eps_rel = _TOLERANCE
        settings.eps_duality_gap_abs = settings.eps_duality_gap_rel = _TOLERANCE
        settings.preconditioner_reuse_on_update = True  # equal bits: see `solve`
        self._P = sparse.csc_matrix(program.P)
        self._solver.setup(self._P, program.q, *self._constraints(program))

    def _constraints(self, program: QuadraticProgram) -> tuple:
        """Equalities A, b and inequalities G, h_l, h_u."""
        at = program.state_size
        return program.A[:at], program.l[:at].copy(), program.A[at:], program.l[at:].copy(), program.u[at:].copy()

    def solve(self, program: QuadraticProgram, guess: np.ndarray) -> Answer:
        """Solve what the program holds now; an interior point method starts where it wants to.

        P is given anew though it is constant: PIQP would scale its copy back and forth, and gather rounding.
        """
        A, b, G, h_l, h_u = self._constraints(program)
        self._solver.update(P=self._P, c=program.q, A=A, b=b, G=G, h_l=h_l, h_u=h_u)
        solved = self._solver.solve() == self._done
        result = self._solver.result
        return Answer(np.array(result.x), int(result.info.iter), solved, solved and bool(np.isfinite(result.x).all()))
