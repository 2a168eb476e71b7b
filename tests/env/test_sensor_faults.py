"""Faults of the sensors: what is observed has them, the robot and its expert do not."""

import copy
import dataclasses
import json
import pickle

import gymnasium
import numpy as np
import pytest

from go1_mtl_gym import EnvConfig, Go1Env, InvalidInputError, SensorParams, robot
from go1_mtl_gym.sensing.observation import PROPRIOCEPTION
from go1_mtl_gym.sensing.sensor_faults import Reading, SensorFaults

CHANNELS = ("command", "gravity", "phase", "last_action")
OFFSETS = tuple(np.linspace(-0.05, 0.06, 12).tolist())
SENSED = (*PROPRIOCEPTION, "gravity")


def reading(value: float) -> Reading:
    return Reading(**{each.name: np.full(12, value) for each in dataclasses.fields(Reading)})


def walk(env: Go1Env, steps: int = 30, seed: int = 4) -> list[np.ndarray]:
    """Observations of an episode under fixed actions, the first one included."""
    actions = np.random.default_rng(0).uniform(-0.1, 0.1, (steps, 12))
    return [env.reset(seed=seed)[0], *(env.step(action)[0] for action in actions)]


def parts(env: Go1Env, observation: np.ndarray) -> dict[str, np.ndarray]:
    return {name: observation[where] for name, where in env.layout.slices.items()}


# -- Encoders ----------------------------------------------------------------------------------------------------------


def test_an_offset_is_added_to_the_joint_positions_and_to_nothing_else():
    env, plain = (
        Go1Env(channels=CHANNELS, history=1, sensors=SensorParams(OFFSETS)),
        Go1Env(channels=CHANNELS, history=1),
    )
    for seen, exact in zip(walk(env), walk(plain)):
        seen, exact = parts(env, seen), parts(plain, exact)
        np.testing.assert_allclose(seen["q"] - exact["q"], OFFSETS, atol=1e-6)
        assert all((seen[name] == exact[name]).all() for name in seen if name != "q")
    np.testing.assert_array_equal(env.state.q, plain.state.q)
    np.testing.assert_array_equal(env.expert_action(), plain.expert_action())


def test_a_single_number_is_the_largest_of_offsets_that_every_episode_draws():
    env, plain = Go1Env(sensors={"encoder_offset": 0.04}), Go1Env()
    drawn = []
    for seed in range(40):
        observation, expected = env.reset(seed=seed)[0], plain.reset(seed=seed)[0]
        first = parts(env, observation)["q"] - parts(plain, expected)["q"]
        later = parts(env, env.step(np.zeros(12))[0])["q"] - parts(plain, plain.step(np.zeros(12))[0])["q"]
        np.testing.assert_allclose(later, first, atol=1e-6)
        drawn.append(first)
        assert (parts(env, observation)["command"] == parts(plain, expected)["command"]).all()
    drawn = np.array(drawn)
    assert np.abs(drawn).max() <= 0.04 + 1e-6 and drawn.std() == pytest.approx(0.04 / np.sqrt(3), rel=0.1)
    assert np.abs(drawn.mean(axis=0)).max() < 0.02 and len(np.unique(drawn.round(6))) > 400
    np.testing.assert_array_equal(env.reset(seed=3)[0], env.reset(seed=3)[0])


def test_what_is_drawn_takes_as_many_numbers_whatever_it_is():
    one, other = np.random.default_rng(0), np.random.default_rng(0)
    assert SensorParams(0.0).drawn(one) == SensorParams() and not SensorParams(OFFSETS).is_drawn
    assert SensorParams(0.02, 0.01).drawn(other).delay_s == 0.01
    assert one.uniform() == other.uniform()


# -- Delay -------------------------------------------------------------------------------------------------------------


def test_readings_in_their_line_by_hand():
    faults = SensorFaults.of(SensorParams(delay_s=0.03), 50)  # one and a half periods
    assert faults.early == 10
    assert [faults.observe(reading(value)).q[0] for value in (0.0, 10.0, 30.0, 50.0)] == [0.0, 0.0, 10.0, 30.0]
    faults = SensorFaults.of(SensorParams(delay_s=0.04), 50)
    assert faults.early == 0
    assert [faults.observe(reading(value)).q[0] for value in (0.0, 20.0, 40.0, 60.0)] == [0.0, 0.0, 0.0, 20.0]


@pytest.mark.parametrize(("late_ms", "control_hz"), [(1, 50), (8, 50), (20, 50), (33, 50), (3, 500), (2, 1000)])
def test_a_late_reading_is_that_of_the_millisecond_it_was_taken_in(late_ms, control_hz):
    """The same targets at 1 kHz give every millisecond's readings."""
    env = Go1Env(channels=CHANNELS, control_hz=control_hz, sensors=SensorParams(delay_s=late_ms / 1000))
    every = Go1Env(channels=CHANNELS, control_hz=1000)
    fine, period = [parts(every, every.reset(seed=4)[0])], 1000 // control_hz
    seen = [parts(env, env.reset(seed=4)[0])]
    for action in np.random.default_rng(0).uniform(-0.1, 0.1, (20, 12)):
        fine += [parts(every, every.step(action)[0]) for _ in range(period)]
        seen.append(parts(env, env.step(action)[0]))
    for step, late in enumerate(seen):
        exact = fine[max(step * period - late_ms, 0)]
        for name in SENSED:
            np.testing.assert_allclose(late[name], exact[name], rtol=1e-3, atol=2e-3, err_msg=f"{name} {step}")


def test_a_delay_shows_in_readings_alone_and_leaves_the_physics_as_they_are_to_the_bit():
    env = Go1Env(channels=CHANNELS, history=1, sensors=SensorParams(delay_s=0.013))
    plain = Go1Env(channels=CHANNELS, history=1)
    differ = set()
    for late, exact in zip(walk(env), walk(plain)):
        late, exact = parts(env, late), parts(plain, exact)
        differ |= {name for name in late if not np.array_equal(late[name], exact[name])}
    assert differ == set(SENSED)
    np.testing.assert_array_equal(env.simulation.snapshot(), plain.simulation.snapshot())
    np.testing.assert_array_equal(env.expert_action(), plain.expert_action())


def test_the_state_estimator_lives_on_faulty_readings():
    kwargs = {"control_hz": 500, "state_estimator": True}
    env = Go1Env(sensors=SensorParams(OFFSETS, 0.004), **kwargs)
    walk(env)
    np.testing.assert_allclose(env.estimated_state.q, parts(env, walk(env)[-1])["q"], atol=1e-6)
    assert np.abs(env.estimated_state.q - env.state.q).max() > 0.03


# -- As an argument ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_with_the_readings_on_their_way(duplicate):
    env = Go1Env(history=2, noise=True, sensors={"encoder_offset": 0.03, "delay_s": 0.033})
    walk(env, 10)
    twin = duplicate(env)
    for action in np.random.default_rng(1).uniform(-0.2, 0.2, (10, 12)):
        np.testing.assert_array_equal(env.step(action)[0], twin.step(action)[0])
    np.testing.assert_array_equal(env.reset()[0], twin.reset()[0])


def test_they_come_back_from_files_and_through_gymnasium_make():
    config = EnvConfig(sensors={"encoder_offset": list(OFFSETS), "delay_s": np.float32(0.5) / 64})
    assert config.sensors == SensorParams(OFFSETS, 0.0078125) and hash(config)
    assert EnvConfig.from_dict(json.loads(json.dumps(config.as_dict()))) == config
    assert EnvConfig(sensors=SensorParams(np.array(OFFSETS))).sensors.encoder_offset == OFFSETS
    assert gymnasium.make("Go1Trot-v0", sensors=SensorParams(0.02)).unwrapped.config.sensors.encoder_offset == 0.02


@pytest.mark.parametrize(
    ("sensors", "words"),
    [
        ({"encoder_offset": -0.1}, r"sensor encoder_offset \[rad\] must lie in \[0, 0.5\], got -0.1"),
        ({"encoder_offset": (0.1,) * 3}, r"sensor encoder_offset \[rad\] must have shape \(12,\)"),
        ({"encoder_offset": (0.1,) * 11 + (0.6,)}, r"encoder_offset \[rad\] must lie in \[-0.5, 0.5\], got 0.6"),
        ({"encoder_offset": "bent"}, "encoder_offset.*'bent'"),
        ({"encoder_offset": None}, "encoder_offset.*None"),
        ({"delay_s": 0.051}, r"sensor delay_s \[s\] must lie in \[0, 0.05\], got 0.051"),
        ({"smell": 1.0}, "field of sensors must be one of 'encoder_offset', 'delay_s'; got 'smell'"),
        (None, "sensors must be a SensorParams, got None"),
    ],
)
def test_impossible_faults_are_refused(sensors, words):
    with pytest.raises(InvalidInputError, match=words):
        Go1Env(sensors=sensors)
    assert len(OFFSETS) == len(robot.JOINTS)
