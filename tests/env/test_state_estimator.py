"""The state estimator: right where the readings are, near the truth where they are noisy, and fed by nothing else."""

import dataclasses

import gymnasium
import numpy as np
import pytest

from experts import HARDWARE_LIKE
from go1_mtl_gym import TASKS, RobotState, StateEstimatorConfig, robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.state_estimator import StateEstimator

ROBOT = {**HARDWARE_LIKE, "estimator_noise": None, "state_estimator": True}
UP = np.array([0.0, 0.0, robot.GRAVITY])
READINGS = {
    "accelerometer": UP,
    "gyroscope": np.zeros(3),
    "q": robot.HOME_POSE,
    "dq": np.zeros(12),
    "contacts": np.zeros(4),
}


def standing(**change) -> RobotState:
    state = RobotState(
        position_w=np.array([1.0, 2.0, robot.STANDING_HEIGHT]),
        quat_wxyz=np.array([1.0, 0.0, 0.0, 0.0]),
        linear_velocity_w=np.zeros(3),
        angular_velocity_b=np.zeros(3),
        q=robot.HOME_POSE,
        v=np.zeros(12),
        contacts=np.ones(4, dtype=bool),
        gait=TASKS["trot"].gait,
        phase=0.0,
        command=np.zeros(3),
    )
    return dataclasses.replace(state, **change)


def begun(state: RobotState, **config) -> StateEstimator:
    estimator = StateEstimator(StateEstimatorConfig(**config))
    estimator.begin(state, READINGS)
    return estimator


def errors(env: Go1Env) -> np.ndarray:
    """Estimated minus true: height, roll, pitch, velocity (trunk frame), shape (6,)."""
    true, seen = env.state, env.estimated_state
    velocity = true.rotation.T @ (seen.linear_velocity_w - true.linear_velocity_w)
    return np.r_[seen.position_w[2] - true.position_w[2], (seen.rpy - true.rpy)[:2], velocity]


# -- The filter alone --------------------------------------------------------------------------------------------------


def test_it_begins_with_the_state_of_a_robot_that_stands():
    half = 0.5  # a heading of 1 rad
    state = standing(quat_wxyz=np.array([np.cos(half), 0.0, 0.0, np.sin(half)]))
    seen = begun(state).estimate(state)
    for name in ("position_w", "quat_wxyz", "linear_velocity_w", "angular_velocity_b", "q", "v"):
        np.testing.assert_allclose(getattr(seen, name), getattr(state, name), atol=1e-12, err_msg=name)
    later = dataclasses.replace(state, phase=0.25, command=np.array([0.5, 0.0, 0.0]), contacts=np.zeros(4, dtype=bool))
    seen = begun(state).estimate(later)
    assert seen.phase == 0.25 and seen.command[0] == 0.5 and not seen.contacts.any()


def test_in_the_air_it_integrates():
    estimator = begun(standing(), attitude_s=1e3)
    for _ in range(100):
        estimator.advance(READINGS | {"accelerometer": UP + [1.0, 0.0, -2.0]}, 0.01)
    seen = estimator.estimate(standing())
    # The first period begins with a reading of rest, so the mean acceleration over it is half.
    np.testing.assert_allclose(seen.linear_velocity_w, np.array([1.0, 0.0, -2.0]) * 0.995, atol=0.02)
    np.testing.assert_allclose(seen.position_w - [1.0, 2.0, robot.STANDING_HEIGHT], [0.495, 0.0, -0.99], atol=0.02)


def test_the_gyroscope_turns_it():
    estimator = begun(standing(), attitude_s=1e3)
    turning = READINGS | {"gyroscope": np.array([0.0, 0.0, 0.5])}
    estimator.advance(turning, 0.0)
    for _ in range(200):
        estimator.advance(turning, 0.01)
    assert estimator.estimate(standing()).rpy == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)
    np.testing.assert_array_equal(estimator.estimate(standing()).angular_velocity_b, [0.0, 0.0, 0.5])


def test_the_accelerometer_sees_up_in_the_time_it_is_given():
    tilt = 0.1
    state = standing(quat_wxyz=np.array([np.cos(tilt / 2), np.sin(tilt / 2), 0.0, 0.0]))
    estimator = begun(state, attitude_s=2.0)  # believes in a roll that is none
    for _ in range(200):
        estimator.advance(READINGS, 0.01)
    assert estimator.estimate(state).rpy[0] == pytest.approx(tilt * np.exp(-1.0), rel=0.02)


def test_feet_that_stand_say_how_fast_and_how_high_the_trunk_is():
    estimator = begun(standing(position_w=np.array([0.0, 0.0, 0.35])))  # believes to be too high
    dq = np.zeros(12)
    dq[1::3] = 1.0  # thighs swing back under the trunk, or the trunk moves over its feet
    moving = READINGS | {"dq": dq, "contacts": np.array([1.0, 0.0, 0.0, 1.0])}
    for _ in range(1000):
        estimator.advance(moving, 0.002)
    seen = estimator.estimate(standing())
    reach = robot.STANDING_HEIGHT
    assert seen.position_w[2] == pytest.approx(reach, abs=1e-3)
    np.testing.assert_allclose(seen.linear_velocity_w, [reach, 0.0, 0.0], atol=2e-2)


def test_a_foot_counts_once_it_has_settled():
    dq = np.ones(12)
    landed = READINGS | {"dq": dq, "contacts": np.ones(4)}
    estimator = begun(standing(), settle_s=0.009)
    for _ in range(4):
        estimator.advance(landed, 0.002)
        np.testing.assert_allclose(estimator.estimate(standing()).linear_velocity_w, 0.0, atol=1e-12)
    estimator.advance(landed, 0.002)
    assert np.linalg.norm(estimator.estimate(standing()).linear_velocity_w) > 1e-3


@pytest.mark.parametrize("change", [{"attitude_s": 0.0}, {"foot_speed": float("nan")}, {"settle_s": -1.0}])
def test_impossible_figures_are_refused(change):
    with pytest.raises(InvalidInputError, match=f"state estimator {next(iter(change))}"):
        StateEstimatorConfig(**change)


# -- In the environment ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("task", TASKS)
def test_the_expert_walks_by_its_own_estimate(task):
    env = Go1Env(task, **ROBOT)
    env.reset(seed=0, options={"command": (0.4, 0.1, 0.3)})
    seen, speeds = [], []
    for step in range(1500):
        *_, terminated, _, info = env.step(env.expert_action())
        assert not terminated, step
        seen.append(errors(env))
        speeds.append(info["base_velocity"][0])
    seen = np.array(seen[500:])
    rms = np.sqrt(np.mean(seen**2, axis=0))
    assert (rms < [0.01, 0.02, 0.02, 0.05, 0.05, 0.15]).all(), rms
    assert np.mean(speeds[750:]) == pytest.approx(0.4, abs=0.1)


def test_without_noise_it_knows_what_the_sensors_say():
    env = Go1Env("trot", control_hz=500, state_estimator=True)
    env.reset(seed=0)
    for _ in range(100):
        env.step(env.expert_action())
    true, seen = env.state, env.estimated_state
    for name, atol in (("q", 1e-6), ("v", 1e-5), ("angular_velocity_b", 1e-5)):
        np.testing.assert_allclose(getattr(seen, name), getattr(true, name), atol=atol)
    assert (np.abs(errors(env)) < [0.005, 0.01, 0.01, 0.05, 0.05, 0.05]).all()
    np.testing.assert_array_equal(seen.contacts, true.contacts)


def test_it_is_told_what_the_student_sees_and_nobody_else_notices():
    env, plain = Go1Env("trot", **ROBOT), Go1Env("trot", **(ROBOT | {"state_estimator": None}))
    observation, _ = env.reset(seed=0)
    np.testing.assert_array_equal(observation, plain.reset(seed=0)[0])
    for _ in range(20):
        action = env.expert_action()
        observation, reward, *_ = env.step(action)
        other, same, *_ = plain.step(action)
        np.testing.assert_array_equal(observation, other)
        assert reward == same
        for name, part in (("q", "q"), ("v", "dq"), ("angular_velocity_b", "gyroscope")):
            np.testing.assert_array_equal(getattr(env.estimated_state, name), observation[env.layout.slices[part]])


def test_it_begins_anew_with_every_episode():
    env, fresh = Go1Env("trot", **ROBOT), Go1Env("trot", **ROBOT)
    env.reset(seed=0)
    for _ in range(50):
        env.step(env.expert_action())
    env.reset(seed=1), fresh.reset(seed=1)
    np.testing.assert_array_equal(env.expert_action(), fresh.expert_action())
    np.testing.assert_allclose(errors(env), 0.0, atol=0.02)


def test_an_estimator_and_anothers_noise_are_too_much():
    with pytest.raises(InvalidInputError, match="give one of them"):
        Go1Env("trot", state_estimator=True, estimator_noise=True)
    with pytest.raises(InvalidInputError, match="state_estimator must be None, True, False or a StateEstimatorConfig"):
        gymnasium.make("Go1Trot-v0", state_estimator="kalman")
