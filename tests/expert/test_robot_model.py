"""Pinocchio against MuJoCo on random states, Jdot v against finite differences, and the attitude of trunk and legs."""

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from experts.robot_model import Dynamics, RobotModel, to_pinocchio, whole_body_attitude
from go1_mtl_gym import robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.sensing.state import RobotState


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


@pytest.fixture(scope="module")
def env() -> Go1Env:
    env = Go1Env("trot")
    env.reset(seed=0)
    return env


def random_state(env: Go1Env, rng: np.random.Generator) -> RobotState:
    """Any attitude, any joint positions, fast; MuJoCo's data are evaluated there."""
    data = env.simulation.data
    quat = rng.normal(size=4)
    data.qpos[:3] = rng.normal(size=3) + [0, 0, 5]
    data.qpos[3:7] = quat / np.linalg.norm(quat)
    data.qpos[7:] = rng.uniform(robot.JOINT_LOWER, robot.JOINT_UPPER)
    data.qvel[:] = 3 * rng.normal(size=18)
    mujoco.mj_forward(env.simulation.model, data)
    return env.state


def full_mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    dense = np.zeros((18, 18))
    try:
        mujoco.mj_fullM(model, data, dense)
    except TypeError:  # before MuJoCo 4
        mujoco.mj_fullM(model, dense, data.qM)
    return dense


@pytest.fixture(scope="module")
def pairs(model, env) -> list[tuple[Dynamics, dict[str, np.ndarray]]]:
    """Both libraries' quantities at 200 random states, MuJoCo's turned into Pinocchio's coordinates."""
    rng, out = np.random.default_rng(0), []
    m, data = env.simulation.model, env.simulation.data
    for _ in range(200):
        state = random_state(env, rng)
        R, to_mujoco = state.rotation, np.eye(18)
        to_mujoco[:3, :3] = R  # v_mj = T v_pin: linear velocity in the world there, in the base here
        mass = full_mass_matrix(m, data)
        # d/dt (R v_b) = R (vdot_b + omega x v_b): MuJoCo's acceleration at zero vdot in Pinocchio's coordinates
        turning = np.zeros(18)
        turning[:3] = R @ np.cross(state.angular_velocity_b, R.T @ state.linear_velocity_w)
        damping = np.r_[np.zeros(6), np.full(12, 0.1)] * data.qvel
        jacobians = []
        for leg in robot.LEGS:
            jacobian = np.zeros((3, 18))
            mujoco.mj_jacGeom(m, data, jacobian, None, m.geom(f"{leg}_foot").id)
            jacobians.append(jacobian @ to_mujoco)
        momentum = np.zeros((3, 18))
        mujoco.mj_jacSubtreeCom(m, data, momentum, m.body("trunk").id)
        reference = {
            "mass_matrix": to_mujoco.T @ mass @ to_mujoco,
            "bias": to_mujoco.T @ (data.qfrc_bias + damping + mass @ turning),
            "jacobian": np.vstack(jacobians),
            "feet_w": env.simulation.feet_w,
            "feet_velocity_w": (np.vstack(jacobians) @ (to_mujoco.T @ data.qvel)).reshape(4, 3),
            "com_w": data.subtree_com[m.body("trunk").id].copy(),
            "com_velocity_w": momentum @ data.qvel,
        }
        out.append((model.dynamics(state), reference))
    return out


@pytest.mark.parametrize(
    "name", ["mass_matrix", "bias", "jacobian", "feet_w", "feet_velocity_w", "com_w", "com_velocity_w"]
)
def test_pinocchio_agrees_with_mujoco(pairs, name):
    worst = max(np.abs(getattr(ours, name) - theirs[name]).max() for ours, theirs in pairs)
    assert worst < 1e-9
    assert np.ptp([theirs[name].ravel()[0] for _, theirs in pairs]) > 1e-3 or name == "mass_matrix"


def test_mass_matrix_is_symmetric_and_positive(pairs):
    for ours, _ in pairs[:20]:
        np.testing.assert_array_equal(ours.mass_matrix, ours.mass_matrix.T)
        assert np.linalg.eigvalsh(ours.mass_matrix)[0] > 0


def test_composite_inertia_is_that_of_mujocos_bodies(model, env):
    rng, m, data = np.random.default_rng(1), env.simulation.model, env.simulation.data
    for _ in range(20):
        state = random_state(env, rng)
        com, inertia = data.subtree_com[m.body("trunk").id], np.zeros((3, 3))
        for body in range(1, m.nbody):
            axes, arm = data.ximat[body].reshape(3, 3), data.xipos[body] - com
            inertia += axes @ np.diag(m.body_inertia[body]) @ axes.T
            inertia += m.body_mass[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        np.testing.assert_allclose(model.dynamics(state).inertia_w, inertia, atol=1e-10)


def test_standing_inertia_and_mass_are_the_published_ones(model):
    assert model.mass == pytest.approx(robot.MASS, abs=1e-6)
    np.testing.assert_allclose(np.diag(model.standing_inertia()), [0.127, 0.394, 0.423], atol=1.5e-3)


def moved(model: RobotModel, state: RobotState, seconds: float) -> RobotState:
    """The state after moving on with constant generalized velocity in the base frame (vdot = 0)."""
    q, v = to_pinocchio(state)
    q = pin.integrate(model.model, q, v * seconds)
    quat = q[[6, 3, 4, 5]]
    there = replace(state, position_w=q[:3], quat_wxyz=quat, q=q[7:])
    return replace(there, linear_velocity_w=there.rotation @ v[:3])


def test_a_payload_is_mujocos_and_is_put_down_again(model):
    loaded = Go1Env("trot", payload_kg=2.5)
    loaded.reset(seed=0)
    state, data = replace(loaded.state, payload_kg=2.5), loaded.simulation.data
    dynamics, before = model.dynamics(state), model.dynamics(loaded.state)
    mass = full_mass_matrix(loaded.simulation.model, data)
    np.testing.assert_allclose(dynamics.mass_matrix, mass, atol=1e-9)  # the trunk is level
    np.testing.assert_allclose(dynamics.com_w, data.subtree_com[loaded.simulation.model.body("trunk").id], atol=1e-9)
    assert dynamics.mass == pytest.approx(loaded.simulation.model.body_mass.sum())
    assert np.abs(before.mass_matrix - mass).max() > 1.0 and before.mass == robot.MASS
    np.testing.assert_array_equal(RobotModel().dynamics(loaded.state).mass_matrix, before.mass_matrix)
    assert model.standing_moments(2.5)[1] > model.standing_moments()[1]


def test_mean_omega_is_mujocos_angular_momentum_over_the_inertia(model, env):
    rng, m, data = np.random.default_rng(4), env.simulation.model, env.simulation.data
    for _ in range(20):
        dynamics = model.dynamics(random_state(env, rng))
        mujoco.mj_subtreeVel(m, data)
        momentum = data.subtree_angmom[m.body("trunk").id]
        np.testing.assert_allclose(dynamics.inertia_w @ dynamics.mean_omega_w, momentum, atol=1e-9)


def test_a_rigid_robot_turns_as_a_whole(model, env):
    rng = np.random.default_rng(5)
    for _ in range(20):
        state = replace(random_state(env, rng), v=np.zeros(12))
        turning = state.rotation @ state.angular_velocity_b
        np.testing.assert_allclose(model.dynamics(state).mean_omega_w, turning, atol=1e-9)


def test_lean_follows_the_joints_to_first_order(model, env):
    """At the home pose its rate is mean_omega less the trunk's, whatever the trunk does; away from it nearly so."""
    rng, step = np.random.default_rng(6), 1e-6
    errors = []
    for away in (0.0, 0.02, 0.04):
        worst = []
        for seed in range(10):
            state = random_state(env, np.random.default_rng(seed))
            pose = robot.HOME_POSE + away * np.random.default_rng(seed).normal(size=12)
            state = replace(state, q=pose, v=rng.normal(size=12))
            ahead, behind = (model.dynamics(replace(state, q=pose + t * state.v)).lean_w for t in (step, -step))
            turning = model.dynamics(state).mean_omega_w - state.rotation @ state.angular_velocity_b
            worst.append(np.abs((ahead - behind) / (2 * step) - turning).max())
            assert np.abs(turning).max() > 0.01
        errors.append(np.mean(worst))
    assert errors[0] < 1e-7
    assert 0 < errors[1] < errors[2] < 3 * errors[1] < 0.1
    assert not model.dynamics(replace(state, q=robot.HOME_POSE)).lean_w.any()


def test_drift_is_the_feets_acceleration_at_zero_vdot(model, env):
    rng, step = np.random.default_rng(2), 1e-5
    for _ in range(20):
        state = random_state(env, rng)
        ahead, behind = (model.dynamics(moved(model, state, t)) for t in (step, -step))
        numeric = (ahead.feet_velocity_w - behind.feet_velocity_w) / (2 * step)
        drift = model.dynamics(state).drift
        np.testing.assert_allclose(drift, numeric, atol=1e-5 * np.abs(drift).max())
        velocity = (ahead.feet_w - behind.feet_w) / (2 * step)
        np.testing.assert_allclose(model.dynamics(state).feet_velocity_w, velocity, atol=1e-6)


def test_evaluations_do_not_share_memory_with_the_model(model, env):
    rng = np.random.default_rng(3)
    first = model.dynamics(random_state(env, rng))
    kept = {name: np.copy(getattr(first, name)) for name in first.__dataclass_fields__}
    model.dynamics(random_state(env, rng))
    for name, value in kept.items():
        np.testing.assert_array_equal(getattr(first, name), value)


def attitude(model, state) -> np.ndarray:
    return whole_body_attitude(state, model.dynamics(state))


def test_in_the_home_pose_the_whole_has_the_trunks_attitude(model, standing):
    tilted = replace(standing, quat_wxyz=np.array([0.9, 0.1, -0.2, 0.3]) / np.sqrt(0.95))
    np.testing.assert_allclose(attitude(model, tilted), tilted.rpy, atol=1e-12)
    assert np.abs(tilted.rpy).min() > 0.05


def test_legs_swung_forward_turn_the_whole_back(model, standing):
    """Hind thighs and fore thighs turn about +y when the feet go back; by hand, lean = I^-1 A dq is positive then."""
    back = replace(standing, q=robot.HOME_POSE + np.tile([0.0, 0.1, 0.0], 4))
    forward = replace(standing, q=robot.HOME_POSE - np.tile([0.0, 0.1, 0.0], 4))
    for state, sign in ((back, 1.0), (forward, -1.0)):
        roll, pitch, yaw = attitude(model, state) - state.rpy
        assert 0.005 < sign * pitch < 0.1
        assert abs(roll) < 1e-3 and abs(yaw) < 1e-3


def test_the_rate_of_its_attitude_is_the_mean_angular_velocity(model, standing):
    """With a level trunk that rests; in the heading frame, whichever way the robot faces."""
    step = 1e-6
    speed = np.random.default_rng(0).normal(size=12)
    for yaw in (0.0, 2.0):
        facing = replace(standing, quat_wxyz=np.array([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]), v=speed)
        ahead, behind = (attitude(model, replace(facing, q=robot.HOME_POSE + t * speed)) for t in (step, -step))
        x, y, z = model.dynamics(replace(facing, q=robot.HOME_POSE)).mean_omega_w
        cos, sin = np.cos(yaw), np.sin(yaw)
        np.testing.assert_allclose((ahead - behind) / (2 * step), [cos * x + sin * y, cos * y - sin * x, z], atol=1e-6)
