"""Randomised episodes: figures within their ranges, reproducible, copied to the bit, and no trace of them otherwise."""

import copy
import dataclasses
import json
import pickle

import gymnasium
import numpy as np
import pytest

from go1_mtl_gym import DomainRandomization, SensorNoise, SensorParams, robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sim.domain_randomization import EpisodeConditions, Range
from go1_mtl_gym.sim.physics_params import PhysicsParams

RANGES = [each.name for each in dataclasses.fields(DomainRandomization) if each.type == Range]
NOTHING = DomainRandomization(**dict.fromkeys(RANGES))


def draws(
    randomization: DomainRandomization, number: int, base: EpisodeConditions | None = None
) -> list[EpisodeConditions]:
    rng = np.random.default_rng(0)
    return [randomization.draw(rng, base or EpisodeConditions()) for _ in range(number)]


# -- Draws -------------------------------------------------------------------------------------------------------------


def test_draws_fill_their_ranges_evenly_and_independently():
    default = DomainRandomization()
    assert len(RANGES) == len(dataclasses.fields(PhysicsParams)) + len(dataclasses.fields(SensorParams)) + 2
    drawn = [name for name in RANGES if name != "encoder_offset"]  # it shows in the offsets alone

    def figures(one: EpisodeConditions) -> list[float]:
        others = {"noise": one.noise, "sensor_delay_s": one.sensors.delay_s, "settle_s": one.settle_s}
        named = dataclasses.asdict(one.physics) | others
        return [named[name] for name in drawn]

    rows = np.array([figures(one) for one in draws(default, 2000)])
    low, high = np.array([getattr(default, name) for name in drawn]).T
    level = (rows - low) / (high - low)
    assert (level >= 0).all() and (level <= 1).all()
    np.testing.assert_allclose(level.mean(axis=0), 0.5, atol=4 * np.sqrt(1 / 12 / 2000))
    assert level.min(axis=0).max() < 0.01 and level.max(axis=0).min() > 0.99
    assert np.abs(np.corrcoef(level.T) - np.eye(len(drawn))).max() < 0.1


def test_figures_are_drawn_one_by_one_if_asked_to():
    rare = DomainRandomization(payload_kg=(1.0, 2.0), friction=(0.1, 0.2), each=0.25)
    drawn = draws(rare, 4000)
    loaded, slippery = (np.array([getattr(one.physics, name) for one in drawn]) for name in ("payload_kg", "friction"))
    own = PhysicsParams()
    with_load, with_slip = loaded != own.payload_kg, slippery != own.friction
    assert with_load.mean() == pytest.approx(0.25, abs=0.03) and with_slip.mean() == pytest.approx(0.25, abs=0.03)
    assert (with_load & with_slip).mean() == pytest.approx(0.0625, abs=0.015)
    assert (loaded[with_load] >= 1.0).all() and loaded[with_load].mean() == pytest.approx(1.5, abs=0.05)
    assert draws(dataclasses.replace(rare, each=0.0), 3) == [EpisodeConditions()] * 3
    with pytest.raises(InvalidInputError, match="each.*got 1.5"):
        DomainRandomization(each=1.5)


def test_the_ends_of_a_range_gather_draws_if_asked_to():
    loaded = np.array(
        [one.physics.payload_kg for one in draws(DomainRandomization(payload_kg=(1.0, 2.0), ends=0.4), 4000)]
    )
    assert (loaded == 1.0).mean() == pytest.approx(0.2, abs=0.03) == (loaded == 2.0).mean()
    between = loaded[(loaded > 1.0) & (loaded < 2.0)]
    np.testing.assert_allclose(np.quantile(between, [0.25, 0.5, 0.75]), [1.25, 1.5, 1.75], atol=0.04)
    always = np.array([one.physics.payload_kg for one in draws(DomainRandomization(ends=1.0), 200)])
    assert set(always) == {0.0, 3.0}
    with pytest.raises(InvalidInputError, match="ends.*got -0.1"):
        DomainRandomization(ends=-0.1)


def test_every_encoder_errs_by_its_own_share_of_a_magnitude_that_is_drawn():
    randomization = DomainRandomization(encoder_offset=(0.02, 0.06))
    offsets = np.array([one.sensors.encoder_offset for one in draws(randomization, 2000)])
    largest = np.abs(offsets).max(axis=1)
    assert offsets.shape == (2000, 12) and 0.055 < largest.max() <= 0.06
    # Of x U(-1, 1) with x in U(.02, .06): the mean square is E[x^2]/3 = (.02^2 + .02 .06 + .06^2)/9.
    assert (offsets**2).mean() == pytest.approx((0.02**2 + 0.02 * 0.06 + 0.06**2) / 9, rel=0.05)
    assert np.abs(np.corrcoef(offsets.T) - np.eye(12)).max() < 0.1


def test_a_range_of_none_leaves_the_base_and_the_other_draws():
    base = EpisodeConditions(PhysicsParams(friction=0.3, payload_kg=1.0), SensorParams((0.01,) * 12))
    without = DomainRandomization(friction=None, noise=None, encoder_offset=None)
    for drawn, other in zip(draws(DomainRandomization(), 20), draws(without, 20, base)):
        assert other.physics == dataclasses.replace(drawn.physics, friction=0.3) and other.noise is None
        assert other.sensors == SensorParams((0.01,) * 12, drawn.sensors.delay_s)
    assert draws(NOTHING, 5, base) == [base] * 5


def test_a_share_of_the_episodes_is_randomised():
    base = EpisodeConditions(PhysicsParams(contact_time_s=0.03))
    mixed, every = draws(DomainRandomization(fraction=0.3), 2000, base), draws(DomainRandomization(), 2000, base)
    drawn = [one for one in mixed if one != base]
    assert len(drawn) / 2000 == pytest.approx(0.3, abs=4 * np.sqrt(0.3 * 0.7 / 2000))
    assert all(one in (base, other) for one, other in zip(mixed, every)), "the others are as without a share"
    assert draws(DomainRandomization(fraction=0.0), 50, base) == [base] * 50


def test_a_range_of_one_point_gives_it():
    points = {"friction": 0.7, "motor_strength": 1.5, "noise": 0.0, "sensor_delay_s": 0.01, "settle_s": 0.2}
    expected = EpisodeConditions(PhysicsParams(friction=0.7, motor_strength=1.5), SensorParams(delay_s=0.01), 0.0, 0.2)
    ranges = {name: (point, point) for name, point in points.items()}
    assert draws(dataclasses.replace(NOTHING, **ranges), 20) == [expected] * 20


def test_it_survives_json():
    own = DomainRandomization(friction=[0.5, 1], payload_kg=None, fraction=0.5)
    again = DomainRandomization(**json.loads(json.dumps(dataclasses.asdict(own))))
    assert again == own and hash(again) == hash(own) and own.friction == (0.5, 1.0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"friction": (1.0, 0.4)}, r"range of friction must be low <= high, got \(1.0, 0.4\)"),
        ({"friction": (0.0, 1.0)}, r"friction must lie in \[0.05, 2\], got 0"),
        ({"payload_kg": (0.0, 11.0)}, r"payload_kg \[kg\] must lie in \[0, 10\], got 11"),
        ({"motor_strength": (0.9, 1.6)}, "motor_strength.*1.6"),
        ({"joint_friction": 0.5}, r"range of joint_friction must have shape \(2,\)"),
        ({"rotor_inertia": (0.0, float("nan"))}, "range of rotor_inertia must be finite"),
        ({"contact_time_s": ("soft", "stiff")}, "range of contact_time_s must be 2 numbers.*soft"),
        ({"joint_damping": (0.0, 4.0)}, "joint_damping.*got 4"),
        ({"encoder_offset": (-0.01, 0.01)}, r"range of encoder_offset \[rad\] must lie in \[0, 0.5\], got -0.01"),
        ({"sensor_delay_s": (0.0, 0.1)}, r"range of sensor_delay_s \[s\] must lie in \[0, 0.05\], got 0.1"),
        ({"settle_s": (0.0, 11.0)}, r"settle_s \[s\] must lie in \[0, 10\], got 11"),
        ({"noise": (-1.0, 1.0)}, r"range of noise must lie in \[0, 10\], got -1"),
        ({"fraction": 1.5}, r"fraction of randomized episodes must lie in \[0, 1\], got 1.5"),
    ],
)
def test_impossible_ranges_are_refused(arguments, words):
    with pytest.raises(InvalidInputError, match=words):
        DomainRandomization(**arguments)


# -- In the environment ------------------------------------------------------------------------------------------------


def test_every_reset_draws_and_a_seed_repeats_it():
    env, twin = Go1Env("trot", randomization=True), Go1Env("trot", randomization=True)
    assert env.physics_params == PhysicsParams()
    seen = []
    for seed in (0, None, None, 1, None):
        one, other = env.reset(seed=seed)[0], twin.reset(seed=seed)[0]
        np.testing.assert_array_equal(one, other)
        for action in np.random.default_rng(0).uniform(-0.2, 0.2, (5, 12)):
            np.testing.assert_array_equal(env.step(action)[0], twin.step(action)[0])
        assert env.physics_params == twin.physics_params and env.physics_params not in seen
        seen.append(env.physics_params)
    env.reset(seed=0)
    assert env.physics_params == seen[0]


def test_the_model_is_the_drawn_one():
    env = Go1Env("trot", randomization=True, kp=40.0)
    for seed in range(3):
        env.reset(seed=seed)
        model, physics_params = env.simulation.model, env.physics_params
        assert model.body_mass.sum() == pytest.approx(robot.MASS + physics_params.payload_kg)
        assert (model.geom_friction[:, 0] == physics_params.friction).all()
        np.testing.assert_allclose(model.actuator_gainprm[:, 0], 40.0 * physics_params.motor_strength)
        assert (model.dof_armature[6:] == physics_params.rotor_inertia).all()
        assert (model.dof_frictionloss[6:] == physics_params.joint_friction).all()
        assert (model.dof_damping[6:] == physics_params.joint_damping).all()
        assert model.geom_solref[model.geom("FL_foot").id, 0] == physics_params.contact_time_s
        assert (
            len(env.simulation.snapshot())
            == len(Go1Env("trot").simulation.snapshot()) + 12 * physics_params.delay_steps
        )


@pytest.mark.parametrize("kwargs", [{}, {"estimator_noise": True}, {"sensors": SensorParams(0.02)}])
def test_command_and_pose_after_a_reset_are_those_without_randomization(kwargs):
    randomization = DomainRandomization(settle_s=None)
    env, plain = Go1Env(None, randomization=randomization, **kwargs), Go1Env(None, **kwargs)
    for seed in range(4):
        (_, info), (_, expected) = env.reset(seed=seed), plain.reset(seed=seed)
        assert info.keys() == expected.keys() and info["task"] == expected["task"]
        np.testing.assert_array_equal(info["command"], expected["command"])
        np.testing.assert_array_equal(env.state.q, plain.state.q)
        np.testing.assert_array_equal(env.estimated_state.q, plain.estimated_state.q)


def test_a_share_of_none_is_the_environment_itself():
    own = {"friction": 0.6, "payload_kg": 1.0}
    env, plain = Go1Env("walk", randomization=DomainRandomization(fraction=0.0), **own), Go1Env("walk", **own)
    np.testing.assert_array_equal(env.reset(seed=2)[0], plain.reset(seed=2)[0])
    for action in np.random.default_rng(0).uniform(-0.2, 0.2, (10, 12)):
        np.testing.assert_array_equal(env.step(action)[0], plain.step(action)[0])
    assert env.physics_params == plain.physics_params == PhysicsParams(**own)


def test_without_randomization_a_reset_leaves_the_model_alone():
    env = Go1Env("trot", friction=0.6)
    env.simulation.model.geom_friction[:, 0] = 0.3  # an experiment of the user's
    env.reset(seed=0)
    assert (env.simulation.model.geom_friction[:, 0] == 0.3).all()


def test_a_randomised_robot_has_stood_for_a_time_of_its_own():
    env = Go1Env("trot", randomization=dataclasses.replace(NOTHING, settle_s=(0.1, 0.5), fraction=0.5))
    plain = Go1Env("trot")
    moved = []
    for seed in range(20):
        env.reset(seed=seed), plain.reset(seed=seed)
        moved.append(not np.array_equal(env.state.q, plain.state.q))
    assert 3 < sum(moved) < 17


@pytest.mark.parametrize(
    ("noise", "deviation"), [(None, 0.005), (True, 0.005), (SensorNoise(q=0.02), 0.02), (False, 0.005)]
)
def test_the_factor_multiplies_the_environments_noise_or_the_default(noise, deviation):
    randomization = dataclasses.replace(NOTHING, noise=(1.5, 1.5))
    env = Go1Env("trot", noise=noise, randomization=randomization, history=50)
    obs, _ = env.reset(seed=0)
    errors = [obs[env.layout.slices["q"]] - env.state.q]
    for _ in range(100):
        obs = env.step(env.action_map.from_radians(robot.HOME_POSE))[0]
        errors.append(obs[env.layout.slices["q"]] - env.state.q)
    assert np.std(errors) == pytest.approx(1.5 * deviation, rel=0.08)
    assert np.abs(errors[0]).max() > 0, "the first observation has the noise too"


def test_the_noise_of_an_episode_is_forgotten_by_the_next():
    env = Go1Env("trot", randomization=dataclasses.replace(NOTHING, noise=(1.0, 1.0), fraction=0.5))
    exact = []
    for seed in range(12):
        obs, _ = env.reset(seed=seed)
        exact.append(np.array_equal(obs[env.layout.slices["q"]], env.state.q.astype(np.float32)))
    assert {True, False} == set(exact)


def test_noise_that_could_become_impossible_is_refused_at_once():
    with pytest.raises(InvalidInputError, match="sensor noise of gyroscope.*got 16"):
        Go1Env("trot", noise=SensorNoise(gyroscope=8.0), randomization=True)


@pytest.mark.parametrize("randomization", [0.5, SensorNoise()])
def test_another_kind_of_randomization_is_refused(randomization):
    with pytest.raises(InvalidInputError, match="randomization must be None, True, False or a DomainRandomization"):
        Go1Env("trot", randomization=randomization)


# -- Copies ------------------------------------------------------------------------------------------------------------

RANDOMISED = {"randomization": DomainRandomization(friction=(0.3, 0.9), fraction=0.8), "payload_kg": 0.5, "noise": True}


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize("seed", range(4))
def test_a_copy_of_a_randomised_episode_continues_to_the_bit(duplicate, seed):
    env = Go1Env(None, history=2, motor_strength=1.05, **RANDOMISED)
    env.reset(seed=seed)
    actions = np.random.default_rng(seed).uniform(-0.2, 0.2, (30, 12))
    for action in actions[:10]:
        env.step(action)
    twin = duplicate(env)
    assert twin.physics_params == env.physics_params
    for action in actions[10:]:
        np.testing.assert_array_equal(env.step(action)[0], twin.step(action)[0])
    np.testing.assert_array_equal(env.simulation.snapshot(), twin.simulation.snapshot())
    np.testing.assert_array_equal(env.reset()[0], twin.reset()[0])
    assert twin.physics_params == env.physics_params


def test_it_goes_through_gymnasium_make_and_its_spec():
    env = gymnasium.make("go1_mtl_gym:Go1Trot-v0", disable_env_checker=True, rotor_inertia=0.01, **RANDOMISED)
    again = gymnasium.make(pickle.loads(pickle.dumps(env.spec)))
    np.testing.assert_array_equal(env.reset(seed=5)[0], again.reset(seed=5)[0])
    assert env.unwrapped.physics_params == again.unwrapped.physics_params != PhysicsParams()


def test_the_expert_is_told_nothing():
    asked = []

    class Deaf:
        def __init__(self, gains, hold_s):
            asked.append((gains.kp, gains.kd))

        def reset(self, state):
            pass

        def action(self, state):
            return robot.HOME_POSE

    env = Go1Env("trot", expert=Deaf, randomization=dataclasses.replace(NOTHING, motor_strength=(0.8, 0.8)))
    env.reset(seed=0)
    np.testing.assert_allclose(env.action_map.to_radians(env.expert_action()), robot.HOME_POSE, atol=1e-6)
    assert asked == [(50.0, 2.0)] and env.simulation.model.actuator_gainprm[0, 0] == 40.0
