"""The MPC: poses its quadratic program, has it solved, and says how well that went."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from experts.mpc.config import NU, NX, MPCConfig
from experts.mpc.program import QuadraticProgram
from experts.mpc.solvers import SOLVERS
from experts.mpc.solvers.base import QPSolver
from experts.mpc.srbd import FORCE_UNIT, LinearModel
from experts.plausibility import plausible


@dataclass(frozen=True)
class Solution:
    """What the solver returned.

    Attributes:
        states: predicted x[1..N], shape (N, 12).
        inputs: u[0..N-1] in units of `FORCE_UNIT`, shape (N, 12).
        iterations: of the solver.
        solved: the solver met its tolerance.
        usable: it did, or came close, and everything is finite.
    """

    states: np.ndarray
    inputs: np.ndarray
    iterations: int
    solved: bool
    usable: bool

    @property
    def forces_w(self) -> np.ndarray:
        """Ground forces of the first interval, world [N], shape (4, 3)."""
        return self.inputs[0].reshape(4, 3) * FORCE_UNIT


class MPC:
    """Solves `QuadraticProgram`s; the answer depends on the problem alone, to the bit.

    A copy, deep or pickled, is made anew from the configuration: a solver's workspace is memory of C that cannot be
    copied, and nothing in it shows in an answer.

    Args:
        config: sizes, weights, limits and solver settings.

    Raises:
        ImportError: if the configured solver is not installed.
    """

    def __init__(self, config: MPCConfig | None = None) -> None:
        self.config = config or MPCConfig()
        self.program = QuadraticProgram(self.config)
        self._solver: QPSolver = SOLVERS[self.config.solver](self.program)

    def __reduce__(self) -> tuple[Callable[..., "MPC"], tuple[MPCConfig]]:
        return type(self), (self.config,)

    def solve(
        self,
        model: LinearModel,
        x0: np.ndarray,
        x_ref: np.ndarray,
        u_ref: np.ndarray,
        contact: np.ndarray,
        friction: float | None = None,
    ) -> Solution:
        """Solve one problem; arguments as in `QuadraticProgram.update`. Never raises for what the numbers are."""
        n, program = self.config.steps, self.program
        program.update(model, x0, x_ref, u_ref, contact, friction)
        if not plausible(program.q, program.A.data, program.l, contact):
            return Solution(x_ref, u_ref, 0, solved=False, usable=False)
        z, iterations, solved, usable = self._solver.solve(program, np.concatenate([x_ref, u_ref]).ravel())
        return Solution(z[: n * NX].reshape(n, NX), z[n * NX :].reshape(n, NU), iterations, solved, usable)
