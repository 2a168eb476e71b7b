"""The whole-body program against an independent exact solution, the closed form, and the physics."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls

from experts.robot_model import Dynamics, RobotModel
from experts.whole_body.inverse_dynamics import equations, joint_torques
from experts.whole_body.jacobian_transpose import jacobian_transpose_torques
from experts.whole_body.qp import WholeBodyConfig, WholeBodyQP
from experts.whole_body.request import STANCE_DAMPING, Request
from go1_mtl_gym import robot
from go1_mtl_gym.errors import InvalidInputError

UNIT = np.repeat([10.0, 40.0], 12)  # of the program's variables: N m and N


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


def demands(model: RobotModel, states: list, kind: str) -> list[tuple]:
    """Arguments of `torques` at driven states: what the gait asks for, or much more of one kind."""
    rng, out = np.random.default_rng(0), []
    for state in states:
        stance = state.gait.stance(state.phase)
        share = 125.0 / max(stance.sum(), 1)
        forces = rng.normal(0, 0.1 * share, (4, 3)) + [0, 0, share]
        swing = rng.normal(0, 60, (4, 3))
        if kind == "force":
            forces *= 3.5 * (1 + stance.sum() // 3)
        elif kind == "swing":
            swing *= 5.0
        elif kind == "slip":
            forces[:, 0] += 60.0
        out.append((model.dynamics(state), forces, stance, swing))
    return out


def exact(qp: WholeBodyQP, call: tuple) -> np.ndarray:
    """The optimum by an active-set method: least distance programming (Lawson & Hanson 1974, chapter 23).

    With P = L L' and z = L' y + L^-1 q the program is min |z| over G z >= h, solved by non-negative least squares.
    """
    program, limited = qp.program(*call), np.ones(32, bool)
    limited[12:] = np.repeat(call[2], 5)
    rows = np.vstack([qp.A[limited], -qp.A[:12]])
    bounds = np.concatenate([program.l[limited], -program.u[:12]])
    root = np.linalg.cholesky(program.P)
    offset = np.linalg.solve(root, program.q)
    G = np.linalg.solve(root, rows.T).T
    h = bounds + G @ offset
    size, unit = np.linalg.norm(G, axis=1), np.abs(offset).max()
    E = np.vstack([G.T, h / unit]) / size
    residual = E @ nnls(E, np.eye(25)[24])[0] - np.eye(25)[24]
    return np.linalg.solve(root.T, -residual[:24] / residual[24] * unit - offset) * UNIT


def achieved(dynamics: Dynamics, torque: np.ndarray, stance: np.ndarray) -> np.ndarray:
    """Base acceleration, shape (6,), that torques give while feet in stance slow down as both laws assume.

    [M, -J'; J, 0] [vdot; f] = [S' tau - h; -10 v_foot - Jdot v].
    """
    rows = np.repeat(stance, 3)
    J, n = dynamics.jacobian[rows], int(rows.sum())
    system = np.block([[dynamics.mass_matrix, -J.T], [J, np.zeros((n, n))]])
    foot = (-STANCE_DAMPING * dynamics.feet_velocity_w - dynamics.drift).ravel()[rows]
    target = np.concatenate([np.r_[np.zeros(6), torque] - dynamics.bias, foot])
    return np.linalg.lstsq(system, target, rcond=None)[0][:6]


@pytest.mark.parametrize("kind", ["force", "swing", "slip"])
def test_torques_are_those_of_the_exact_solution(model, driven, kind):
    qp = WholeBodyQP()
    for call in demands(model, driven.states, kind):
        torque, _ = qp.torques(*call)
        np.testing.assert_allclose(torque, exact(qp, call)[:12], atol=0.05)
    assert qp.solves > 0 and qp.failures == 0


def test_solution_meets_the_optimality_conditions(model, trotting):
    """P y + q = A' lambda with lambda >= 0 at active lower bounds, <= 0 at upper ones, 0 elsewhere."""
    qp = WholeBodyQP(WholeBodyConfig(tolerance=1e-7, max_iterations=50000))
    for call in demands(model, trotting.states, "force"):
        program = qp.program(*call)
        y = qp._solve(program)
        value = qp.A @ y
        assert (value > program.l - 1e-5).all() and (value < program.u + 1e-5).all()
        gradient = program.P @ y + program.q
        lower, upper = value < program.l + 1e-4, value > program.u - 1e-4
        signed = np.vstack([qp.A[lower], -qp.A[upper], np.zeros((1, 24))])  # never empty: nnls would abort
        _, residual = nnls(signed.T, gradient)
        assert residual < 1e-3 * (1 + np.abs(program.q).max())


def test_within_limits_it_is_the_closed_form(model, driven):
    qp = WholeBodyQP()
    for dynamics, forces, stance, swing in demands(model, driven.states, "gentle"):
        call = dynamics, forces, stance, 0.2 * swing
        closed = joint_torques(*call)
        if (np.abs(closed[0]) >= robot.TORQUE_LIMIT).any():
            continue
        for ours, theirs in zip(qp.torques(*call), closed):
            np.testing.assert_array_equal(ours, theirs)
        solved = qp._solve(qp.program(*call))  # and so says the program itself
        np.testing.assert_allclose(solved[:12] * 10.0, closed[0], atol=0.05)
    assert qp.solves == 0


def test_dynamics_are_consistent(model, trotting):
    """The joint accelerations returned are those of the torques and of ground forces within the pyramid."""
    qp = WholeBodyQP()
    for call in demands(model, trotting.states, "force"):
        dynamics, _, stance, _ = call
        torque, acceleration = qp.torques(*call)
        force = exact(qp, call)[12:]
        vdot = np.linalg.solve(
            dynamics.mass_matrix, np.r_[np.zeros(6), torque] + dynamics.jacobian.T @ force - dynamics.bias
        )
        np.testing.assert_allclose(acceleration, vdot[6:], rtol=0.05, atol=5.0)
        assert not force.reshape(4, 3)[~stance].any()
        assert (np.abs(force.reshape(4, 3)[:, :2]).max(axis=1) <= 0.5 * force.reshape(4, 3)[:, 2] + 0.3).all()


def test_where_the_closed_form_clips_the_base_comes_closer_to_what_was_asked(model, driven):
    qp, scale = WholeBodyQP(), np.sqrt([1, 1, 1, 0.1, 0.1, 0.1])
    errors = []
    for call in demands(model, driven.states, "force"):
        dynamics, _, stance, _ = call
        clipped, _ = joint_torques(*call)
        if not stance.any() or (np.abs(clipped) < robot.TORQUE_LIMIT).all():
            continue
        target = np.linalg.solve(*equations(Request.of(*call)))[:6]
        torque, _ = qp.torques(*call)
        assert (np.abs(torque) <= robot.TORQUE_LIMIT).all()
        errors.append([np.linalg.norm(scale * (achieved(dynamics, t, stance) - target)) for t in (torque, clipped)])
    assert errors
    ours, theirs = np.mean(errors, axis=0)
    assert ours < theirs


def test_asking_twice_gives_the_same_bits(model, driven):
    calls = demands(model, driven.states, "force") + demands(model, driven.states, "swing")
    qp = WholeBodyQP()
    first = [qp.torques(*call) for call in calls]
    again = [qp.torques(*call) for call in calls[::-1]][::-1]
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(WholeBodyQP().torques(*calls[-1]), first[-1])


def test_a_copy_keeps_the_counts_and_answers_alike(model, trotting):
    calls, qp = demands(model, trotting.states, "force"), WholeBodyQP(WholeBodyConfig(friction=0.4))
    for call in calls[:6]:
        qp.torques(*call)
    assert qp.solves > 0
    for other in (copy.deepcopy(qp), pickle.loads(pickle.dumps(qp))):
        assert (other.config, other.solves, other.failures) == (qp.config, qp.solves, qp.failures)
        for call in calls[6:]:
            np.testing.assert_array_equal(other.torques(*call), WholeBodyQP(qp.config).torques(*call))


def test_unsolved_programs_are_answered_in_closed_form(model, trotting):
    calls = demands(model, trotting.states, "force")
    hurried = WholeBodyQP(WholeBodyConfig(max_iterations=10, tolerance=1e-9))
    for call in calls:
        np.testing.assert_array_equal(hurried.torques(*call), joint_torques(*call))
    assert 0 < hurried.failures <= len(calls)
    dynamics, forces, stance, swing = calls[0]
    for bad in (np.full((4, 3), 1e9), np.full((4, 3), np.nan)):
        qp = WholeBodyQP()
        qp.torques(dynamics, bad, np.ones(4, bool), swing)
        qp.torques(replace(dynamics, mass_matrix=np.eye(18)), bad, np.ones(4, bool), swing)
        assert qp.failures == 2
        after, fresh = qp.torques(*calls[1]), WholeBodyQP().torques(*calls[1])
        np.testing.assert_array_equal(after, fresh)


def test_impossible_settings_are_refused():
    for name, value in (("friction", 0.0), ("swing_weight", -1.0), ("max_iterations", 0), ("slack", -1.0)):
        with pytest.raises(InvalidInputError, match=name):
            WholeBodyConfig(**{name: value})


def test_jacobian_transpose_carries_the_weight(model, standing):
    """Standing, the legs are light: statics and the full dynamics agree to a few per cent."""
    dynamics = model.dynamics(standing)
    forces = np.tile([0.0, 0.0, robot.MASS * 9.81 / 4], (4, 1))
    call = dynamics, forces, np.ones(4, bool), np.zeros((4, 3))
    torque, acceleration = jacobian_transpose_torques(*call)
    np.testing.assert_allclose(torque, joint_torques(*call)[0], atol=0.3)
    np.testing.assert_allclose(acceleration, 0.0, atol=1e-9)
    by_hand = dynamics.bias[6:] - (dynamics.jacobian.T @ forces.ravel())[6:]
    np.testing.assert_allclose(torque, by_hand, atol=1e-12)


def test_jacobian_transpose_swings_a_leg_of_a_fixed_base(model, trotting):
    """With the base held, the swing torques give exactly the accelerations asked for."""
    rng, stance = np.random.default_rng(0), np.zeros(4, bool)
    for state in trotting.states:
        dynamics, swing = model.dynamics(state), rng.normal(0, 10, (4, 3))
        torque, acceleration = jacobian_transpose_torques(dynamics, np.zeros((4, 3)), stance, swing)
        assert (np.abs(torque) < robot.TORQUE_LIMIT).all(), "not saturated"
        qdd = np.linalg.solve(dynamics.mass_matrix[6:, 6:], torque - dynamics.bias[6:])
        np.testing.assert_allclose(qdd, acceleration, atol=1e-6)
        feet = (dynamics.jacobian[:, 6:] @ qdd).reshape(4, 3) + dynamics.drift
        np.testing.assert_allclose(feet, swing, atol=1e-6)
    torque, _ = jacobian_transpose_torques(dynamics, np.full((4, 3), 1e6), ~stance, swing)
    np.testing.assert_array_equal(np.abs(torque), robot.TORQUE_LIMIT)
