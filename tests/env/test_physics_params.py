"""Friction, payload, motors, contacts and delay: each changes what it says, exactly, and nothing else."""

import mujoco
import numpy as np
import pytest

from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sim.physics_params import ActionDelay, PhysicsParams
from go1_mtl_gym.sim.simulation import Simulation


def fields(model: mujoco.MjModel) -> dict[str, np.ndarray]:
    """Every array of a model by name."""
    named = ((name, getattr(model, name)) for name in dir(model) if not name.startswith("_"))
    return {name: value.copy() for name, value in named if isinstance(value, np.ndarray)}


def changed(physics_params: PhysicsParams) -> set[str]:
    """Names of a model's arrays that differ from the plain model's."""
    plain, other = (fields(Simulation(PDGains(), each).model) for each in (PhysicsParams(), physics_params))
    return {name for name in plain if not np.array_equal(plain[name], other[name])}


# -- Friction ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.3, 0.8, 1.2])
def test_friction_is_that_of_every_contact(friction):
    env = Go1Env("trot", friction=friction)
    env.reset(seed=0)
    for target in (robot.HOME_POSE, np.tile([0.0, 1.4, -2.8], 4)):  # standing, then lying on thighs and trunk
        for _ in range(60):
            env.step(env.action_map.from_radians(target))
        contacts = env.simulation.data.contact
        assert len(contacts) >= 4
        np.testing.assert_array_equal(contacts.friction[:, :2], friction)


def sliding_deceleration(friction: float) -> float:
    """Mean deceleration of a stiffly standing robot that slides at 1 m/s [m/s^2]."""
    simulation = Simulation(PDGains(500.0, 20.0), PhysicsParams(friction=friction))
    simulation.reset(robot.HOME_POSE)
    simulation.step(robot.HOME_POSE, 500)
    simulation.data.qvel[1] = 1.0  # sideways, where the legs are stiff
    simulation.step(robot.HOME_POSE, 100)
    return (1.0 - simulation.data.qvel[1]) / 0.1


def test_a_sliding_robot_decelerates_with_friction_times_gravity():
    assert sliding_deceleration(0.2) == pytest.approx(0.2 * robot.GRAVITY, rel=0.15)
    assert sliding_deceleration(0.4) == pytest.approx(0.4 * robot.GRAVITY, rel=0.15)


def test_friction_changes_nothing_else():
    assert changed(PhysicsParams(friction=0.4)) == {"geom_friction"}
    assert changed(PhysicsParams()) == set()


# -- Payload -----------------------------------------------------------------------------------------------------------


def test_a_payload_adds_its_mass_and_the_inertia_of_a_cube_to_the_trunk():
    plain, loaded = Simulation(PDGains()).model, Simulation(PDGains(), PhysicsParams(payload_kg=3.0)).model
    trunk = plain.body("trunk").id
    mass, inertia = loaded.body_mass - plain.body_mass, loaded.body_inertia - plain.body_inertia
    assert loaded.body_mass.sum() == pytest.approx(robot.MASS + 3.0) and mass[trunk] == pytest.approx(3.0)
    np.testing.assert_allclose(inertia[trunk], 3.0 * 0.1**2 / 6)  # m s^2 / 6 = .005 kg m^2
    assert robot.PAYLOAD_SIDE == 0.1
    assert not np.delete(mass, trunk).any() and not np.delete(inertia, trunk, axis=0).any()


def test_a_payload_changes_masses_and_what_follows_from_them_alone():
    derived = {"body_subtreemass", "body_invweight0", "dof_invweight0", "dof_M0", "actuator_acc0"}
    cameras = {"cam_poscom0", "light_poscom0"}  # they follow the centre of mass
    assert changed(PhysicsParams(payload_kg=3.0)) == {"body_mass", "body_inertia"} | derived | cameras


def test_the_feet_bear_the_payload():
    env = Go1Env("trot", payload_kg=3.0)
    env.reset(seed=0)
    for _ in range(100):
        env.step(env.action_map.from_radians(robot.HOME_POSE))
    data = env.simulation.data
    weight = sum(data.sensordata[env.simulation.model.sensor(f"{leg}_touch").adr[0]] for leg in robot.LEGS)
    assert weight == pytest.approx((robot.MASS + 3.0) * robot.GRAVITY, rel=0.01)


# -- Motors and joints -------------------------------------------------------------------------------------------------

INERTIA = {"body_invweight0", "dof_invweight0", "dof_M0", "actuator_acc0"}
"""What follows from a model's inertias without a change of its masses."""


def torque(error: float, physics_params: PhysicsParams) -> np.ndarray:
    """Torques of a resting robot whose joints all miss their targets by an error [rad]."""
    simulation = Simulation(PDGains(), physics_params)
    simulation.reset(robot.HOME_POSE)
    simulation.data.ctrl[:] = robot.HOME_POSE + error
    mujoco.mj_forward(simulation.model, simulation.data)
    return simulation.torque


@pytest.mark.parametrize("strength", [0.5, 0.9, 1.5])
def test_motor_strength_scales_torques_and_their_limits(strength):
    np.testing.assert_allclose(torque(0.1, PhysicsParams(motor_strength=strength)), strength * 5.0)  # 50 N m/rad
    np.testing.assert_allclose(torque(9.0, PhysicsParams(motor_strength=strength)), strength * robot.TORQUE_LIMIT)


def test_motor_strength_scales_the_damping():
    simulation = Simulation(PDGains(50.0, 2.0), PhysicsParams(motor_strength=0.8))
    simulation.reset(robot.HOME_POSE)
    simulation.data.qvel[6:] = 1.0
    mujoco.mj_forward(simulation.model, simulation.data)
    np.testing.assert_allclose(simulation.torque, -0.8 * 2.0)


def test_motor_strength_changes_nothing_else():
    arrays = {"actuator_gainprm", "actuator_biasprm", "actuator_forcerange"}
    assert changed(PhysicsParams(motor_strength=0.9)) == arrays


def test_dry_friction_is_that_of_every_joint_and_of_nothing_else():
    assert changed(PhysicsParams(joint_friction=0.7)) == {"dof_frictionloss"}
    model = Simulation(PDGains(), PhysicsParams(joint_friction=0.7)).model
    assert model.dof_frictionloss.tolist() == [0.0] * 6 + [0.7] * 12
    assert not Simulation(PDGains(), PhysicsParams(joint_friction=0.0)).model.dof_frictionloss.any()


@pytest.mark.parametrize("friction", [0.0, 0.4, 3.0])
def test_dry_friction_brakes_a_turning_joint_whatever_its_speed(friction):
    simulation = Simulation(PDGains(), PhysicsParams(joint_friction=friction))
    simulation.reset(robot.HOME_POSE)
    simulation.data.qpos[2] = 2.0  # in the air
    simulation.model.actuator_biasprm[:] = simulation.model.actuator_gainprm[:] = 0.0  # limp
    for speed in (5.0, -15.0):
        simulation.data.qvel[6] = speed
        mujoco.mj_forward(simulation.model, simulation.data)
        assert simulation.data.qfrc_constraint[6] == pytest.approx(-np.sign(speed) * friction)


def test_damping_is_that_of_every_joint_and_of_nothing_else():
    assert changed(PhysicsParams(joint_damping=0.7)) == {"dof_damping"}
    model = Simulation(PDGains(), PhysicsParams(joint_damping=0.7)).model
    assert model.dof_damping.tolist() == [0.0] * 6 + [0.7] * 12
    assert not Simulation(PDGains(), PhysicsParams(joint_damping=0.0)).model.dof_damping.any()


def test_damping_brakes_a_turning_joint_in_proportion_to_its_speed():
    simulation = Simulation(PDGains(), PhysicsParams(joint_damping=0.7))
    simulation.reset(robot.HOME_POSE)
    for speed in (5.0, -15.0):
        simulation.data.qvel[6] = speed
        mujoco.mj_forward(simulation.model, simulation.data)
        assert simulation.data.qfrc_damper[6] == pytest.approx(-0.7 * speed)


def test_rotor_inertia_is_that_of_every_joint_and_what_follows_alone():
    assert changed(PhysicsParams(rotor_inertia=0.03)) == {"dof_armature"} | INERTIA
    model = Simulation(PDGains(), PhysicsParams(rotor_inertia=0.03)).model
    assert model.dof_armature.tolist() == [0.0] * 6 + [0.03] * 12
    more = model.dof_M0 - Simulation(PDGains(), PhysicsParams(rotor_inertia=0.01)).model.dof_M0
    np.testing.assert_allclose(more, [0.0] * 6 + [0.02] * 12, atol=1e-12)


# -- Contacts ----------------------------------------------------------------------------------------------------------


def test_the_contact_time_is_that_of_the_feet_alone():
    assert changed(PhysicsParams(contact_time_s=0.01)) == {"geom_solref"}
    model = Simulation(PDGains(), PhysicsParams(contact_time_s=0.01)).model
    feet = [model.geom(f"{leg}_foot").id for leg in robot.LEGS]
    assert model.geom_solref[feet].tolist() == [[0.01, 1.0]] * 4
    assert (np.delete(model.geom_solref, feet, axis=0) == [0.02, 1.0]).all()


def test_contacts_of_the_feet_have_the_feets_time_and_soft_ones_sink_in():
    depth = {}
    for time_s in (0.005, 0.02, 0.04):
        simulation = Simulation(PDGains(), PhysicsParams(contact_time_s=time_s))
        simulation.reset(robot.HOME_POSE)
        simulation.step(robot.HOME_POSE, 1000)
        contacts = simulation.data.contact
        assert len(contacts) == 4 and (contacts.solref[:, 0] == time_s).all()
        depth[time_s] = -contacts.dist.mean()
    assert 2e-5 < depth[0.005] < depth[0.02] / 3 and depth[0.02] < depth[0.04] / 1.5


# -- Delay -------------------------------------------------------------------------------------------------------------


def held(delay: ActionDelay, target: float, steps: int) -> list[tuple[float, int]]:
    return [(float(value[0]), count) for value, count in delay.send(np.full(12, target), steps)]


def test_the_line_of_targets_by_hand():
    delay = ActionDelay(0)
    assert held(delay, 1.0, 20) == [(1.0, 20)]
    delay = ActionDelay(7)
    delay.reset(np.zeros(12))
    assert held(delay, 1.0, 20) == [(0.0, 7), (1.0, 13)]
    assert held(delay, 2.0, 20) == [(1.0, 7), (2.0, 13)]
    assert held(delay, 2.0, 20) == [(2.0, 20)]
    delay = ActionDelay(25)  # longer than a control period
    delay.reset(np.zeros(12))
    assert held(delay, 1.0, 20) == [(0.0, 20)]
    assert held(delay, 2.0, 20) == [(0.0, 5), (1.0, 15)]
    assert held(delay, 3.0, 20) == [(1.0, 5), (2.0, 15)]


@pytest.mark.parametrize(
    ("delay_ms", "control_hz"), [(0, 50), (1, 50), (7, 50), (20, 50), (33, 50), (50, 50), (3, 500)]
)
def test_a_delayed_action_gives_the_physics_of_one_that_comes_later(delay_ms, control_hz):
    env = Go1Env("trot", control_hz=control_hz, action_delay_s=delay_ms / 1000)
    env.reset(seed=0)
    actions = env.action_map.from_radians(robot.HOME_POSE) + np.random.default_rng(0).uniform(-0.2, 0.2, (12, 12))
    simulation, period = Simulation(PDGains()), 1000 // control_hz
    simulation.reset(env.simulation.q)
    late = [env.simulation.q] * delay_ms  # the target of every millisecond
    late += [env.action_map.to_radians(action) for action in actions for _ in range(period)]
    for step, action in enumerate(actions):
        env.step(action)
        for target in late[step * period : (step + 1) * period]:
            simulation.data.ctrl[:] = target
            mujoco.mj_step(simulation.model, simulation.data)
        mujoco.mj_forward(simulation.model, simulation.data)
        np.testing.assert_array_equal(simulation.data.qpos, env.simulation.data.qpos)
        np.testing.assert_array_equal(simulation.data.qvel, env.simulation.data.qvel)


def test_the_delay_is_rounded_to_milliseconds():
    assert [PhysicsParams(action_delay_s=s).delay_steps for s in (0.0, 0.0004, 0.0126, 0.05)] == [0, 0, 13, 50]


def test_a_reset_forgets_the_targets_on_their_way():
    env = Go1Env("trot", action_delay_s=0.03)
    env.reset(seed=0)
    env.step(np.ones(12))
    again, fresh = env.reset(seed=0)[0], Go1Env("trot", action_delay_s=0.03)
    np.testing.assert_array_equal(again, fresh.reset(seed=0)[0])
    np.testing.assert_array_equal(env.step(np.zeros(12))[0], fresh.step(np.zeros(12))[0])


# -- Arguments ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"friction": 0.0}, r"friction must lie in \[0.05, 2\], got 0"),
        ({"friction": "ice"}, "friction.*'ice'"),
        ({"payload_kg": -1.0}, r"payload_kg \[kg\] must lie in \[0, 10\], got -1"),
        ({"payload_kg": None}, "payload_kg.*None"),
        ({"action_delay_s": 0.06}, r"action_delay_s \[s\] must lie in \[0, 0.05\], got 0.06"),
        ({"action_delay_s": float("nan")}, "action_delay_s.*nan"),
        ({"motor_strength": 0.4}, r"motor_strength must lie in \[0.5, 1.5\], got 0.4"),
        ({"motor_strength": None}, "motor_strength.*None"),
        ({"joint_friction": -0.1}, r"joint_friction \[N m\] must lie in \[0, 5\], got -0.1"),
        ({"rotor_inertia": 1.0}, r"rotor_inertia \[kg m\^2\] must lie in \[0, 0.1\], got 1"),
        ({"contact_time_s": 0.001}, r"contact_time_s \[s\] must lie in \[0.002, 0.2\], got 0.001"),
        ({"joint_damping": 3.5}, r"joint_damping \[N m s/rad\] must lie in \[0, 3\], got 3.5"),
        ({"gravity": 1.6}, "argument of Go1Env must be one of 'task', .*'kp'.*'friction'.*; got 'gravity'"),
        ({"estimator_noise": 0.1}, "estimator_noise must be None, True, False or an EstimatorNoise, got 0.1"),
    ],
)
def test_impossible_figures_are_refused(arguments, words):
    with pytest.raises(InvalidInputError, match=words):
        Go1Env(**arguments)
