"""Errors of the state estimator: their size, where they enter, and that nothing else notices them."""

import dataclasses

import numpy as np
import pytest

from go1_mtl_gym import EstimatorNoise, robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.state_noise import EstimatorError

SILENT = EstimatorNoise(**{each.name: 0.0 for each in dataclasses.fields(EstimatorNoise)})
EXACT = ("contacts", "gait", "phase", "command", "time_s")


def home(env: Go1Env) -> np.ndarray:
    return env.action_map.from_radians(robot.HOME_POSE)


def errors(env: Go1Env) -> np.ndarray:
    """Estimated minus true: height, roll and pitch, velocity (trunk frame), angular velocity, q, dq; shape (33,)."""
    true, seen = env.state, env.estimated_state
    np.testing.assert_allclose(np.linalg.norm(seen.quat_wxyz), 1.0)
    np.testing.assert_array_equal(seen.position_w[:2], true.position_w[:2])
    assert seen.rpy[2] == pytest.approx(true.rpy[2], abs=1e-9)
    for name in EXACT:
        assert np.array_equal(getattr(seen, name), getattr(true, name))
    velocity = true.rotation.T @ (seen.linear_velocity_w - true.linear_velocity_w)
    omega = seen.angular_velocity_b - true.angular_velocity_b
    height = seen.position_w[2:] - true.position_w[2:]
    return np.concatenate([height, (seen.rpy - true.rpy)[:2], velocity, omega, seen.q - true.q, seen.v - true.v])


def test_without_noise_the_estimate_is_the_state():
    for noise in (None, False):
        env = Go1Env("trot", estimator_noise=noise)
        env.reset(seed=0)
        true, seen = env.state, env.estimated_state
        assert all(np.array_equal(getattr(true, f.name), getattr(seen, f.name)) for f in dataclasses.fields(true))
    env = Go1Env("trot", estimator_noise=SILENT)
    env.reset(seed=0)
    env.step(home(env))
    np.testing.assert_allclose(errors(env), 0.0, atol=1e-12)


def test_white_noise_has_the_sizes_asked_for():
    sizes = {"height": 0.01, "attitude": 0.02, "velocity": 0.1, "angular_velocity": 0.2, "q": 0.003, "dq": 0.4}
    env = Go1Env("trot", estimator_noise=dataclasses.replace(SILENT, **sizes))
    env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    drawn = []
    for _ in range(600):
        env.step(home(env))
        drawn.append(errors(env))
    expected = np.repeat(list(sizes.values()), [1, 2, 3, 3, 12, 12])
    np.testing.assert_allclose(np.std(drawn, axis=0), expected, rtol=0.12)
    assert (np.abs(np.mean(drawn, axis=0)) < 5 * expected / np.sqrt(600)).all()
    lag = np.mean(np.multiply(drawn[1:], drawn[:-1]), axis=0) / expected**2
    assert np.abs(lag).max() < 0.2


def test_a_bias_is_constant_in_an_episode_and_drawn_anew_in_the_next():
    sizes = {"height_bias": 0.01, "attitude_bias": 0.02, "velocity_bias": 0.1}
    sizes |= {"angular_velocity_bias": 0.2, "q_bias": 0.003, "dq_bias": 0.4}
    env = Go1Env("trot", estimator_noise=dataclasses.replace(SILENT, **sizes))
    drawn = []
    for episode in range(150):
        env.reset(seed=0 if episode == 0 else None)
        drawn.append(errors(env))
        env.step(home(env))
        np.testing.assert_allclose(errors(env), drawn[-1], atol=1e-9)
    expected = np.repeat(list(sizes.values()), [1, 2, 3, 3, 12, 12])
    np.testing.assert_allclose(np.std(drawn, axis=0), expected, rtol=0.25)


def test_the_defaults():
    noise = EstimatorNoise()
    assert (noise.velocity, noise.velocity_bias, noise.attitude, noise.attitude_bias) == (0.05, 0.03, 0.01, 0.01)
    assert (noise.height, noise.height_bias, noise.angular_velocity, noise.angular_velocity_bias) == (
        0.01, 0.01, 0.05, 0.01,
    )  # fmt: skip
    assert (noise.q, noise.q_bias, noise.dq, noise.dq_bias) == (0.005, 0.0, 0.25, 0.0)
    assert noise.spread().shape == (33,) == noise.spread("_bias").shape


def test_the_expert_sees_the_estimate_and_nobody_else_does():
    seen = []

    class Watching:
        def __init__(self, gains, hold_s):
            pass

        def reset(self, state):
            seen.append(state)

        def action(self, state):
            seen.append(state)
            return robot.HOME_POSE

    noisy, exact = Go1Env("trot", estimator_noise=True, expert=Watching), Go1Env("trot")
    observation, _ = noisy.reset(seed=0)
    np.testing.assert_array_equal(observation, exact.reset(seed=0)[0])
    for _ in range(5):
        noisy.expert_action()
        assert (seen[-1].q == noisy.estimated_state.q).all() and (seen[-1].q != noisy.state.q).any()
        (a, reward_a, *_, info_a), (b, reward_b, *_, info_b) = noisy.step(home(noisy)), exact.step(home(exact))
        np.testing.assert_array_equal(a, b)
        assert reward_a == reward_b and all(np.array_equal(info_a[key], info_b[key]) for key in info_a)
    count = len(seen)
    noisy.reset()
    assert len(seen) == count + 1 and (seen[-1].v == noisy.estimated_state.v).all()


def test_asking_twice_gives_the_same_and_changes_nothing():
    env, twin = (Go1Env("trot", estimator_noise=True) for _ in range(2))
    env.reset(seed=3), twin.reset(seed=3)
    for _ in range(4):
        first = env.expert_action()
        np.testing.assert_array_equal(env.expert_action(), first)
        for _ in range(3):
            assert (env.estimated_state.v == env.estimated_state.v).all()
        np.testing.assert_array_equal(twin.expert_action(), first)
        env.step(first), twin.step(first)
        np.testing.assert_array_equal(env.estimated_state.v, twin.estimated_state.v)


def test_seeds_decide():
    env = Go1Env("trot", estimator_noise=True)
    seen = []
    for seed in (1, 1, 2):
        env.reset(seed=seed)
        seen.append(errors(env))
    np.testing.assert_array_equal(seen[0], seen[1])
    assert (seen[0] != seen[2]).all()


def test_the_attitudes_errors_are_of_roll_and_pitch_wherever_the_robot_heads():
    env = Go1Env("trot")
    env.reset(seed=0)
    half = np.array([0.0, 0.0, 1.0]) / 2  # yaw 1 rad
    state = dataclasses.replace(env.state, quat_wxyz=np.r_[np.cos(half[2]), 0.0, 0.0, np.sin(half[2])])
    error = EstimatorError(dataclasses.replace(SILENT, attitude=0.1), seed=0)
    seen = error.estimate(state)
    assert seen.rpy[2] == pytest.approx(1.0) and (np.abs(seen.rpy[:2]) > 1e-3).all()
    np.testing.assert_allclose(error.estimate(seen).rpy[:2], 2 * seen.rpy[:2], atol=1e-12)


@pytest.mark.parametrize("change", [{"height": -0.1}, {"q_bias": float("nan")}, {"dq": "much"}])
def test_impossible_figures_are_refused(change):
    with pytest.raises(InvalidInputError, match=f"estimator noise {next(iter(change))}"):
        EstimatorNoise(**change)
