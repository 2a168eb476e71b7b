"""The quadratic program of the MPC as data, and the MPC that has it solved.

Variables are the states x[1..N] and the inputs u[0..N-1] of `experts.dynamics`:

    minimise    sum_k (x[k] - x_ref[k])' Q (x[k] - x_ref[k]) / 2 + (u[k] - u_ref[k])' R (u[k] - u_ref[k]) / 2
    subject to  x[k+1] = A[k] x[k] + B[k] u[k] + c[k]
                |f_x| <= mu f_z,  |f_y| <= mu f_z,  f_min [s[k] = 1] <= f_z <= f_max s[k]      for each foot,

with s[k] the share of interval k that the foot spends on the ground, so that feet in the air get no force.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy import sparse

from experts.dynamics import COM, FORCE_UNIT, OMEGA, RPY, VELOCITY, LinearModel
from experts.solvers import SOLVERS, QPSolver
from go1_mtl_gym.validation import number_in, one_of

NX = NU = 12
LARGEST = 1e6
"""A problem with a larger number than this in it is refused; OSQP would take it silently and may stay stuck."""


@dataclass(frozen=True)
class MPCConfig:
    """Weights, limits and solver settings of the MPC.

    Attributes:
        steps: N, intervals over one gait cycle.
        state_weight: diagonal of Q for [roll pitch yaw | x y z | omega | velocity].
        input_weight: R, per squared unit of `FORCE_UNIT`.
        friction: mu of the pyramid.
        max_force: f_max of one foot [N].
        min_force: f_min of a foot that stays on the ground throughout an interval [N]; keeps contacts from chattering,
            and the lightly loaded third foot of a walk from bouncing.
        solver: "osqp", or one of the exact solvers "piqp" and "daqp" (extra ``solvers``).
        tolerance: eps_abs and eps_rel of OSQP, for its scaled problem.
        rho: ADMM step of OSQP; fixed, so that a solution depends on its problem alone.
        relaxation: alpha of OSQP.
        max_iterations: of OSQP.

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    steps: int = 16
    state_weight: tuple[float, ...] = (20.0, 20.0, 10.0, 10.0, 10.0, 60.0, 0.4, 0.4, 0.4, 12.0, 12.0, 2.0)
    input_weight: float = 0.4
    friction: float = 0.5
    max_force: float = 160.0
    min_force: float = 15.0
    solver: str = "osqp"
    tolerance: float = 6e-4
    rho: float = 1.4
    relaxation: float = 1.3
    max_iterations: int = 300

    def __post_init__(self) -> None:
        number_in(self.steps, 4, 64, "steps")
        number_in(self.input_weight, 1e-6, 1e3, "input_weight")
        number_in(self.friction, 0.05, 2.0, "friction")
        number_in(self.max_force, 30.0, 1000.0, "max_force [N]")
        number_in(self.min_force, 0.0, 30.0, "min_force [N]")
        number_in(self.tolerance, 1e-9, 1e-1, "tolerance")
        number_in(self.rho, 1e-6, 1e6, "rho")
        number_in(self.relaxation, 0.5, 1.95, "relaxation")
        number_in(self.max_iterations, 10, 1e6, "max_iterations")
        number_in(len(self.state_weight), NX, NX, "number of state weights")
        number_in(min(self.state_weight), 1e-6, 1e6, "smallest state weight")
        one_of(self.solver, tuple(SOLVERS), "solver")


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


@dataclass
class QuadraticProgram:
    """P, q, A, l, u of one MPC problem with a sparsity pattern that depends on N alone.

    Build once, then `update` in place for each problem.

    Args:
        config: sizes, weights and limits.

    Attributes:
        P: constant Hessian (it is diagonal), CSC.
        A: constraint matrix, CSC; the first 12 N rows are the dynamics. Its explicit zeros are part of the pattern.
        q, l, u: vectors.
        weight: diagonal of P, shape (24 N,).
    """

    config: MPCConfig
    P: sparse.csc_matrix = field(init=False)
    A: sparse.csc_matrix = field(init=False)
    q: np.ndarray = field(init=False)
    l: np.ndarray = field(init=False)  # noqa: E741 (the field's letter)
    u: np.ndarray = field(init=False)
    weight: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        n = self.config.steps
        self.weight = np.concatenate([np.tile(self.config.state_weight, n), np.full(n * NU, self.config.input_weight)])
        self.P = sparse.diags(self.weight, format="csc")
        state, force = _linear_model_pattern()
        rows = np.zeros((n * (NX + 20), n * (NX + NU)))
        identity, pyramids = np.eye(NX), np.kron(np.eye(4), self._pyramid())
        for k in range(n):
            at, on, ineq = slice(NX * k, NX * (k + 1)), slice(NX * (n + k), NX * (n + k + 1)), n * NX + 20 * k
            rows[at, at], rows[at, on], rows[ineq : ineq + 20, on] = identity, force, pyramids
            if k:
                rows[at, NX * (k - 1) : NX * k] = state
        self.A = sparse.csc_matrix(rows)
        # number the entries, to learn where each entry of A[k] and B[k] stands in the data of the CSC matrix
        numbered = self.A.copy()
        numbered.data = np.arange(1.0, numbered.nnz + 1)
        number = numbered.toarray().astype(int) - 1
        blocks_a = np.stack([number[NX * k : NX * (k + 1), NX * (k - 1) : NX * k] for k in range(1, n)])
        blocks_b = np.stack([number[NX * k : NX * (k + 1), NX * (n + k) : NX * (n + k + 1)] for k in range(n)])
        self._from_a, self._from_b = np.flatnonzero(blocks_a >= 0), np.flatnonzero(blocks_b >= 0)
        self._to_a, self._to_b = blocks_a.ravel()[self._from_a], blocks_b.ravel()[self._from_b]
        self.q = np.zeros(n * (NX + NU))
        self.l = np.zeros(n * (NX + 20))
        self.u = np.concatenate([np.zeros(n * NX), np.tile([np.inf, np.inf, np.inf, np.inf, 0.0], 4 * n)])

    def _pyramid(self) -> np.ndarray:
        mu = self.config.friction
        return np.array([[1.0, 0, mu], [-1.0, 0, mu], [0, 1.0, mu], [0, -1.0, mu], [0, 0, 1.0]])

    def update(
        self, model: LinearModel, x0: np.ndarray, x_ref: np.ndarray, u_ref: np.ndarray, contact: np.ndarray
    ) -> None:
        """Write one problem into q, A, l, u.

        Args:
            model: along the horizon.
            x0: state now, shape (12,).
            x_ref: reference of x[1..N], shape (N, 12).
            u_ref: reference of the inputs in units of `FORCE_UNIT`, shape (N, 12).
            contact: shares of ground contact, shape (N, 4).
        """
        end = self.config.steps * NX
        self.A.data[self._to_a] = -model.A[1:].ravel().take(self._from_a)
        self.A.data[self._to_b] = -model.B.ravel().take(self._from_b)
        self.q[:end], self.q[end:] = x_ref.ravel(), u_ref.ravel()
        self.q *= -self.weight
        offset = model.c.ravel().copy()
        offset[:NX] += model.A[0] @ x0
        self.l[:end] = self.u[:end] = offset
        share = contact.ravel()
        self.l[end + 4 :: 5] = (share > 1 - 1e-9) * (self.config.min_force / FORCE_UNIT)
        self.u[end + 4 :: 5] = share * (self.config.max_force / FORCE_UNIT)


def _linear_model_pattern() -> tuple[np.ndarray, np.ndarray]:
    """Ones wherever the discretised model's A and B can be non-zero, each of shape (12, 12)."""
    A, B = np.eye(12), np.zeros((12, 12))
    for rows, columns in ((RPY, RPY), (RPY, COM), (RPY, OMEGA), (OMEGA, OMEGA), (OMEGA, COM), (OMEGA, VELOCITY)):
        A[rows, columns] = 1.0
    A[COM, VELOCITY] = np.eye(3)
    B[RPY] = B[OMEGA] = 1.0
    B[COM] = B[VELOCITY] = np.tile(np.eye(3), 4)
    return A, B


class MPC:
    """Solves `QuadraticProgram`s; the answer depends on the problem alone, to the bit.

    Args:
        config: sizes, weights, limits and solver settings.

    Raises:
        ImportError: if the configured solver is not installed.
    """

    def __init__(self, config: MPCConfig | None = None) -> None:
        self.config = config or MPCConfig()
        self.program = QuadraticProgram(self.config)
        self._solver: QPSolver = SOLVERS[self.config.solver](self.program)

    def solve(
        self, model: LinearModel, x0: np.ndarray, x_ref: np.ndarray, u_ref: np.ndarray, contact: np.ndarray
    ) -> Solution:
        """Solve one problem; arguments as in `QuadraticProgram.update`. Never raises for what the numbers are."""
        n, program = self.config.steps, self.program
        program.update(model, x0, x_ref, u_ref, contact)
        if not all(np.abs(part).max() < LARGEST for part in (program.q, program.A.data, program.l, contact)):
            return Solution(x_ref, u_ref, 0, solved=False, usable=False)
        z, iterations, solved, usable = self._solver.solve(program, np.concatenate([x_ref, u_ref]).ravel())
        return Solution(z[: n * NX].reshape(n, NX), z[n * NX :].reshape(n, NU), iterations, solved, usable)
