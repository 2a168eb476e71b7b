"""The robot in MuJoCo: resetting, stepping, pushing, and going back to a snapshot."""

import mujoco
import numpy as np
import pytest

from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.sim.physics_params import PhysicsParams
from go1_mtl_gym.sim.simulation import CONTACT_FORCE, PHYSICS_HZ, Simulation

EVERYTHING = PhysicsParams(0.5, 2.0, 0.012, 0.9, 0.6, 0.02, 0.01, 0.7)


@pytest.fixture
def simulation() -> Simulation:
    simulation = Simulation(PDGains())
    simulation.reset(robot.HOME_POSE)
    return simulation


def test_reset_puts_the_lowest_foot_on_the_ground(simulation):
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = robot.HOME_POSE + rng.uniform(-0.2, 0.2, 12)
        simulation.reset(q, yaw=rng.uniform(-3, 3))
        assert simulation.feet_w[:, 2].min() == pytest.approx(robot.FOOT_RADIUS, abs=1e-12)
        np.testing.assert_array_equal(simulation.q, q)
        assert not simulation.v.any() and simulation.data.time == 0


def test_reset_heads_where_it_is_told(simulation):
    simulation.reset(robot.HOME_POSE, yaw=np.pi / 2)
    np.testing.assert_allclose(simulation.feet_w[0, :2], [-robot.NOMINAL_FOOT_B[0, 1], 0.1881], atol=1e-9)


def test_a_thousand_physics_steps_are_a_second(simulation):
    simulation.step(robot.HOME_POSE, 1000)
    assert simulation.data.time == pytest.approx(1.0) and PHYSICS_HZ == 1000


def test_readings_belong_to_the_state_after_the_step(simulation):
    simulation.step(robot.HOME_POSE + 0.1, 20)
    accelerometer, torque = simulation.read().accelerometer, simulation.torque
    mujoco.mj_forward(simulation.model, simulation.data)
    np.testing.assert_allclose(simulation.read().accelerometer, accelerometer, atol=1e-4)
    np.testing.assert_allclose(simulation.torque, torque, atol=1e-10)
    expected = PDGains().torque(robot.HOME_POSE + 0.1, simulation.q, simulation.v)
    np.testing.assert_allclose(torque, expected, atol=1e-10)


def test_contacts_are_touch_forces_above_the_threshold(simulation):
    simulation.step(robot.HOME_POSE, 500)
    assert simulation.read().contacts.all() and simulation.read().contacts.dtype == bool
    for i, leg in enumerate(robot.LEGS):
        simulation.data.sensordata[simulation.model.sensor(f"{leg}_touch").adr[0]] = CONTACT_FORCE - 1e-6
        assert simulation.read().contacts.tolist() == [False] * (i + 1) + [True] * (3 - i)


def test_push_adds_to_the_trunks_velocity_and_to_nothing_else(simulation):
    before = simulation.data.qvel.copy()
    simulation.push(np.array([0.3, -0.2, 0.1]))
    np.testing.assert_allclose(simulation.data.qvel - before, np.r_[0.3, -0.2, 0.1, np.zeros(15)])


def test_returned_arrays_are_copies(simulation):
    for name in ("q", "v", "torque", "feet_w"):
        getattr(simulation, name)[:] = 99.0
        assert (getattr(simulation, name) != 99.0).all()


def test_a_snapshot_continues_to_the_bit_in_another_simulation(simulation):
    rng = np.random.default_rng(0)
    targets = robot.HOME_POSE + rng.uniform(-0.3, 0.3, (40, 12))
    for target in targets[:20]:
        simulation.step(target, 20)
    snapshot, other = simulation.snapshot(), Simulation(PDGains())
    other.reset(robot.HOME_POSE)
    other.restore(snapshot)
    np.testing.assert_array_equal(other.snapshot(), snapshot)
    for target in targets[20:]:
        simulation.step(target, 20), other.step(target, 20)
    np.testing.assert_array_equal(simulation.snapshot(), other.snapshot())


def test_gains_reach_the_actuators():
    soft, stiff = Simulation(PDGains(20.0, 1.0)), Simulation(PDGains(100.0, 1.0))
    for simulation in (soft, stiff):
        simulation.reset(robot.HOME_POSE)
        simulation.data.ctrl[:] = robot.HOME_POSE + 0.1
        mujoco.mj_forward(simulation.model, simulation.data)
    np.testing.assert_allclose(soft.torque, 2.0, atol=1e-9)
    np.testing.assert_allclose(stiff.torque, 10.0, atol=1e-9)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e11])
def test_diverged_physics_is_noticed_and_a_reset_heals_it(simulation, bad):
    assert simulation.stable
    simulation.data.qvel[3] = bad
    simulation.step(robot.HOME_POSE, 20)
    assert not simulation.stable
    simulation.reset(robot.HOME_POSE)
    simulation.step(robot.HOME_POSE, 20)
    assert simulation.stable and np.isfinite(simulation.q).all()


@pytest.mark.parametrize("control_hz", [50, 100, 125, 1000])
def test_every_control_rate_simulates_the_same_physics(control_hz):
    """A held target does not know how often the control loop looked: the same time and, nearly, the same state."""
    env, slow = Go1Env("bound", control_hz=control_hz), Go1Env("bound", control_hz=50)
    env.reset(seed=0), slow.reset(seed=0)
    action = env.action_map.from_radians(robot.HOME_POSE + 0.05)
    for _ in range(control_hz * 2 // 5):
        env.step(action)
    for _ in range(20):
        slow.step(action)
    assert env.simulation.data.time == pytest.approx(0.4, abs=1e-9)
    np.testing.assert_allclose(env.state.q, slow.state.q, atol=1e-4)
    np.testing.assert_allclose(env.state.position_w, slow.state.position_w, atol=1e-4)
    assert abs((env.state.phase - slow.state.phase + 0.5) % 1.0 - 0.5) < 1e-9


# -- Changes of physics_params ------------------------------------------------------------------------------------


def arrays(model: mujoco.MjModel) -> dict[str, np.ndarray]:
    """Every array of a model by name."""
    named = ((name, getattr(model, name)) for name in dir(model) if not name.startswith("_"))
    return {name: value for name, value in named if isinstance(value, np.ndarray)}


def test_a_physics_params_replaces_the_one_before():
    simulation, plain = Simulation(PDGains(40.0, 1.0), EVERYTHING), Simulation(PDGains(40.0, 1.0))
    for physics_params in (
        PhysicsParams(),
        PhysicsParams(payload_kg=1.0),
        EVERYTHING,
        PhysicsParams(motor_strength=1.1),
        EVERYTHING,
    ):
        simulation.set_physics_params(physics_params)
        fresh = Simulation(PDGains(40.0, 1.0), physics_params)
        assert simulation.physics_params == physics_params
        expected = arrays(fresh.model)
        assert all(np.array_equal(value, expected[name]) for name, value in arrays(simulation.model).items())
        for each in (simulation, fresh):
            each.reset(robot.HOME_POSE)
            each.step(robot.HOME_POSE + 0.1, 50)
        np.testing.assert_array_equal(simulation.snapshot(), fresh.snapshot())
    assert not np.array_equal(simulation.q, plain.q)


def test_after_a_change_a_reset_stands_on_the_ground():
    simulation = Simulation(PDGains())
    for physics_params in (EVERYTHING, PhysicsParams(contact_time_s=0.1), PhysicsParams()):
        simulation.set_physics_params(physics_params)
        simulation.reset(robot.HOME_POSE)
        assert simulation.feet_w[:, 2].min() == pytest.approx(robot.FOOT_RADIUS)
        simulation.step(robot.HOME_POSE, 300)
        assert simulation.contacts.all() and simulation.stable and simulation.data.qpos[2] > 0.24


def test_a_change_while_running_lets_the_actuators_hold_what_they_hold():
    simulation = Simulation(PDGains())
    simulation.reset(robot.HOME_POSE)
    simulation.step(robot.HOME_POSE + 0.1, 20)
    simulation.set_physics_params(PhysicsParams(action_delay_s=0.01))
    simulation.step(robot.HOME_POSE, 9)
    np.testing.assert_array_equal(simulation.data.ctrl, robot.HOME_POSE + 0.1)
    simulation.step(robot.HOME_POSE, 2)
    np.testing.assert_array_equal(simulation.data.ctrl, robot.HOME_POSE)


def test_a_snapshot_brings_its_physics_params_along():
    one, other = Simulation(PDGains(), EVERYTHING), Simulation(PDGains(), PhysicsParams(friction=1.0))
    one.reset(robot.HOME_POSE)
    one.step(robot.HOME_POSE + 0.2, 35)
    other.restore(one.snapshot())
    assert other.physics_params == EVERYTHING
    for each in (one, other):
        each.step(robot.HOME_POSE, 60)
    np.testing.assert_array_equal(one.snapshot(), other.snapshot())


def test_a_physics_params_is_a_vector_and_back():
    assert PhysicsParams().as_vector().tolist() == [-1.0, 0.0, 0.0, 1.0, -1.0, -1.0, -1.0, -1.0]
    for physics_params in (PhysicsParams(), EVERYTHING, PhysicsParams(joint_friction=0.0)):
        assert PhysicsParams.from_vector(physics_params.as_vector()) == physics_params
