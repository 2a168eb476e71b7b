"""The expert as a function of the state: the same bits, no memory, symmetries, and what it does when things fail."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from experts import NMPCConfig, NMPCExpert
from experts.mpc.controller import Solution
from experts.mpc.srbd import FORCE_UNIT
from experts.whole_body.joint_resistance import joint_resistance
from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.state import RobotState

PARTS = ["position_w", "quat_wxyz", "linear_velocity_w", "angular_velocity_b", "q", "v", "command"]


def fresh(state: RobotState) -> NMPCExpert:
    expert = NMPCExpert()
    expert.reset(state)
    return expert


def displaced(state: RobotState, yaw: float, shift: np.ndarray) -> RobotState:
    """The same robot elsewhere, facing elsewhere."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn, quat = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]), np.empty(4)
    mujoco.mju_mulQuat(quat, np.array([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]), state.quat_wxyz)
    return replace(
        state,
        position_w=turn @ state.position_w + shift,
        quat_wxyz=quat,
        linear_velocity_w=turn @ state.linear_velocity_w,
    )


def test_asking_twice_gives_the_same_bits(expert, driven):
    for state in driven.states:
        np.testing.assert_array_equal(expert.action(state), expert.action(state))


def test_what_was_asked_before_does_not_matter(driven):
    expert = fresh(driven.states[0])
    in_order = [expert.action(state) for state in driven.states]
    backwards = [expert.action(state) for state in driven.states[::-1]][::-1]
    np.testing.assert_array_equal(in_order, backwards)
    np.testing.assert_array_equal(fresh(driven.states[-1]).action(driven.states[-1]), in_order[-1])


def test_states_are_not_written_to(expert, driven):
    state = driven.states[0]
    kept = {name: getattr(state, name).copy() for name in PARTS}
    expert.action(state)
    for name, value in kept.items():
        np.testing.assert_array_equal(getattr(state, name), value)


@pytest.mark.parametrize("hold_s", [0.02, 0.001, 0.0])
def test_action_aims_at_the_middle_of_the_hold(trotting, hold_s):
    gains = PDGains(40.0, 1.5)
    expert = NMPCExpert(gains, hold_s=hold_s)
    for state in trotting.states:
        torque, acceleration = expert.torque(state)
        half = hold_s / 2
        q_mid = state.q + half * state.v + half**2 / 2 * acceleration
        v_mid = state.v + half * acceleration
        by_hand = q_mid + (torque + 1.5 * v_mid) / 40.0
        np.testing.assert_allclose(expert.action(state), by_hand, atol=1e-12)
    if hold_s == 0.0:
        np.testing.assert_allclose(by_hand, state.q + (torque + 1.5 * state.v) / 40.0, atol=1e-12)


def test_torques_are_within_limits_and_swing_feet_get_no_force(expert, driven):
    for state in driven.states:
        torque, _ = expert.torque(state)
        assert (np.abs(torque) <= robot.TORQUE_LIMIT).all()
        forces = expert.forces(state, expert._model.dynamics(state))
        in_air = state.gait.contact_schedule(state.phase, state.gait.period / 16, 1)[0] == 0
        assert not forces[in_air].any()


@pytest.mark.parametrize("name", [*PARTS, "phase"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_state_that_is_not_finite_is_answered_with_the_home_pose(standing, name, bad):
    expert = fresh(standing)
    before = expert.action(standing)
    value = bad if name == "phase" else np.r_[getattr(standing, name)[:-1], bad]
    np.testing.assert_array_equal(expert.action(replace(standing, **{name: value})), robot.HOME_POSE)
    assert (expert.counters.calls, expert.counters.bad_states, expert.counters.solver_failures) == (2, 1, 0)
    np.testing.assert_array_equal(expert.action(standing), before)


@pytest.mark.parametrize("change", [{"position_w": np.full(3, 1e30)}, {"v": np.full(12, 1e200)}], ids=["far", "fast"])
def test_a_state_that_is_finite_but_absurd_is_answered_too(standing, change):
    with np.errstate(all="ignore"):
        assert np.isfinite(fresh(standing).action(replace(standing, **change))).all()


def failing(monkeypatch, expert: NMPCExpert, after: int = 0) -> None:
    """Let every solve fail, but for the first few."""
    solve, count = expert._mpc.solve, iter(range(10**6))

    def fail(*problem, **told):
        if next(count) < after:
            return solve(*problem, **told)
        return Solution(np.full((16, 12), np.nan), np.full((16, 12), np.nan), 300, solved=False, usable=False)

    monkeypatch.setattr(expert._mpc, "solve", fail)


def test_a_failed_solve_is_answered_with_the_nominal_load(driven, monkeypatch):
    """A function of the state: what was solved before leaves no trace."""
    expert, unlucky = fresh(driven.states[0]), fresh(driven.states[0])
    failing(monkeypatch, unlucky)
    for state in driven.states:
        expert.action(state)
    failing(monkeypatch, expert)
    for state in driven.states:
        forces = expert.forces(state, expert._model.dynamics(state))
        np.testing.assert_array_equal(forces, unlucky.forces(state, unlucky._model.dynamics(state)))
        half = state.phase + 0.5 / 16
        share = expert.motion(state).force_at(np.array([half]))[0]
        np.testing.assert_allclose(forces[:, 2], share[:, 2] * robot.MASS * 9.81, atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(forces[:, :2], axis=1), 125.0 * np.hypot(*share[:, :2].T), atol=0.1)
        assert np.isfinite(expert.action(state)).all()
    assert unlucky.counters.solver_failures == unlucky.counters.solves == len(driven.states)
    monkeypatch.undo()
    np.testing.assert_array_equal(expert.action(state), fresh(state).action(state))


def test_a_standing_robot_whose_solve_fails_shares_the_weight_evenly(standing, monkeypatch):
    expert = fresh(standing)
    failing(monkeypatch, expert)
    forces = expert.forces(standing, expert._model.dynamics(standing))
    np.testing.assert_allclose(forces, np.tile([0, 0, robot.MASS * 9.81 / 4], (4, 1)), atol=1e-9)
    assert np.isfinite(expert.action(standing)).all()


def test_a_later_qp_that_fails_is_a_failure_too(trotting, monkeypatch):
    state = trotting.states[6]
    once, twice = (NMPCExpert(config=NMPCConfig(sqp_tolerance=0.0)) for _ in range(2))
    failing(monkeypatch, once, after=1)
    failing(monkeypatch, twice)
    np.testing.assert_array_equal(once.action(state), twice.action(state))
    assert (once.counters.solves, once.counters.solver_failures) == (2, 1)


def test_inexact_solves_are_counted_and_used(standing, monkeypatch):
    expert = fresh(standing)
    inputs = np.tile([0.0, 0.0, 0.5], (16, 4))
    close = Solution(np.tile(standing.rpy[0], (16, 12)), inputs, 300, solved=False, usable=True)
    monkeypatch.setattr(expert._mpc, "solve", lambda *problem, **told: close)
    forces = expert.forces(standing, expert._model.dynamics(standing))
    np.testing.assert_array_equal(forces, np.tile([0.0, 0.0, 0.5 * FORCE_UNIT], (4, 1)))
    assert expert.counters.inexact_solves == expert.counters.solves > 0
    assert expert.counters.solver_failures == 0


def test_reset_clears_the_counters(standing):
    expert = fresh(standing)
    expert.action(standing)
    assert expert.counters.calls == 1 and expert.counters.iterations > 0
    expert.reset(standing)
    assert expert.counters.calls == expert.counters.iterations == 0


@pytest.mark.parametrize(("yaw", "distance"), [(0.0, 1000.0), (np.pi / 2, 0.0), (-0.7, 0.0), (2.5, 30.0)])
def test_where_the_robot_stands_and_faces_does_not_matter(expert, driven, yaw, distance):
    for state in driven.states:
        moved = displaced(state, yaw, np.array([distance, -distance, 0.0]))
        np.testing.assert_allclose(expert.action(moved), expert.action(state), atol=1e-9)


def mirrored(state: RobotState) -> RobotState:
    """The mirror image in the plane y = 0, half a trot later, when the other diagonal does the same."""
    flip = np.array([1.0, -1.0, 1.0])
    joints = np.array([-1.0, 1.0, 1.0])
    w, x, y, z = state.quat_wxyz
    return replace(
        state,
        position_w=state.position_w * flip,
        quat_wxyz=np.array([w, -x, y, -z]),
        linear_velocity_w=state.linear_velocity_w * flip,
        angular_velocity_b=-state.angular_velocity_b * flip,
        q=mirrored_joints(state.q, joints),
        v=mirrored_joints(state.v, joints),
        contacts=state.contacts[[1, 0, 3, 2]],
        phase=(state.phase + 0.5) % 1.0,
        command=state.command * [1, -1, -1],
    )


def mirrored_joints(values: np.ndarray, signs: np.ndarray) -> np.ndarray:
    return (values.reshape(4, 3)[[1, 0, 3, 2]] * signs).ravel()


def test_a_trots_left_is_its_right(expert, trotting):
    """Nearly: the trunk's centre of mass lies 2 mm off the middle."""
    for state in trotting.states:
        ours, theirs = expert.action(state), expert.action(mirrored(state))
        np.testing.assert_allclose(mirrored_joints(theirs, np.array([-1.0, 1, 1])), ours, atol=0.06)
        assert np.abs(theirs - ours).max() > 0.1, "the mirror image is another state"


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ({"com_height": 0.5}, "com_height"), ({"linearization": "yesterday"}, "linearization.*yesterday"),
        ({"sqp_iterations": 0}, "sqp_iterations"), ({"sqp_tolerance": -1.0}, "sqp_tolerance"),
        ({"whole_body": "magic"}, "whole_body.*magic"), ({"mpc_hz": 1.0}, "mpc_hz"),
        ({"mpc_hz": float("nan")}, "mpc_hz"),
    ],
)  # fmt: skip
def test_impossible_settings_are_refused(setting, words):
    with pytest.raises(InvalidInputError, match=words):
        NMPCConfig(**setting)


@pytest.mark.parametrize("hold_s", [1.0, -0.01, np.nan])
def test_impossible_holds_are_refused(hold_s):
    with pytest.raises(InvalidInputError, match="hold_s"):
        NMPCExpert(hold_s=hold_s)


def test_a_target_is_for_the_motors_strength_and_the_joints_resistance(expert, standing):
    torque, acceleration = expert.torque(standing)
    half = expert.hold_s / 2
    q, v = standing.q + half * standing.v + half**2 / 2 * acceleration, standing.v + half * acceleration
    told = replace(standing, motor_strength=0.8, joint_friction=0.3, joint_damping=0.4)
    applied = 0.8 * expert.gains.torque(expert.action(told), q, v)
    np.testing.assert_allclose(applied, torque + joint_resistance(told, v), atol=1e-9)


def test_told_of_a_payload_it_pushes_with_the_weight_of_both(expert, standing):
    loaded = replace(standing, payload_kg=3.0)
    lifting = [expert.forces(state, expert._model.dynamics(state))[:, 2].sum() for state in (standing, loaded)]
    assert lifting[1] - lifting[0] == pytest.approx(3.0 * robot.GRAVITY, rel=0.15)
    np.testing.assert_array_equal(expert.action(standing), fresh(standing).action(standing))
