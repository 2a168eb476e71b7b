"""The quadratic program of the MPC as data.

Variables are the states x[1..N] and the inputs u[0..N-1] of `experts.mpc.srbd`:

    minimize    sum_k (x[k] - x_ref[k])' Q (x[k] - x_ref[k]) / 2 + (u[k] - u_ref[k])' R (u[k] - u_ref[k]) / 2
    subject to  x[k+1] = A[k] x[k] + B[k] u[k] + c[k]
                |f_x| <= mu f_z,  |f_y| <= mu f_z,  f_min [s[k] = 1] <= f_z <= f_max s[k]      for each foot,

with s[k] the fraction of interval k that the foot spends on the ground, so that feet in the air get no force, and mu
the configured coefficient of friction, or a smaller one that the expert is told of. (The program of J. Di Carlo et al.,
IROS 2018, with the states kept as variables, which leaves it sparse.)
"""

from dataclasses import dataclass, field

import numpy as np
from scipy import sparse

from experts.friction import NORMAL_ROW, ROWS_PER_FOOT, friction_pyramid
from experts.mpc.config import NU, NX, MPCConfig
from experts.mpc.srbd import COM, FORCE_UNIT, OMEGA, RPY, VELOCITY, LinearModel

LIMIT_ROWS = 4 * ROWS_PER_FOOT
"""Rows that limit the four forces of one interval."""


@dataclass
class QuadraticProgram:
    """P, q, A, l, u of one MPC problem with a sparsity pattern that depends on N alone.

    Build once, then `update` in place for each problem.

    Args:
        config: sizes, weights and limits.

    Attributes:
        P: constant Hessian (it is diagonal), CSC, shape (24 N, 24 N).
        A: constraint matrix, CSC, shape (32 N, 24 N); the first 12 N rows are the dynamics, then come 20 per interval,
            five per foot. Its explicit zeros are part of the pattern.
        q, l, u: vectors.
        weight: diagonal of P, shape (24 N,).
    """

    config: MPCConfig
    P: sparse.csc_matrix = field(init=False)
    A: sparse.csc_matrix = field(init=False)
    q: np.ndarray = field(init=False)
    l: np.ndarray = field(init=False)
    u: np.ndarray = field(init=False)
    weight: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        n = self.config.steps
        self.weight = np.concatenate([np.tile(self.config.state_weight, n), np.full(n * NU, self.config.input_weight)])
        self.P = sparse.diags(self.weight, format="csc")
        self.A = sparse.csc_matrix(self._pattern())
        self._find_blocks()
        limits = np.full(ROWS_PER_FOOT, np.inf)
        limits[NORMAL_ROW] = 0.0
        self.q = np.zeros(n * (NX + NU))
        self.l = np.zeros(n * (NX + LIMIT_ROWS))
        self.u = np.concatenate([np.zeros(n * NX), np.tile(limits, 4 * n)])

    @property
    def state_size(self) -> int:
        """12 N: how many of the variables are states, and how many of the rows are dynamics."""
        return self.config.steps * NX

    def contacts(self) -> np.ndarray:
        """Which foot and interval pairs may push, bool, shape (4 N,), intervals first."""
        return self.u[self.state_size + NORMAL_ROW :: ROWS_PER_FOOT] > 0

    def update(
        self,
        model: LinearModel,
        x0: np.ndarray,
        x_ref: np.ndarray,
        u_ref: np.ndarray,
        contact: np.ndarray,
        friction: float | None = None,
    ) -> None:
        """Write one problem into q, A, l, u.

        Args:
            model: along the horizon.
            x0: state now, shape (12,).
            x_ref: reference of x[1..N], shape (N, 12).
            u_ref: reference of the inputs in units of `FORCE_UNIT`, shape (N, 12).
            contact: fractions of each interval with ground contact, shape (N, 4).
            friction: coefficient of the ground, if it is known; the smaller one of it and the configured one limits.
        """
        end, configured = self.state_size, self.config.friction
        self.A.data[self._to_mu] = configured if friction is None else min(configured, friction)
        self.A.data[self._to_a] = -model.A[1:].ravel().take(self._from_a)
        self.A.data[self._to_b] = -model.B.ravel().take(self._from_b)
        self.q[:end], self.q[end:] = x_ref.ravel(), u_ref.ravel()
        # The expanded squares: q = -Q x_ref and -R u_ref; what depends on neither x nor u is left out.
        self.q *= -self.weight
        # x0 is known, so A[0] x0 goes to the right-hand side instead of into the matrix.
        offset = model.c.ravel().copy()
        offset[:NX] += model.A[0] @ x0
        self.l[:end] = self.u[:end] = offset
        on_ground = contact.ravel()
        normal = slice(end + NORMAL_ROW, None, ROWS_PER_FOOT)
        # A foot that lands or lifts off within an interval may push less than f_min, or not at all.
        self.l[normal] = (on_ground > 1 - 1e-9) * (self.config.min_force / FORCE_UNIT)
        self.u[normal] = on_ground * (self.config.max_force / FORCE_UNIT)

    def _pattern(self) -> np.ndarray:
        """A with ones wherever a problem's numbers will stand, dense."""
        n = self.config.steps
        state, force = _linear_model_pattern()
        rows = np.zeros((n * (NX + LIMIT_ROWS), n * (NX + NU)))
        pyramids = np.kron(np.eye(4), friction_pyramid(self.config.friction))
        for k in range(n):
            after, pushed, limits = self._after(k), self._pushed(k), n * NX + LIMIT_ROWS * k
            rows[after, after], rows[after, pushed] = np.eye(NX), force
            rows[limits : limits + LIMIT_ROWS, pushed] = pyramids
            if k:
                rows[after, self._after(k - 1)] = state
        return rows

    def _find_blocks(self) -> None:
        """Learn where each entry of A[k], B[k] and each mu stands in the data of the CSC matrix, by numbering them."""
        n, numbered = self.config.steps, self.A.copy()
        numbered.data = np.arange(1.0, numbered.nnz + 1)
        number = numbered.toarray().astype(int) - 1
        blocks_a = np.stack([number[self._after(k), self._after(k - 1)] for k in range(1, n)])
        blocks_b = np.stack([number[self._after(k), self._pushed(k)] for k in range(n)])
        self._from_a, self._from_b = np.flatnonzero(blocks_a >= 0), np.flatnonzero(blocks_b >= 0)
        self._to_a, self._to_b = blocks_a.ravel()[self._from_a], blocks_b.ravel()[self._from_b]
        sides = [n * NX + ROWS_PER_FOOT * foot + row for foot in range(4 * n) for row in range(NORMAL_ROW)]
        normal_forces = [self.state_size + 3 * foot + 2 for foot in range(4 * n) for _ in range(NORMAL_ROW)]
        self._to_mu = number[sides, normal_forces]

    def _after(self, k: int) -> slice:
        """Where x[k + 1] stands among the variables, and its dynamics among the rows."""
        return slice(NX * k, NX * (k + 1))

    def _pushed(self, k: int) -> slice:
        """Where u[k] stands among the variables."""
        return slice(self.state_size + NU * k, self.state_size + NU * (k + 1))


def _linear_model_pattern() -> tuple[np.ndarray, np.ndarray]:
    """Ones wherever the discretized model's A and B can be non-zero, each of shape (12, 12)."""
    A, B = np.eye(NX), np.zeros((NX, NU))
    for rows, columns in ((RPY, RPY), (RPY, COM), (RPY, OMEGA), (OMEGA, OMEGA), (OMEGA, COM), (OMEGA, VELOCITY)):
        A[rows, columns] = 1.0
    A[COM, VELOCITY] = np.eye(3)
    B[RPY] = B[OMEGA] = 1.0
    B[COM] = B[VELOCITY] = np.tile(np.eye(3), 4)
    return A, B
