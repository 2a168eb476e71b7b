"""One configuration per environment: brought into one form, refused before anything is made, kept through files."""

import dataclasses
import functools
import json
import pickle

import gymnasium
import numpy as np
import pytest

from experts import NMPCExpert
from go1_mtl_gym import (
    DomainRandomization,
    EnvConfig,
    EstimatorNoise,
    Go1Env,
    InvalidInputError,
    PDGains,
    PhysicsParams,
    SensorNoise,
    StateEstimatorConfig,
    robot,
)

FULL = EnvConfig(
    task="walk",
    tasks=("walk", "trot"),
    channels=("command", "phase"),
    history=3,
    control_hz=500,
    kp=40.0,
    kd=1.5,
    noise=SensorNoise(q=0.01),
    state_estimator=StateEstimatorConfig(attitude_s=2.0),
    randomization=DomainRandomization(payload_kg=None, fraction=0.5),
    episode_s=7.5,
    render_mode="rgb_array",
    width=64,
    height=48,
    physics=PhysicsParams(friction=0.5, action_delay_s=0.01),
)


class StandingExpert:
    """Asks for the home pose."""

    def __init__(self, gains, hold_s, pose=robot.HOME_POSE):
        self._pose = pose

    def reset(self, state):
        pass

    def action(self, state):
        return self._pose


def flat(config: EnvConfig) -> dict:
    """Keyword arguments as users write them, physics included."""
    arguments = config.as_arguments()
    return arguments | dataclasses.asdict(arguments.pop("physics"))


def test_an_environment_is_made_from_it_or_from_the_same_keyword_arguments():
    for env in (Go1Env(FULL), Go1Env(**FULL.as_arguments()), Go1Env(**flat(FULL))):
        assert env.config == FULL
        assert (env.tasks, env.control_hz, env.gains) == (FULL.tasks, 500, PDGains(40.0, 1.5))
        assert env.physics_params == FULL.physics
    assert gymnasium.make("Go1Trot-v0", **FULL.as_arguments()).unwrapped.config == FULL
    assert Go1Env("bound", kp=40).config == EnvConfig(task="bound", kp=40.0)
    with pytest.raises(InvalidInputError, match="an EnvConfig says everything; beside it came kp"):
        Go1Env(FULL, kp=40.0)


def test_equal_environments_have_equal_configurations():
    one = EnvConfig(
        tasks=["trot", "walk"],
        channels=["phase", "command"],
        history=np.int64(2),
        control_hz=np.float32(100),
        kp=np.float32(40.0),
        noise=True,
        estimator_noise=False,
        randomization={"friction": [0.5, 1], "fraction": np.float64(0.5)},
        episode_s=np.int32(3),
        width=np.uint16(320),
        expert=NMPCExpert,
        physics=PhysicsParams(payload_kg=np.int64(1)),
    )
    other = EnvConfig(
        tasks=("trot", "walk"),
        channels=("command", "phase"),
        history=2,
        control_hz=100,
        kp=40.0,
        noise=SensorNoise(),
        randomization=DomainRandomization(friction=(0.5, 1.0), fraction=0.5),
        episode_s=3.0,
        width=320,
        physics=PhysicsParams(payload_kg=1.0),
    )
    assert one == other and hash(one) == hash(other) and repr(one) == repr(other)
    numbers = (one.history, one.control_hz, one.kp, one.episode_s, one.width, one.physics.payload_kg)
    assert [type(number) for number in numbers] == [int, int, float, float, int, float]
    assert (one.control_s, one.episode_steps, one.gains) == (0.01, 300, PDGains(40.0))


@pytest.mark.parametrize("config", [EnvConfig(), FULL, EnvConfig(estimator_noise=EstimatorNoise(q=0.1))])
def test_it_comes_back_from_json_and_pickle(config):
    values = config.as_dict()
    assert json.loads(json.dumps(values, allow_nan=False)) == values
    assert EnvConfig.from_dict(values) == config == pickle.loads(pickle.dumps(config))
    assert EnvConfig.from_dict({}) == EnvConfig()


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"gravity": 1.6}, "field of an environment's configuration must be one of 'task', .*; got 'gravity'"),
        ({"noise": {"smell": 1.0}}, "field of noise must be one of 'accelerometer', .*; got 'smell'"),
        ({"physics": {"friction": "ice"}}, "friction must be a number.*'ice'"),
        ({"physics": None}, "physics must be a PhysicsParams, got None"),
    ],
)
def test_a_damaged_description_is_refused(values, words):
    with pytest.raises(InvalidInputError, match=words):
        EnvConfig.from_dict(values)


def test_an_expert_goes_by_its_name_where_it_can_be_imported():
    assert EnvConfig(expert=NMPCExpert).expert == "experts.nmpc:NMPCExpert"
    env = Go1Env("trot", expert=StandingExpert)
    assert env.config.expert == f"{__name__}:StandingExpert"
    env.reset(seed=0)
    np.testing.assert_allclose(env.action_map.to_radians(env.expert_action()), robot.HOME_POSE, atol=1e-6)


@pytest.mark.parametrize(
    "expert", [functools.partial(StandingExpert, pose=robot.HOME_POSE + 0.1), lambda **kwargs: StandingExpert(**kwargs)]
)
def test_another_callable_works_and_is_refused_only_by_a_file(expert):
    env = Go1Env("trot", expert=expert)
    env.reset(seed=0)
    env.expert_action()
    with pytest.raises(InvalidInputError, match='cannot be written to a file: give a class or function.*"module:name"'):
        env.config.as_dict()


def test_it_cannot_be_changed_and_a_changed_copy_is_checked():
    with pytest.raises(dataclasses.FrozenInstanceError):
        FULL.kp = 30.0
    assert dataclasses.replace(FULL, kp=30).kp == 30.0
    with pytest.raises(InvalidInputError, match="task must be one of 'walk', 'trot'; got 'bound'"):
        dataclasses.replace(FULL, task="bound")


@pytest.mark.parametrize("name", ["kp", "history", "control_hz", "episode_s", "width", "friction"])
def test_true_is_no_number(name):
    with pytest.raises(InvalidInputError, match=f"{name}.*got True"):
        Go1Env("trot", **{name: True})


@pytest.mark.parametrize(("size", "words"), [(15, "from 16 to 4096, got 15"), (4097, "4097"), (64.5, "64.5")])
def test_pictures_have_a_size_that_can_be_drawn(size, words):
    for name in ("width", "height"):
        with pytest.raises(InvalidInputError, match=rf"{name} \[pixels\] must be an integer.*{words}"):
            EnvConfig(**{name: size})
