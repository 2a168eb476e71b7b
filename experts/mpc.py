"""The quadratic program of the MPC as data, and its OSQP workspace, set up once and updated.

Variables are the states x[1..N] and the inputs u[0..N-1] of `experts.dynamics`:

    minimise    sum_k (x[k] - x_ref[k])' Q (x[k] - x_ref[k]) / 2 + (u[k] - u_ref[k])' R (u[k] - u_ref[k]) / 2
    subject to  x[k+1] = A[k] x[k] + B[k] u[k] + c[k]
                |f_x| <= mu f_z,  |f_y| <= mu f_z,  f_min [s[k] = 1] <= f_z <= f_max s[k]      for each foot,

with s[k] the share of interval k that the foot spends on the ground: feet in the air get exactly no force.
"""

from dataclasses import dataclass, field

import numpy as np
import osqp
from scipy import sparse

from experts.dynamics import FORCE_UNIT, LinearModel
from go1_mtl_gym.validation import number_in

NX = NU = 12
LARGEST = 1e6
"""A problem with a larger number than this in it is refused; OSQP would take it silently and may stay stuck."""
INEXACT = 1e-2
"""Largest residual, in the units of the program, with which an unfinished solution is still used."""


@dataclass(frozen=True)
class MPCConfig:
    """Weights, limits and solver settings of the MPC.

    Attributes:
        steps: N, intervals over one gait cycle.
        state_weight: diagonal of Q for [roll pitch yaw | x y z | omega | velocity].
        input_weight: R, per squared unit of `FORCE_UNIT`.
        friction: mu of the pyramid.
        max_force: f_max of one foot [N].
        min_force: f_min of a foot that stays on the ground throughout an interval [N]; keeps contacts from chattering.
        tolerance: eps_abs and eps_rel of OSQP.
        rho: ADMM step of OSQP; fixed, so that a solution depends on its problem alone.
        max_iterations: of OSQP; what it has by then is used if its residuals are below `INEXACT`, else the solve
            failed.

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    steps: int = 16
    state_weight: tuple[float, ...] = (20.0, 20.0, 10.0, 10.0, 10.0, 60.0, 0.4, 0.4, 0.4, 20.0, 20.0, 2.0)
    input_weight: float = 0.2
    friction: float = 0.5
    max_force: float = 160.0
    min_force: float = 10.0
    tolerance: float = 3e-4
    rho: float = 2.0
    max_iterations: int = 500

    def __post_init__(self) -> None:
        number_in(self.steps, 4, 64, "steps")
        number_in(self.input_weight, 1e-6, 1e3, "input_weight")
        number_in(self.friction, 0.05, 2.0, "friction")
        number_in(self.max_force, 30.0, 1000.0, "max_force [N]")
        number_in(self.min_force, 0.0, 30.0, "min_force [N]")
        number_in(self.tolerance, 1e-9, 1e-1, "tolerance")
        number_in(self.rho, 1e-6, 1e6, "rho")
        number_in(self.max_iterations, 10, 1e6, "max_iterations")
        number_in(len(self.state_weight), NX, NX, "number of state weights")
        number_in(min(self.state_weight), 0.0, 1e6, "smallest state weight")


@dataclass(frozen=True)
class Solution:
    """What the solver returned.

    Attributes:
        forces_w: ground forces of the first interval, world [N], shape (4, 3).
        states: predicted x[1..N], shape (N, 12).
        inputs: u[0..N-1] in units of `FORCE_UNIT`, shape (N, 12).
        iterations: of the solver.
        solved: the solver met its tolerance.
        usable: it did, or came close (residuals below `INEXACT`), and everything is finite.
    """

    forces_w: np.ndarray
    states: np.ndarray
    inputs: np.ndarray
    iterations: int
    solved: bool
    usable: bool


@dataclass
class QuadraticProgram:
    """P, q, A, l, u of one MPC problem with a sparsity pattern that depends on N alone.

    Build once, then `update` in place for each problem.

    Args:
        config: sizes, weights and limits.

    Attributes:
        P: constant Hessian, upper triangle (it is diagonal), CSC.
        A: constraint matrix, CSC; its explicit zeros are part of the pattern.
        q, l, u: vectors.
    """

    config: MPCConfig
    P: sparse.csc_matrix = field(init=False)
    A: sparse.csc_matrix = field(init=False)
    q: np.ndarray = field(init=False)
    l: np.ndarray = field(init=False)  # noqa: E741 (the field's letter)
    u: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        n = self.config.steps
        self._weight = np.concatenate([np.tile(self.config.state_weight, n), np.full(n * NU, self.config.input_weight)])
        self.P = sparse.diags(self._weight, format="csc")
        dynamics = _linear_model_pattern()
        identity = sparse.eye(n * NX)
        states = identity + sparse.kron(sparse.eye(n, k=-1), dynamics.A[0])
        inputs = sparse.kron(sparse.eye(n), dynamics.B[0])
        friction = sparse.hstack([sparse.csc_matrix((20 * n, n * NX)), sparse.kron(sparse.eye(4 * n), self._pyramid())])
        pattern = sparse.csc_matrix(sparse.vstack([sparse.hstack([states, inputs]), friction]))
        # number the entries, to learn where each entry of A[k] and B[k] stands in the data of the CSC matrix
        numbered = pattern.copy()
        numbered.data = np.arange(1.0, pattern.nnz + 1)
        dense = numbered.toarray().astype(int) - 1
        self._slot_a = np.stack([dense[NX * k : NX * (k + 1), NX * (k - 1) : NX * k] for k in range(1, n)])
        first = n * NX
        self._slot_b = np.stack([dense[NX * k : NX * (k + 1), first + NU * k : first + NU * (k + 1)] for k in range(n)])
        self._used_a, self._used_b = self._slot_a >= 0, self._slot_b >= 0
        self._slot_a, self._slot_b = self._slot_a[self._used_a], self._slot_b[self._used_b]
        self.A = pattern
        self.q = np.zeros(n * (NX + NU))
        self.l = np.concatenate([np.zeros(n * NX), np.tile([0.0, 0.0, 0.0, 0.0, 0.0], 4 * n)])
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
        n = self.config.steps
        self.A.data[self._slot_a] = -model.A[1:][self._used_a]
        self.A.data[self._slot_b] = -model.B[self._used_b]
        self.q[:] = -self._weight * np.concatenate([x_ref.ravel(), u_ref.ravel()])
        offset = model.c.copy()
        offset[0] += model.A[0] @ x0
        self.l[: n * NX] = self.u[: n * NX] = offset.ravel()
        self.l[n * NX + 4 :: 5] = (contact.ravel() > 1 - 1e-9) * (self.config.min_force / FORCE_UNIT)
        self.u[n * NX + 4 :: 5] = contact.ravel() * (self.config.max_force / FORCE_UNIT)


def _linear_model_pattern() -> LinearModel:
    """Ones wherever the discretised model can be non-zero."""
    A = np.zeros((12, 12))
    A[0:3, 6:9] = A[6:9, 3:6] = 1.0
    A[3:6, 9:12] = np.eye(3)
    B = np.zeros((12, 12))
    B[6:9] = 1.0
    B[9:12] = np.tile(np.eye(3), 4)
    step = np.eye(12) + A + A @ A
    return LinearModel(A=(step != 0)[None].astype(float), B=(B + A @ B != 0)[None].astype(float), c=np.zeros((1, 12)))


class MPC:
    """Solves `QuadraticProgram`s in one OSQP workspace that is set up once and only updated afterwards.

    Each solve starts from the reference itself with zero multipliers, not from the previous solution: with a fixed rho
    the answer then depends on the problem alone, and asking twice gives the same bits.

    Args:
        config: sizes, weights, limits and solver settings.
    """

    def __init__(self, config: MPCConfig | None = None) -> None:
        self.config = config or MPCConfig()
        self.program = QuadraticProgram(self.config)
        self._solver = osqp.OSQP()
        program = self.program
        self._solver.setup(
            program.P,
            program.q,
            program.A,
            program.l,
            program.u,
            verbose=False,
            scaling=0,
            adaptive_rho=0,
            rho=self.config.rho,
            eps_abs=self.config.tolerance,
            eps_rel=self.config.tolerance,
            max_iter=self.config.max_iterations,
            check_termination=10,
            polishing=False,
            warm_starting=True,
        )
        self._multipliers = np.zeros(program.A.shape[0])

    def solve(
        self, model: LinearModel, x0: np.ndarray, x_ref: np.ndarray, u_ref: np.ndarray, contact: np.ndarray
    ) -> Solution:
        """Solve one problem; arguments as in `QuadraticProgram.update`. Never raises for what the numbers are."""
        n = self.config.steps
        program = self.program
        program.update(model, x0, x_ref, u_ref, contact)
        if not all((np.abs(part) < LARGEST).all() for part in (program.q, program.A.data, program.l, contact)):
            return Solution(np.zeros((4, 3)), x_ref, u_ref, 0, solved=False, usable=False)
        self._solver.update(q=program.q, l=program.l, u=program.u, Ax=program.A.data)
        self._solver.warm_start(x=np.concatenate([x_ref.ravel(), u_ref.ravel()]), y=self._multipliers)
        result = self._solver.solve(raise_error=False)
        info = result.info
        finite = bool(np.isfinite(result.x).all())
        solved = finite and info.status_val == osqp.SolverStatus.OSQP_SOLVED
        close = finite and max(info.prim_res, info.dual_res) < INEXACT
        states = result.x[: n * NX].reshape(n, NX)
        inputs = result.x[n * NX :].reshape(n, NU)
        return Solution(inputs[0].reshape(4, 3) * FORCE_UNIT, states, inputs, int(info.iter), solved, solved or close)
