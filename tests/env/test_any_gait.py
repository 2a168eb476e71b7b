"""An environment in which the gait can be any, and be changed to any other at any moment."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest

from go1_mtl_gym import Go1Env, InvalidInputError, PerturbationWrapper
from go1_mtl_gym.gait_slew import GaitSlew, fitting_phase
from go1_mtl_gym.gait_space import NAMED, GaitSpace, mirrored, offset_distance
from go1_mtl_gym.gaits import GAITS, Gait, gait_of
from go1_mtl_gym.sensing.gait_numbers import LEG_NUMBERS, gait_numbers
from go1_mtl_gym.tasks import ANY_GAIT, TASKS, any_gait_task

CANTER = NAMED["canter"]


@pytest.fixture
def env():
    env = Go1Env(ANY_GAIT)
    yield env
    env.close()


def walk(env, steps):
    info = {}
    for _ in range(steps):
        _, _, terminated, _, info = env.step(env.expert_action())
        assert not terminated
    return info


def test_it_has_an_id_and_passes_gymnasiums_check():
    env = gymnasium.make("Go1AnyGait-v0")
    unwrapped = env.unwrapped
    assert unwrapped.tasks == (ANY_GAIT,) and unwrapped.config.gaits == GaitSpace()
    assert unwrapped.layout.channels == ("command", "last_action", "leg_kinematics", "gait")
    assert unwrapped.contract.gaits == (None,) and unwrapped.contract.layout.size == env.observation_space.shape[0]
    from gymnasium.utils.env_checker import check_env

    check_env(unwrapped, skip_render_check=True)


def test_gaits_are_drawn_from_the_space_and_told(env):
    told = []
    for seed in range(20):
        obs, info = env.reset(seed=seed)
        gait = env.task.gait
        assert env.config.gaits.contains(gait)
        np.testing.assert_allclose(info["gait"], gait.numbers)
        seen = obs[env.layout.slices["gait"]]
        np.testing.assert_allclose(seen, gait_numbers(gait, 0.0, env.state.standing, 0.02), atol=1e-6)
        told.append(gait)
    assert len(set(told)) == 20
    env.reset(seed=3)
    assert env.task.gait == told[3]
    narrow = Go1Env(ANY_GAIT, gaits={"period": (0.5, 0.5), "duty": (0.6, 0.6)})
    narrow.reset(seed=0)
    assert (narrow.task.gait.period, narrow.task.gait.duty) == (0.5, 0.6)


def test_an_episode_can_be_asked_for_a_gait(env):
    env.reset(seed=0, options={"gait": CANTER, "command": (0.4, 0.0, 0.0)})
    assert env.task.gait == CANTER
    info = walk(env, 100)
    assert info["base_velocity"][0] == pytest.approx(0.4, abs=0.15)
    touched = env.state.contacts
    assert touched.shape == (4,)


@pytest.mark.parametrize("slew_s", [0.0, 0.5])
def test_any_gait_becomes_any_other(env, slew_s):
    env.reset(seed=0, options={"gait": NAMED["trot"], "command": (0.4, 0.0, 0.0)})
    walk(env, 60)
    for name in ("rotatory_gallop", "pace", "pronk"):
        env.set_gait(NAMED[name], slew_s)
        before = env.task.gait
        walk(env, 10)
        if slew_s:
            assert env.task.gait not in (before, NAMED[name]), "on its way"
        walk(env, 60)
        assert env.task.gait == NAMED[name]


def test_a_change_while_standing_goes_on_standing(env):
    env.reset(seed=0, options={"gait": NAMED["trot"], "command": (0.0, 0.0, 0.0)})
    walk(env, 20)
    assert env.state.standing
    env.set_gait(NAMED["pace"])
    assert env.state.standing and walk(env, 20)["standing"]
    env.set_gait(NAMED["bound"])  # has no phase with all feet on the ground
    assert not env.state.standing and walk(env, 20)["phase"] != 0.0


def test_bad_gaits_are_refused_and_change_nothing(env):
    env.reset(seed=0, options={"gait": CANTER, "command": (0.2, 0.0, 0.0)})
    for call, message in (
        (lambda: env.set_gait("trot"), "a Gait was expected, got 'trot'"),
        (lambda: env.set_gait(GAITS["trot"], -1.0), "slew_s"),
        (lambda: env.set_gait(GAITS["trot"], command=(9.0, 0, 0)), "command"),
        (lambda: env.reset(options={"gait": 3}), "a Gait was expected, got 3"),
    ):
        with pytest.raises(InvalidInputError, match=message):
            call()
        assert env.task.gait == CANTER and env.command[0] == 0.2
    trot = Go1Env("trot")
    trot.reset(seed=0)
    with pytest.raises(InvalidInputError, match="a gait can be chosen where the task is 'any_gait'; here it is 'trot'"):
        trot.set_gait(CANTER)
    with pytest.raises(InvalidInputError, match="a gait can be chosen"):
        trot.reset(options={"gait": CANTER})
    with pytest.raises(InvalidInputError, match="gaits are drawn for the task 'any_gait'"):
        Go1Env("trot", gaits=True)
    with pytest.raises(InvalidInputError, match="period of a GaitSpace"):
        Go1Env(ANY_GAIT, gaits={"period": (1.0, 0.5)})


def test_asking_for_the_task_again_keeps_the_gait(env):
    env.reset(seed=0, options={"gait": CANTER, "command": (0.2, 0.0, 0.0)})
    env.set_task(ANY_GAIT)
    walk(env, 60)
    assert env.task.gait == CANTER


def test_copies_go_on_alike(env):
    env.reset(seed=4, options={"command": (0.3, 0.0, 0.0)})
    walk(env, 10)
    env.set_gait(CANTER, 0.4)
    walk(env, 3)
    twins = copy.deepcopy(env), pickle.loads(pickle.dumps(env))
    assert all(twin.task.gait == env.task.gait != CANTER for twin in twins)
    for _ in range(30):
        np.testing.assert_array_equal(*(twin.step(twin.expert_action())[0] for twin in twins))
    assert all(twin.task.gait == CANTER for twin in twins)


def test_disturbances_change_the_gait(env):
    disturbed = PerturbationWrapper(env, noise_rad=0.0, push=0.0, task_interval=(0.5, 0.6))
    disturbed.reset(seed=0)
    seen = set()
    for _ in range(120):
        _, _, terminated, _, info = disturbed.step(env.expert_action())
        assert not terminated
        seen.add(tuple(np.round(info["gait"], 3)))
    assert len(seen) > 10, "gaits on their way to others, too"


# -- Numbers -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gait", NAMED.values(), ids=lambda gait: gait.name)
def test_a_gait_comes_back_from_its_numbers(gait):
    back = gait_of(gait.numbers, gait.name)
    np.testing.assert_allclose(back.numbers, gait.numbers, atol=1e-12)
    assert back.name == gait.name


def test_numbers_of_a_trot_by_hand():
    trot = Gait("trot", 0.4, 0.55, (0.0, 0.5, 0.5, 0.0), 0.06, 0.9, 0.95)
    seen = gait_numbers(trot, 0.1, False, 0.02)
    legs = seen[: 4 * LEG_NUMBERS].reshape(LEG_NUMBERS, 4)
    np.testing.assert_allclose(legs[0], np.sin(2 * np.pi * np.array([0.1, 0.6, 0.6, 0.1])))
    np.testing.assert_allclose(legs[2], [0.36, 0.16, 0.16, 0.36], err_msg="touchdown")
    np.testing.assert_allclose(legs[3], [0.18, 0.38, 0.38, 0.18], err_msg="lift-off")
    np.testing.assert_allclose(legs[4], [1.0, 0.0, 0.0, 1.0], err_msg="share of the next hold on the ground")
    np.testing.assert_allclose(legs[5], 0.55)
    np.testing.assert_allclose(seen[24:], [2.5, 0.06, 0.9, 0.95, 0.0])
    assert gait_numbers(trot, 0.0, True, 0.02)[16:20].all() and gait_numbers(trot, 0.0, True, 0.02)[28] == 1.0


def test_numbers_stay_within_the_observations_bounds(env):
    low, high = (bound[env.layout.slices["gait"]] for bound in (env.observation_space.low, env.observation_space.high))
    rng = np.random.default_rng(1)
    for _ in range(200):
        gait = GaitSpace(period=(0.15, 3.0), duty=(0.2, 0.95), body_height=(0.6, 1.2)).draw(rng)
        seen = gait_numbers(gait, rng.uniform(), False, 0.02)
        assert (seen >= low).all() and (seen <= high).all()


def test_speed_follows_from_the_time_on_the_ground():
    slow, quick = (any_gait_task(Gait("any", period, 0.7, (0.0, 0.5, 0.5, 0.0))) for period in (0.65, 0.35))
    assert slow.command_range[0] < quick.command_range[0] <= TASKS[ANY_GAIT].command_limit[0]


# -- From one gait to another ------------------------------------------------------------------------------------------


def test_the_same_gait_fits_at_its_own_phase():
    for gait in (NAMED["walk"], CANTER, NAMED["limp"]):
        for phase in (0.0, 0.25, 0.7):
            assert abs((fitting_phase(gait, phase, gait) - phase + 0.5) % 1.0 - 0.5) < 0.01


def test_feet_that_are_in_the_air_go_on_to_swing():
    trot, bound = NAMED["trot"], NAMED["bound"]
    assert offset_distance(trot, mirrored(trot)) < 1e-9
    slower = Gait("slower", 0.6, 0.55, trot.offsets)
    for phase in np.linspace(0, 1, 11, endpoint=False):
        after = fitting_phase(trot, float(phase), slower)
        np.testing.assert_array_equal(trot.stance(phase), slower.stance(after))
        assert 0.0 <= fitting_phase(trot, float(phase), bound) < 1.0


def test_a_slew_begins_and_ends_at_its_gaits():
    slew = GaitSlew(NAMED["trot"], CANTER, 2.0, 0.5)
    np.testing.assert_allclose(slew.at(2.0).numbers, NAMED["trot"].numbers)
    assert slew.at(2.5) == CANTER and slew.is_over(2.5) and not slew.is_over(2.4)
    periods = [slew.at(2.0 + 0.05 * i).period for i in range(11)]
    assert (np.diff(periods) > 0).all()


@pytest.mark.parametrize("seed", range(4))
def test_legs_do_not_jump_on_the_way_from_one_gait_to_another(env, seed):
    rng = np.random.default_rng(seed)
    first, second = (env.config.gaits.draw(rng) for _ in range(2))
    env.reset(seed=0, options={"gait": first, "command": (0.3, 0.0, 0.0)})
    walk(env, 10 + seed)
    legs = [env.task.gait.leg_phase(env.state.phase)]
    env.set_gait(second, 0.5)
    for _ in range(40):
        env.step(env.expert_action())
        legs.append(env.task.gait.leg_phase(env.state.phase))
    assert env.task.gait == second
    gained = np.mod(np.diff(legs, axis=0) + 0.5, 1.0) - 0.5
    fastest = 0.02 / min(first.period, second.period) + 0.02 / 0.5 * 0.5  # the clock, and half a turn in half a second
    assert np.abs(gained).max() <= fastest + 1e-9


def test_a_slew_from_a_stand_is_one_that_stands(env):
    env.reset(seed=0, options={"gait": NAMED["trot"], "command": (0.0, 0.0, 0.0)})
    walk(env, 10)
    env.set_gait(NAMED["pace"], 0.4)
    assert walk(env, 40)["standing"] and env.task.gait == NAMED["pace"] and env.state.phase == 0.0
