"""The quadratic program as data: objective, constraints, pattern."""

import numpy as np
import pytest

from experts.mpc.config import NU, NX, MPCConfig
from experts.mpc.program import QuadraticProgram
from experts.mpc.srbd import FORCE_UNIT

N = MPCConfig().steps


def program_of(problem: tuple) -> QuadraticProgram:
    program = QuadraticProgram(MPCConfig())
    program.update(*problem)
    return program


def test_the_program_is_the_one_in_the_docstring(driven):
    """Objective and constraints, from the problem's arrays, at a random point."""
    rng, config = np.random.default_rng(0), MPCConfig()
    model, x0, x_ref, u_ref, contact = driven.problems[-1]
    program = program_of(driven.problems[-1])
    x, u = x_ref + 0.1 * rng.normal(size=(N, NX)), u_ref + 0.1 * rng.normal(size=(N, NU))
    u.reshape(N, 4, 3)[contact == 0] = 0.0
    z = np.concatenate([x.ravel(), u.ravel()])

    def cost(x, u):
        return (np.square(x - x_ref) @ config.state_weight).sum() / 2 + 0.4 * np.square(u - u_ref).sum() / 2

    ours = z @ (program.P @ z) / 2 + program.q @ z
    assert ours + cost(0 * x, 0 * u) == pytest.approx(cost(x, u), rel=1e-9)
    before = np.vstack([x0, x[:-1]])
    gap = x - np.einsum("kij,kj->ki", model.A, before) - np.einsum("kij,kj->ki", model.B, u) - model.c
    rows = program.A @ z
    np.testing.assert_allclose((rows - program.l)[: N * NX], gap.ravel(), atol=1e-9)
    np.testing.assert_array_equal(program.l[: N * NX], program.u[: N * NX])
    f = u.reshape(N, 4, 3)
    pyramid = np.stack([0.5 * f[..., 2] + sign * f[..., axis] for axis in (0, 1) for sign in (1, -1)], axis=-1)
    ground = rows[N * NX :].reshape(N, 4, 5)
    np.testing.assert_allclose(ground[..., :4], pyramid, atol=1e-12)
    np.testing.assert_array_equal(ground[..., 4], f[..., 2])
    low, high = program.l[N * NX :].reshape(N, 4, 5), program.u[N * NX :].reshape(N, 4, 5)
    assert (low[..., :4] == 0).all() and np.isinf(high[..., :4]).all()
    np.testing.assert_allclose(high[..., 4] * FORCE_UNIT, 160 * contact)
    np.testing.assert_allclose(low[..., 4] * FORCE_UNIT, np.where(contact > 1 - 1e-9, 15.0, 0.0))


def test_sparsity_pattern_does_not_depend_on_the_problem(driven):
    program = QuadraticProgram(MPCConfig())
    indices, pointers = program.A.indices.copy(), program.A.indptr.copy()
    for problem in driven.problems:
        program.update(*problem)
    np.testing.assert_array_equal(program.A.indices, indices)
    np.testing.assert_array_equal(program.A.indptr, pointers)
    assert program.A.shape == (N * (NX + 20), N * (NX + NU))
    dense, (model, *_, contact) = program.A.toarray(), driven.problems[-1]
    for k in range(1, N):
        rows = slice(12 * k, 12 * k + 12)
        np.testing.assert_array_equal(dense[rows, 12 * k - 12 : 12 * k], -model.A[k])
        felt = np.repeat(contact[k] > 0, 3)  # columns of feet in the air do not matter
        block = dense[rows, N * 12 + 12 * k : N * 12 + 12 * k + 12]
        np.testing.assert_array_equal(block[:, felt], -model.B[k][:, felt])
