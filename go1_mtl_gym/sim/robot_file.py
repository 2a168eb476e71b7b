"""Another MJCF of a Go1, brought into the form that `go1_mtl_gym.sim.simulation.Simulation` expects."""

import os
import re
from collections.abc import Iterable

import mujoco
import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.errors import InvalidInputError

LEG_NAMES = {
    "FL": ("fl", "lf", "frontleft", "leftfront"),
    "FR": ("fr", "rf", "frontright", "rightfront"),
    "RL": ("rl", "lh", "rearleft", "leftrear", "hindleft", "lefthind"),
    "RR": ("rr", "rh", "rearright", "rightrear", "hindright", "righthind"),
}
"""What people call a leg."""
PART_NAMES = (
    ("hip", "thigh", "calf"),
    ("haa", "hfe", "kfe"),
    ("abduction", "hip", "knee"),
    ("abad", "hip", "knee"),
    ("hip", "thigh", "knee"),
    ("hx", "hy", "kn"),
    ("hipx", "hipy", "knee"),
    ("hip", "upper", "lower"),
)
"""What people call the joints of a leg, from the trunk outward; the first row that fits all legs holds."""
FOOT_NAMES = ("{leg}", "{leg}foot", "foot{leg}", "{leg}footcollision", "{leg}footlink", "{leg}toe")
"""What people call the geom of a foot; otherwise it is the one sphere of a leg that collides and lies lowest."""
IMU_NAMES = ("imu", "imusite", "imulink", "imuinbody")
TOLERANCE_M = 0.03
"""How far a foot of the standing robot may be from where ours is [m]."""
TOUCH_SHARE = 1.3
"""Size of a touch sensor's site, over the foot's: it counts the contacts inside of it."""
_FREE, _PLANE, _SPHERE = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_SPHERE


def load(path: str | os.PathLike[str]) -> mujoco.MjModel:
    """Read a robot, with or without a floor, and give it our names, actuators and sensors.

    Masses, joints (damping, friction, armature, ranges), geoms and their contacts, and the solver's options are the
    file's. Its actuators, sensors and keyframes go; ours come in the order of `robot.JOINTS`, with our torque limits.
    The inertial unit is the file's site of that name, or else where ours is. A floor and cameras are added where
    missing.

    Args:
        path: of the MJCF file.

    Raises:
        InvalidInputError: if it cannot be read, or is not recognized as a Go1; says what is missing.
    """
    try:
        spec = mujoco.MjSpec.from_file(os.fspath(path))
    except ValueError as error:
        raise InvalidInputError(f"{str(path)!r} is no MJCF file that MuJoCo reads: {error}") from error
    joints = _joints(spec, path)
    trunk = _trunk(spec, path)
    _remove([*spec.actuators, *spec.sensors, *spec.keys], spec)
    _rename(trunk, "trunk", spec.bodies)
    for leg, calf in zip(robot.LEGS, joints[2::3]):
        foot = _foot(leg, calf.parent, path)
        _rename(foot, f"{leg}_foot", spec.geoms)
        _add_touch(spec, leg, foot)
    for name, joint in zip(robot.JOINTS, joints):
        _rename(joint, name, spec.joints)
    _add_imu(spec, trunk)
    _add_actuators(spec)
    _add_surroundings(spec)
    spec.option.timestep, spec.option.integrator = 0.001, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    try:
        model = spec.compile()
    except ValueError as error:  # a mesh that is not there, for one
        raise InvalidInputError(f"{str(path)!r} does not compile: {error}") from error
    _check(model, path)
    return model


def _word(name: str) -> str:
    """A name without its prefix, case, punctuation and the word "joint"."""
    return re.sub(r"[^a-z0-9]|joint", "", name.split("/")[-1].lower())


def _joints(spec: mujoco.MjSpec, path: object) -> list[mujoco.MjsJoint]:
    """The joints in the order of `robot.JOINTS`."""
    by_word = {_word(joint.name): joint for joint in spec.joints if joint.type != _FREE}
    for parts in PART_NAMES:
        found = [
            next((by_word[word] for word in _words(leg, part) if word in by_word), None)
            for leg in robot.LEGS
            for part in parts
        ]
        if all(joint is not None for joint in found):
            return [joint for joint in found if joint is not None]
    names = [joint.name for joint in spec.joints if joint.type != _FREE]
    raise InvalidInputError(
        f"{str(path)!r} must have joints with names such as {robot.JOINTS[:3]} or LF_HAA, LF_HFE, LF_KFE, got {names}"
    )


def _words(leg: str, part: str) -> Iterable[str]:
    for name in LEG_NAMES[leg]:
        yield from (name + part, part + name)


def _trunk(spec: mujoco.MjSpec, path: object) -> mujoco.MjsBody:
    free = [joint for joint in spec.joints if joint.type == _FREE]
    if len(free) != 1:
        raise InvalidInputError(f"{str(path)!r} must have one free joint, of a floating trunk, got {len(free)}")
    return free[0].parent


def _foot(leg: str, calf: mujoco.MjsBody, path: object) -> mujoco.MjsGeom:
    colliding = [geom for geom in _geoms_below(calf) if geom.contype or geom.conaffinity]
    words = {pattern.format(leg=name) for name in LEG_NAMES[leg] for pattern in FOOT_NAMES}
    named = [geom for geom in colliding if _word(geom.name) in words]
    spheres = named or [geom for geom in colliding if geom.type == _SPHERE]
    if not spheres:
        raise InvalidInputError(f"{str(path)!r} must have a sphere as the foot of leg {leg}, got none that collides")
    return min(spheres, key=lambda geom: geom.pos[2])


def _geoms_below(body: mujoco.MjsBody) -> list[mujoco.MjsGeom]:
    return [*body.geoms, *(geom for child in body.bodies for geom in _geoms_below(child))]


def _remove(elements: Iterable[object], spec: mujoco.MjSpec) -> None:
    for element in elements:
        spec.delete(element)


def _rename(element: object, name: str, others: Iterable[object]) -> None:
    """Give an element a name; whatever else has it loses it."""
    for other in list(others):
        if other.name == name and other is not element:  # type: ignore[attr-defined]
            other.name = f"other_{name}"  # type: ignore[attr-defined]
    element.name = name  # type: ignore[attr-defined]


def _add_touch(spec: mujoco.MjSpec, leg: str, foot: mujoco.MjsGeom) -> None:
    site = foot.parent.add_site(pos=foot.pos, size=[TOUCH_SHARE * foot.size[0]] * 3, type=_SPHERE, group=4)
    _rename(site, f"{leg}_foot", spec.sites)
    kind, of_site = mujoco.mjtSensor.mjSENS_TOUCH, mujoco.mjtObj.mjOBJ_SITE
    spec.add_sensor(name=f"{leg}_touch", type=kind, objtype=of_site, objname=f"{leg}_foot")


def _add_imu(spec: mujoco.MjSpec, trunk: mujoco.MjsBody) -> None:
    found = next((site for site in trunk.sites if _word(site.name) in IMU_NAMES), None)
    _rename(found or trunk.add_site(pos=robot.IMU_POSITION_B, group=4), "imu", spec.sites)
    for name, kind in (
        ("accelerometer", mujoco.mjtSensor.mjSENS_ACCELEROMETER),
        ("gyroscope", mujoco.mjtSensor.mjSENS_GYRO),
    ):
        spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="imu")


def _add_actuators(spec: mujoco.MjSpec) -> None:
    """PD actuators whose gains the simulation sets."""
    for name, limit in zip(robot.JOINTS, robot.TORQUE_LIMIT.tolist()):
        actuator = spec.add_actuator(name=name.removesuffix("_joint"), target=name)
        actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
        actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        actuator.ctrllimited, actuator.forcelimited = False, True
        actuator.forcerange = [-limit, limit]


def _add_surroundings(spec: mujoco.MjSpec) -> None:
    """A floor if there is none, and light and the cameras of our scene."""
    world = spec.worldbody
    if not any(geom.type == _PLANE for geom in world.geoms):
        world.add_geom(
            name="floor", type=_PLANE, size=[0, 0, 0.05], friction=[0.8, 0.02, 0.01], rgba=[0.5, 0.53, 0.57, 1]
        )
        world.add_light(pos=[1.5, -1.8, 6], dir=[-0.25, 0.3, -1], diffuse=[0.6, 0.6, 0.6])
    ours = mujoco.MjSpec.from_file(robot.SCENE_PATH)
    for camera in ours.worldbody.cameras:
        mine = world.add_camera(pos=camera.pos, quat=camera.quat, mode=camera.mode, fovy=camera.fovy)
        mine.alt.type, mine.alt.xyaxes = camera.alt.type, camera.alt.xyaxes
        _rename(mine, camera.name, spec.cameras)


def _check(model: mujoco.MjModel, path: object) -> None:
    """Refuse what does not stand as a Go1 does."""
    if (model.nq, model.nv, model.jnt_type[0]) != (19, 18, _FREE):
        raise InvalidInputError(
            f"{str(path)!r} must hold nothing that moves but one Go1: 18 degrees of freedom, got {model.nv}"
        )
    data = mujoco.MjData(model)
    data.qpos[:7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    for name, angle in zip(robot.JOINTS, robot.HOME_POSE):
        data.qpos[model.joint(name).qposadr] = angle
    mujoco.mj_kinematics(model, data)
    feet = np.array([data.geom_xpos[model.geom(f"{leg}_foot").id] for leg in robot.LEGS])
    ours = robot.NOMINAL_FOOT_B + [0.0, 0.0, robot.FOOT_RADIUS - robot.STANDING_HEIGHT]
    if np.abs(feet - ours).max() > TOLERANCE_M:
        raise InvalidInputError(
            f"feet of a Go1 in the home pose were expected at {ours.round(3).tolist()} m in the trunk frame, "
            f"{str(path)!r} has them at {feet.round(3).tolist()}"
        )
