"""Other people's models of the Go1: other names, another order, no floor; and what is none."""

import re
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
import pytest

import go1_mtl_gym
from go1_mtl_gym import EnvConfig, InvalidInputError, robot
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.sim import robot_file
from go1_mtl_gym.sim.physics_params import PhysicsParams
from go1_mtl_gym.sim.simulation import Simulation

OURS = Path(robot.MODEL_PATH).read_text(encoding="utf-8")


MESH = '<mesh name="lost" file="lost.stl"/>'


def respelled(text: str = OURS) -> str:
    """Our robot with right legs first, joints as in ANYmal's files, feet called after their legs, and a base."""
    legs = dict(zip(("FL", "FR", "RL", "RR"), re.findall(r'<body name="\w\w_hip".*?^      </body>', text, re.M | re.S)))
    assert len(legs) == 4
    first, last = text.index(legs["FL"]), text.index(legs["RR"]) + len(legs["RR"])
    text = text[:first] + "\n".join(legs[leg] for leg in ("RR", "RL", "FR", "FL")) + text[last:]
    text = re.sub(r"<sensor>.*</sensor>", "", text, flags=re.S)
    text = re.sub(r'<site name="(imu|\w\w_foot)".*?/>', "", text)
    for leg, other in (("FL", "LF"), ("FR", "RF"), ("RL", "LH"), ("RR", "RH")):
        for part, called in (("hip", "HAA"), ("thigh", "HFE"), ("calf", "KFE")):
            text = text.replace(f"{leg}_{part}_joint", f"{other}_{called}")
        text = text.replace(f'name="{leg}_foot"', f'name="{other}"')
    return text.replace('<body name="trunk"', '<body name="base"')


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    path = tmp_path_factory.mktemp("robots") / "other.xml"
    path.write_text(respelled(), encoding="utf-8")
    return str(path)


def test_a_respelled_robot_moves_as_ours_does(other):
    ours, theirs = Simulation(PDGains()), Simulation(PDGains(), None, other)
    for name in ("opt.cone", "opt.impratio"):  # the scene's, which the bare robot does not have
        part, field = name.split(".")
        setattr(getattr(theirs.model, part), field, getattr(getattr(ours.model, part), field))
    names = [theirs.model.joint(i).name for i in range(1, 13)]
    assert names != list(robot.JOINTS) and set(names) == set(robot.JOINTS), "another order in the file"
    rng = np.random.default_rng(0)
    start = robot.HOME_POSE + rng.uniform(-0.05, 0.05, 12)
    for simulation in (ours, theirs):
        simulation.reset(start, yaw=0.3)
    for _ in range(25):
        target = robot.HOME_POSE + rng.uniform(-0.1, 0.1, 12)
        for simulation in (ours, theirs):
            simulation.step(target, 20)
    np.testing.assert_allclose(theirs.q, ours.q, atol=1e-6)
    np.testing.assert_allclose(theirs.v, ours.v, atol=1e-4)
    np.testing.assert_allclose(theirs.torque, ours.torque, atol=1e-3)
    np.testing.assert_allclose(theirs.feet_w, ours.feet_w, atol=1e-6)
    np.testing.assert_array_equal(theirs.contacts, ours.contacts)
    for reading in ("accelerometer", "gyroscope"):
        np.testing.assert_allclose(getattr(theirs.read(), reading), getattr(ours.read(), reading), atol=1e-2)


def test_a_snapshot_of_another_robot_is_continued_to_the_bit(other):
    simulation = Simulation(PDGains(), PhysicsParams(payload_kg=2.0, action_delay_s=0.005), other)
    simulation.reset(robot.HOME_POSE)
    simulation.step(robot.HOME_POSE + 0.1, 20)
    snapshot = simulation.snapshot()
    simulation.step(robot.HOME_POSE, 20)
    after = simulation.q
    simulation.restore(snapshot)
    simulation.step(robot.HOME_POSE, 20)
    np.testing.assert_array_equal(simulation.q, after)


def test_the_expert_walks_on_it(other):
    env = gymnasium.make("Go1Trot-v0", robot=other, episode_s=3.0)
    _, info = env.reset(seed=1, options={"command": (0.4, 0.0, 0.0)})
    velocity = []
    for _ in range(75):
        *_, info = env.step(env.unwrapped.expert_action())
        velocity.append(info["base_velocity"][0])
    assert not info["fallen"] and np.mean(velocity[35:]) == pytest.approx(0.4, abs=0.05)
    assert EnvConfig.from_dict(env.unwrapped.config.as_dict()) == env.unwrapped.config


def test_it_keeps_its_own_physics_and_gets_our_motors(other, tmp_path):
    path = tmp_path / "damped.xml"
    path.write_text(respelled().replace('damping="0.1"', 'damping="0.7"'), encoding="utf-8")
    model = robot_file.load(path)
    np.testing.assert_array_equal(model.dof_damping[6:], 0.7)
    np.testing.assert_array_equal(model.actuator_forcerange[:, 1], robot.TORQUE_LIMIT)
    assert [model.actuator(i).name for i in range(12)] == [name.removesuffix("_joint") for name in robot.JOINTS]
    assert model.opt.timestep == 0.001 and model.camera("track").id >= 0
    assert any(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)


def test_a_scene_keeps_its_floor():
    model = robot_file.load(robot.SCENE_PATH)
    assert (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).sum() == 1 and model.geom("floor").id >= 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("<freejoint", "<!-- freejoint").replace('"root"/>', '"root"/ -->'), "free joint"),
        (lambda text: text.replace("LF_KFE", "tail"), "joints with names"),
        (lambda text: text.replace('pos="0 0 -0.213"', 'pos="0 0 -0.26"'), "home pose"),
        (lambda text: text[:200], "no MJCF"),
        (lambda text: text.replace("<worldbody>", f"<asset>{MESH}</asset><worldbody>"), "does not compile: .*lost.stl"),
    ],
)
def test_what_is_no_go1_is_refused(tmp_path, change, message):
    path = tmp_path / "robot.xml"
    path.write_text(change(respelled()), encoding="utf-8")
    with pytest.raises(InvalidInputError, match=message):
        robot_file.load(path)


@pytest.mark.parametrize("path", ["nowhere.xml", 5])
def test_a_file_that_is_not_there_is_refused_by_the_configuration(path):
    with pytest.raises(InvalidInputError, match="robot must be"):
        go1_mtl_gym.Go1Env(robot=path)
