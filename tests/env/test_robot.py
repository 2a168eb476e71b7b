"""The robot's figures against the compiled MuJoCo model, and its standing pose."""

import mujoco
import numpy as np
import pytest

from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.sim.simulation import Simulation


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(robot.SCENE_PATH)


def test_total_mass_is_that_of_a_go1(model):
    assert model.body_mass.sum() == pytest.approx(12.743, abs=1e-3)
    assert model.body_mass.sum() == pytest.approx(robot.MASS, abs=1e-6)
    assert model.body("trunk").mass[0] == pytest.approx(5.204)
    assert -model.opt.gravity[2] == robot.GRAVITY


def test_the_inertial_unit_sits_where_robot_py_says_and_is_not_turned(model):
    np.testing.assert_array_equal(model.site("imu").pos, robot.IMU_POSITION_B)
    np.testing.assert_array_equal(model.site("imu").quat, [1.0, 0.0, 0.0, 0.0])


def test_joints_stand_in_the_order_of_robot_py(model):
    hinges = [model.joint(i) for i in range(model.njnt) if model.joint(i).type[0] == mujoco.mjtJoint.mjJNT_HINGE]
    assert tuple(joint.name for joint in hinges) == robot.JOINTS
    assert [int(joint.qposadr[0]) for joint in hinges] == list(range(7, 19))
    assert [int(joint.dofadr[0]) for joint in hinges] == list(range(6, 18))


def test_actuators_drive_the_joints_in_the_same_order(model):
    driven = [model.joint(model.actuator_trnid[i, 0]).name for i in range(model.nu)]
    assert tuple(driven) == robot.JOINTS
    np.testing.assert_array_equal(model.actuator_gear[:, 0], np.ones(12))


def test_joint_ranges_and_torque_limits_are_enforced_by_the_model(model):
    np.testing.assert_array_equal(model.jnt_range[1:], np.stack([robot.JOINT_LOWER, robot.JOINT_UPPER], axis=1))
    assert model.jnt_limited[1:].all()
    np.testing.assert_array_equal(
        model.actuator_forcerange, np.stack([-robot.TORQUE_LIMIT, robot.TORQUE_LIMIT], axis=1)
    )
    assert model.actuator_forcelimited.all()
    assert robot.TORQUE_LIMIT[:3].tolist() == [23.7, 23.7, 35.55]


def test_armature_is_rotor_inertia_times_gear_squared(model):
    rotor = 1.11842e-4
    np.testing.assert_allclose(model.dof_armature[6:9], [rotor * 36, rotor * 36, rotor * 81], rtol=1e-3)


def test_standing_height_follows_from_the_leg_geometry():
    by_hand = 2 * 0.213 * np.cos(0.9) + 0.023  # thigh and calf lean by 0.9 rad, one forward, one back
    assert by_hand == pytest.approx(robot.STANDING_HEIGHT, abs=5e-4)
    assert by_hand == pytest.approx(
        robot.THIGH_LENGTH * np.cos(0.9) + robot.CALF_LENGTH * np.cos(0.9) + robot.FOOT_RADIUS, abs=1e-12
    )


def test_feet_of_the_home_pose_stand_below_the_nominal_points(model):
    data = mujoco.MjData(model)
    data.qpos[:7] = [0, 0, robot.STANDING_HEIGHT, 1, 0, 0, 0]
    data.qpos[7:] = robot.HOME_POSE
    mujoco.mj_kinematics(model, data)
    feet = np.array([data.geom(f"{leg}_foot").xpos for leg in robot.LEGS])
    np.testing.assert_allclose(feet[:, :2], robot.NOMINAL_FOOT_B[:, :2], atol=1e-9)
    np.testing.assert_allclose(feet[:, 2], robot.FOOT_RADIUS, atol=5e-4)
    np.testing.assert_allclose(robot.NOMINAL_FOOT_B[0], [0.1881, 0.12675, 0.0])


def test_nominal_feet_are_mirror_images():
    left, right = robot.NOMINAL_FOOT_B[[0, 2]], robot.NOMINAL_FOOT_B[[1, 3]]
    np.testing.assert_array_equal(left * [1, -1, 1], right)
    np.testing.assert_array_equal(np.sign(robot.NOMINAL_FOOT_B[:, 1]), robot.LEG_SIDE)


@pytest.mark.parametrize("name", ["JOINT_LOWER", "HOME_POSE", "TORQUE_LIMIT", "NOMINAL_FOOT_B", "LEG_SIDE"])
def test_figures_cannot_be_overwritten(name):
    with pytest.raises(ValueError, match="read-only"):
        getattr(robot, name)[0] = 1.0


def test_home_pose_stands_for_five_seconds_on_all_feet():
    env = Go1Env("trot", episode_s=10.0)
    env.reset(seed=0)
    action = env.action_map.from_radians(robot.HOME_POSE)
    load = []
    for _ in range(250):
        _, _, terminated, truncated, info = env.step(action)
        assert not terminated and not truncated
        data = env.simulation.data
        load.append([data.sensor(f"{leg}_touch").data[0] for leg in robot.LEGS])
    assert info["contacts"].all()
    weight = robot.MASS * 9.81
    assert np.sum(load[50:], axis=1) == pytest.approx(weight, rel=0.01)
    assert (load[-1] > 0.15 * weight * np.ones(4)).all()
    assert np.abs(env.state.base_velocity).max() < 0.01
    assert -env.state.gravity_b[2] > 0.998


def test_robot_parts_do_not_collide_with_each_other():
    simulation = Simulation(PDGains())
    simulation.reset(robot.HOME_POSE)
    simulation.data.qpos[2] = 2.0
    rng = np.random.default_rng(0)
    for _ in range(50):
        simulation.data.qpos[7:] = rng.uniform(robot.JOINT_LOWER, robot.JOINT_UPPER)
        mujoco.mj_forward(simulation.model, simulation.data)
        assert simulation.data.ncon == 0
