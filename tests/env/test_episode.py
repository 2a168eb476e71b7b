"""The command filter, worked by hand, and the course of an episode: its clock, its stands, its beginning."""

import dataclasses

import numpy as np
import pytest

from go1_mtl_gym import BUILT_IN_TASKS, GAITS, InvalidInputError, robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.episode import COMMAND_SLEW, filtered
from go1_mtl_gym.gaits import STAND_COMMAND

STILL = np.zeros(3)


def home(env: Go1Env) -> np.ndarray:
    return env.action_map.from_radians(robot.HOME_POSE)


def test_the_filter_by_hand():
    assert COMMAND_SLEW == (3.0, 3.0, 6.0)
    fraction = 1 - np.exp(-0.1)  # .02 s of .2 s
    np.testing.assert_allclose(filtered(np.array([0.4, 0, 0]), STILL, 0.02), [0.4 * fraction, 0, 0])
    # 2 m/s would be followed by .19 m/s in .02 s; the limit is 3 x .02 = .06. Likewise 2 rad/s: .19 becomes .12.
    np.testing.assert_allclose(filtered(np.array([2.0, -2.0, -2.0]), STILL, 0.02), [0.06, -0.06, -0.12])
    np.testing.assert_allclose(filtered(STILL, np.array([1.0, 0.1, 0.0]), 0.02), [0.94, 0.1 - 0.1 * fraction, 0.0])


@pytest.mark.parametrize("seconds", [0.001, 0.005, 0.02])
def test_the_filter_never_exceeds_its_slope_and_arrives(seconds):
    command, seen = np.array([-2.0, 0.6, 2.0]), [np.array([2.0, -0.6, -2.0])]
    for _ in range(round(3.0 / seconds)):
        seen.append(filtered(command, seen[-1], seconds))
    slopes = np.abs(np.diff(seen, axis=0)) / seconds
    assert (slopes <= np.array(COMMAND_SLEW) + 1e-9).all() and slopes[0].tolist() == pytest.approx([3.0, 3.0, 6.0])
    np.testing.assert_allclose(seen[-1], command, atol=1e-3)


def test_a_stand_ends_with_the_command_and_begins_at_a_whole_cycle():
    env = Go1Env("trot")
    _, info = env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    assert info["standing"] and env.state.standing
    for _ in range(10):
        *_, info = env.step(home(env))
        assert info["standing"] and info["phase"] == 0.0
    env.set_command((0.3, 0.0, 0.0))
    phases = [env.step(home(env))[4]["phase"] for _ in range(8)]
    # One period until the command is seen, then .02 s of .4 s are .05 cycles each.
    np.testing.assert_allclose(phases, 0.05 * np.arange(8), atol=1e-12)
    env.set_command((0.0, 0.0, 0.0))
    infos = [env.step(home(env))[4] for _ in range(60)]
    began = next(i for i, info in enumerate(infos) if info["standing"])
    assert infos[began]["phase"] == 0.0 and infos[began - 1]["phase"] == pytest.approx(0.95)
    assert not any(info["standing"] for info in infos[:began]) and all(info["standing"] for info in infos[began:])
    assert np.abs(infos[began]["filtered_command"][0]) < STAND_COMMAND[0]


@pytest.mark.parametrize("control_hz", [50, 200, 1000])
@pytest.mark.parametrize("task", BUILT_IN_TASKS)
def test_only_gaits_that_can_stand_do(task, control_hz):
    env = Go1Env(task, control_hz=control_hz)
    env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    env.step(home(env))
    stands = task in ("trot", "jump", "walk", "pace")
    assert env.task.gait.can_stand is stands is env.state.standing and (env.state.phase == 0.0) is stands


def test_standing_is_a_function_of_gait_phase_and_command():
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    assert env.state.standing
    assert not dataclasses.replace(env.state, phase=0.5).standing
    assert not dataclasses.replace(env.state, command=np.array([0.02, 0.0, 0.0])).standing
    assert not dataclasses.replace(env.state, gait=GAITS["bound"]).standing


def test_the_state_tells_the_time():
    env = Go1Env("trot", control_hz=100)
    env.reset(seed=0)
    assert env.state.time_s == 0.0
    for _ in range(7):
        env.step(home(env))
    assert env.state.time_s == pytest.approx(0.07) == pytest.approx(env.simulation.data.time)
    env.reset()
    assert env.state.time_s == 0.0


def test_a_new_task_can_begin_at_a_phase():
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    env.step(home(env))
    env.set_task("bound", phase=0.25)
    assert env.state.phase == 0.25 and env.task.name == "bound"
    *_, info = env.step(home(env))
    assert info["phase"] == pytest.approx(0.25 + 0.02 / 0.32)
    env.set_task("walk")
    assert env.state.phase == 0.0 and env.task.name == "walk", "a gait begins at phase 0"
    env.set_task("jump", phase=0.7)
    assert env.state.phase == 0.7 and env.task.name == "jump"


def test_asking_for_the_present_task_leaves_its_clock_alone():
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    for _ in range(4):
        *_, info = env.step(home(env))
        env.set_task("trot")
    assert env.state.phase == info["phase"] == pytest.approx(3 * 0.02 / 0.4)


# -- Settling ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("task", ["trot", "bound"])  # one that can stand, and one that cannot
def test_an_episode_that_settles_begins_where_standing_on_action_zero_has_led(task):
    options = {"command": (0.2, 0.0, 0.0)}
    env, stood = Go1Env(task, settle_s=0.4, kp=30.0, contact_time_s=0.1), Go1Env(task, kp=30.0, contact_time_s=0.1)
    observation, info = env.reset(seed=1, options=options)
    stood.reset(seed=1, options=options)
    for _ in range(20):
        stood.step(np.zeros(12))
    np.testing.assert_allclose(env.state.q, stood.state.q, atol=1e-9)
    np.testing.assert_allclose(env.state.position_w, stood.state.position_w, atol=1e-9)
    sunk = Go1Env(task, kp=30.0, contact_time_s=0.1).reset(seed=1)[0]
    assert observation[env.layout.slices["contacts"]].all() and not sunk[env.layout.slices["contacts"]].all()
    assert (info["phase"], env.state.time_s, env.simulation.data.time) == (0.0, 0.0, 0.0)
    assert not info["filtered_command"].any() and not observation[env.layout.slices["last_action"]].any()


def test_a_delayed_target_arrives_while_the_robot_settles():
    env = Go1Env("trot", settle_s=0.1, action_delay_s=0.05)
    env.reset(seed=0)
    np.testing.assert_array_equal(env.simulation.data.ctrl, robot.HOME_POSE)
    assert (env.simulation.snapshot()[-12 * 50 - 8 : -8].reshape(50, 12) == robot.HOME_POSE).all()


def test_a_settled_episode_has_its_full_length_and_the_commands_of_any_other():
    env, plain = Go1Env(None, settle_s=0.3, episode_s=0.1), Go1Env(None)
    (_, info), (_, expected) = env.reset(seed=6), plain.reset(seed=6)
    assert info["task"] == expected["task"] and (info["command"] == expected["command"]).all()
    assert [env.step(np.zeros(12))[3] for _ in range(5)] == [False] * 4 + [True]


@pytest.mark.parametrize("settle_s", [-0.1, 10.5, "long", None])
def test_an_impossible_time_to_settle_is_refused(settle_s):
    with pytest.raises(InvalidInputError, match=rf"settle_s \[s\] must .*{settle_s}"):
        Go1Env(settle_s=settle_s)
