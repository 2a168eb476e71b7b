"""What the environment puts into the observation: sensors, channels, history and noise."""

import numpy as np
import pytest

from go1_mtl_gym import robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.episode import COMMAND_FILTER_S
from go1_mtl_gym.sensing.observation import SensorNoise

ALL = ("command", "gravity", "phase", "last_action")


def actions(count: int, seed: int = 0) -> np.ndarray:
    """Gentle random actions around the home pose, shape (count, 12)."""
    home = Go1Env("trot").action_map.from_radians(robot.HOME_POSE)
    return home + np.random.default_rng(seed).uniform(-0.05, 0.05, (count, 12))


def read(env: Go1Env, observation: np.ndarray) -> dict[str, np.ndarray]:
    return {name: observation[where] for name, where in env.layout.slices.items()}


def test_proprioception_is_that_of_the_state():
    env = Go1Env("trot")
    env.reset(seed=0)
    for action in actions(10):
        observation, *_, info = env.step(action)
        seen = read(env, observation)
        np.testing.assert_allclose(seen["q"], env.state.q, atol=1e-6)
        np.testing.assert_allclose(seen["dq"], env.state.v, rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(seen["gyroscope"], env.state.angular_velocity_b, rtol=1e-4, atol=1e-5)
        np.testing.assert_array_equal(seen["contacts"], info["contacts"])


def test_accelerometer_of_a_robot_at_rest_feels_gravity_upwards():
    env = Go1Env("trot", episode_s=10)
    env.reset(seed=0)
    home = env.action_map.from_radians(robot.HOME_POSE)
    for _ in range(150):
        observation, *_ = env.step(home)
    np.testing.assert_allclose(read(env, observation)["accelerometer"], -9.81 * env.state.gravity_b, atol=0.05)


def test_accelerometer_in_free_fall_reads_nearly_nothing():
    env = Go1Env("trot")
    env.reset(seed=0)
    env.simulation.data.qpos[2] = 5.0
    observation, *_ = env.step(env.action_map.from_radians(env.state.q))
    assert np.abs(read(env, observation)["accelerometer"]).max() < 0.5
    assert not read(env, observation)["contacts"].any()


@pytest.mark.parametrize("task", ["bound", "gallop"])  # they cannot stand, so their clocks run at once
def test_phase_channel_is_sine_and_cosine_of_the_gait_clock(task):
    env = Go1Env(task, channels=ALL)
    observation, _ = env.reset(seed=0)
    period = env.task.gait.period
    for step, action in enumerate([None, *actions(40)]):
        if action is not None:
            observation, *_, info = env.step(action)
            assert abs((info["phase"] - step * 0.02 / period + 0.5) % 1.0 - 0.5) < 1e-9 and 0 <= info["phase"] < 1
        turn = 2 * np.pi * step * 0.02 / period
        np.testing.assert_allclose(read(env, observation)["phase"], [np.sin(turn), np.cos(turn)], atol=1e-6)


def test_gravity_channel_is_the_unit_vector_of_the_state():
    env = Go1Env("trot", channels=ALL)
    observation, _ = env.reset(seed=0)
    for action in actions(10):
        observation, *_ = env.step(action)
        gravity = read(env, observation)["gravity"]
        np.testing.assert_allclose(gravity, env.state.gravity_b, atol=1e-6)
        assert np.linalg.norm(gravity) == pytest.approx(1.0, abs=1e-6)


def test_last_action_is_the_one_just_applied_after_clipping():
    env = Go1Env("trot", channels=ALL)
    observation, _ = env.reset(seed=0)
    home = env.action_map.from_radians(robot.HOME_POSE)
    np.testing.assert_allclose(read(env, observation)["last_action"], home, atol=1e-6)
    for action in actions(5):
        observation, *_ = env.step(action)
        np.testing.assert_allclose(read(env, observation)["last_action"], action, atol=1e-6)
    observation, *_ = env.step(np.full(12, 7.0))
    assert read(env, observation)["last_action"].tolist() == [1.0] * 12


@pytest.mark.parametrize("control_hz", [50, 100])
def test_command_is_low_passed(control_hz):
    env = Go1Env("trot", channels=("command",), control_hz=control_hz)
    command = np.array([0.5, -0.2, 0.3])
    observation, info = env.reset(seed=0, options={"command": command})
    assert not read(env, observation)["command"].any()
    np.testing.assert_array_equal(info["command"], command)
    home = env.action_map.from_radians(robot.HOME_POSE)
    for step in range(1, control_hz // 5 + 1):
        observation, *_, info = env.step(home)
        expected = command * (1 - np.exp(-step / control_hz / COMMAND_FILTER_S))
        np.testing.assert_allclose(info["filtered_command"], expected, atol=1e-12)
        np.testing.assert_allclose(read(env, observation)["command"], expected, atol=1e-6)
    np.testing.assert_allclose(expected, 0.632120559 * command, rtol=1e-6)  # after one time constant of .2 s


def test_history_holds_the_earlier_frames_newest_first():
    env = Go1Env("trot", channels=("phase",), history=4)
    observation, _ = env.reset(seed=0)
    frames = [observation[:34]] * 4  # before the first step every older frame is the first one
    for action in [*actions(8), None]:
        np.testing.assert_array_equal(read(env, observation)["history"], np.concatenate(frames[-2:-5:-1]))
        if action is not None:
            observation, *_ = env.step(action)
            frames.append(observation[:34])
    assert any((frames[-1] != older).any() for older in frames[-4:-1])


def test_history_does_not_reach_into_the_last_episode():
    env = Go1Env("trot", history=3)
    first, _ = env.reset(seed=0)
    for action in actions(5):
        env.step(action)
    again, _ = env.reset(seed=0)
    np.testing.assert_array_equal(first, again)


def test_task_one_hot_follows_the_order_of_the_environments_tasks():
    env = Go1Env("walk", tasks=("walk", "trot"))
    observation, _ = env.reset(seed=0)
    assert observation[-2:].tolist() == [1, 0]
    observation, _ = env.reset(options={"task": "trot"})
    assert observation[-2:].tolist() == [0, 1]


@pytest.fixture(scope="module")
def residuals() -> dict[str, np.ndarray]:
    """Noisy minus exact reading over an episode of two environments that do the same, shape (500, size) per part."""
    exact, noisy = Go1Env("trot", channels=ALL), Go1Env("trot", channels=ALL, noise=True)
    exact.reset(seed=0), noisy.reset(seed=0)
    rows = []
    for action in actions(500):
        (a, *_), (b, *_) = exact.step(action), noisy.step(action)
        rows.append(b.astype(float) - a)
    np.testing.assert_array_equal(exact.state.q, noisy.state.q)  # noise is on the sensors only
    rows = np.array(rows)
    return {name: rows[:, where] for name, where in exact.layout.slices.items()}


@pytest.mark.parametrize("name", ["accelerometer", "gyroscope", "q", "dq", "gravity"])
def test_noise_has_the_documented_sigma(residuals, name):
    sample = residuals[name][:, :2] if name == "gravity" else residuals[name]  # the z component is clipped at -1
    sigma = getattr(SensorNoise(), name)
    assert sample.std() == pytest.approx(sigma, rel=4 / np.sqrt(2 * sample.size))
    assert abs(sample.mean()) < 4 * sigma / np.sqrt(sample.size)
    lag = np.mean(sample[1:] * sample[:-1]) / sigma**2
    assert abs(lag) < 4 / np.sqrt(sample.size), "white: no correlation from one step to the next"


@pytest.mark.parametrize("name", ["contacts", "command", "phase", "last_action", "task"])
def test_noise_leaves_what_is_not_a_sensor_alone(residuals, name):
    assert not residuals[name].any()


def test_noise_of_ones_own_and_none_by_default():
    plain, off, loud = Go1Env("trot"), Go1Env("trot", noise=False), Go1Env("trot", noise=SensorNoise(q=0.5))
    first = [env.reset(seed=1)[0] for env in (plain, off, loud)]
    np.testing.assert_array_equal(first[0], first[1])
    np.testing.assert_allclose(first[0][6:18], plain.state.q, atol=1e-6)
    assert 0.2 < np.std(first[2][6:18] - first[0][6:18]) < 1.0


def test_noisy_observations_stay_in_bounds():
    env = Go1Env("trot", channels=ALL, history=2, noise=SensorNoise(*[10.0] * 5))
    env.reset(seed=0)
    saturated = 0
    for action in actions(50):
        observation, *_ = env.step(action)
        assert env.observation_space.contains(observation)
        saturated += (observation == env.observation_space.high).sum()
    assert saturated > 10
