"""Contact points by the joints alone, next to MuJoCo's."""

import mujoco
import numpy as np
import pytest

from go1_mtl_gym import robot
from go1_mtl_gym.kinematics import contact_points, leg_kinematics


def test_points_and_velocities_are_mujocos():
    model = mujoco.MjModel.from_xml_path(robot.MODEL_PATH)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    jacobian = np.zeros((3, model.nv))
    for _ in range(5):
        q, dq, up = robot.HOME_POSE + rng.normal(0, 0.4, 12), rng.normal(0, 3, 12), rng.normal(size=3)
        up /= np.linalg.norm(up)
        data.qpos[:7], data.qpos[7:], data.qvel[6:] = [0, 0, 0, 1, 0, 0, 0], q, dq
        mujoco.mj_forward(model, data)
        points, velocities = contact_points(q, dq, up)
        for leg, point, velocity in zip(robot.LEGS, points, velocities, strict=True):
            foot = model.geom(f"{leg}_foot")
            lowest = data.geom_xpos[foot.id] - robot.FOOT_RADIUS * up
            np.testing.assert_allclose(point, lowest, atol=1e-12)
            mujoco.mj_jac(model, data, jacobian, None, lowest, foot.bodyid[0])
            np.testing.assert_allclose(velocity, jacobian @ data.qvel, atol=1e-12)


def test_the_velocity_is_the_materials():
    """Not the lowest point as it wanders over the foot is meant, but the material that is there."""
    q = robot.HOME_POSE.copy()
    up = np.array([0.0, 0.0, 1.0])
    step = 1e-6
    dq = np.zeros(12)
    dq[1::3] = 2.0
    before, velocity = contact_points(q, dq, up)
    after, _ = contact_points(q + step * dq, dq, up)
    # The lowest point of a turning ball moves with its centre; the material there moves by omega x r more.
    expected = np.cross([0.0, 2.0, 0.0], -robot.FOOT_RADIUS * up)
    np.testing.assert_allclose(velocity - (after - before) / step, np.tile(expected, (4, 1)), atol=1e-5)


def test_leg_kinematics_tell_the_velocity_of_the_trunk_over_feet_that_stand_still():
    """A trunk with velocity v and turn w: a foot at p that stands still moves with -(v + w x p) against the trunk."""
    rng = np.random.default_rng(5)
    q, w, v = robot.HOME_POSE + rng.uniform(-0.3, 0.3, 12), rng.normal(size=3), rng.normal(size=3)
    feet = leg_kinematics(q, np.zeros(12), np.zeros(3))[:12].reshape(4, 3)
    step = 1e-6
    jacobian = np.stack(
        [(leg_kinematics(q + step * e, np.zeros(12), np.zeros(3))[:12] - feet.ravel()) / step for e in np.eye(12)],
        axis=1,
    )
    dq = np.linalg.solve(jacobian, -(v + np.cross(w, feet)).ravel())
    told = leg_kinematics(q, dq, w)
    assert told[:12].reshape(4, 3) == pytest.approx(feet)
    assert told[12:].reshape(4, 3) == pytest.approx(np.tile(v, (4, 1)), abs=1e-4)
