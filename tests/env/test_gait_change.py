"""Changes of gait: what they wait for, worked by hand, and the course of an episode that waits."""

import copy
import pickle
from collections import deque

import numpy as np
import pytest

from go1_mtl_gym import GAITS, TASKS, robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.episode import Episode
from go1_mtl_gym.gait_change import REACH, SLACK_COMMAND, GaitChange

STILL = np.zeros(3)


def change(first, second, since_s=-np.inf):
    return GaitChange(TASKS[first], TASKS[second], since_s)


def home(env: Go1Env) -> np.ndarray:
    return env.action_map.from_radians(robot.HOME_POSE)


# -- The rule ----------------------------------------------------------------------------------------------------------


def test_half_of_the_smaller_range_is_slow_enough():
    trot, walk = (np.array(TASKS[name].command_range) for name in ("trot", "walk"))
    reach = change("trot", "walk").reach
    np.testing.assert_array_equal(reach, [min(pair) / 2 for pair in zip(trot, walk)])
    np.testing.assert_array_equal(change("walk", "trot").reach, reach)
    np.testing.assert_array_equal(change("trot", "walk").slowed(np.array([9.0, 0.0, -9.0])), [reach[0], 0.0, -reach[2]])


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_filtered_command_may_be_a_little_beyond(axis, sign):
    waiting, unit = change("trot", "walk"), sign * np.eye(3)[axis]
    border = 1.15 * waiting.reach[axis] + 0.02
    assert waiting.begins_at_once((border - 1e-9) * unit, 0.0)
    assert not waiting.begins_at_once((border + 1e-9) * unit, 0.0)


def test_the_present_task_has_its_second():
    waiting = change("trot", "walk", since_s=3.0)
    assert not waiting.begins_at_once(STILL, 3.98) and waiting.begins_at_once(STILL, 4.0)
    assert not waiting.begins_after(0.1, 0.15, STILL, 3.98) and waiting.begins_after(0.1, 0.15, STILL, 4.0)
    assert waiting.begins_at_once(STILL, 3.0 + sum([0.02] * 50)), "sums of periods are not exact"


def test_a_gait_that_flies_is_left_where_its_clock_passes_the_middle_of_the_stance():
    waiting = change("jump", "trot")
    assert not waiting.begins_at_once(STILL, 0.0)
    assert not waiting.begins_after(0.20, 0.25, STILL, 0.02) and waiting.begins_after(0.25, 0.30, STILL, 0.02)
    assert waiting.begins_after(0.0, 0.0, STILL, 0.02), "the clock rests"
    assert not waiting.begins_after(0.25, 0.30, np.array([9.0, 0.0, 0.0]), 0.02)


# -- In an episode -----------------------------------------------------------------------------------------------------


def test_a_gait_that_flies_goes_on_until_the_middle_of_its_stance():
    assert GAITS["jump"].change_phase == pytest.approx(0.275)
    assert all(gait.change_phase is None for name, gait in GAITS.items() if name != "jump")
    env = Go1Env("jump")
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    env.step(home(env)), env.step(home(env))
    env.set_task("jump", phase=0.6)
    env.set_task("trot")
    seen = []
    for _ in range(16):  # 0.675 cycles of 0.45 s are 15.2 steps
        *_, info = env.step(home(env))
        seen.append(info["task"])
    assert seen == ["jump"] * 15 + ["trot"] and info["phase"] == 0.0
    env.set_task("jump", phase=0.6)
    env.set_task("trot")
    env.set_task("walk"), env.set_task("jump")
    for _ in range(40):
        *_, info = env.step(home(env))
    assert info["task"] == "jump", "the last word counts"


def test_a_gait_that_rests_is_left_at_once():
    env = Go1Env("jump")
    env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    env.set_task("trot")
    assert env.step(home(env))[4]["task"] == "trot"


def running(task, command, filtered_command=None):
    episode = Episode(TASKS[task], np.array(command), deque(maxlen=1))
    episode.filtered_command = np.array(command if filtered_command is None else filtered_command)
    return episode


def half_reach(first, second):
    return 0.5 * np.minimum(TASKS[first].command_range, TASKS[second].command_range)


def until_it_changes(episode):
    """The filtered commands from now until the task that waits is begun."""
    seen, before = [], episode.task
    while episode.task == before:
        seen.append(episode.filtered_command)
        episode.advance(np.zeros(12), 0.02)
        assert len(seen) < 100
    return np.array([*seen, episode.filtered_command])


def test_a_robot_that_is_too_fast_slows_down_to_half_before_it_changes_its_gait():
    episode = running("trot", (1.6, 0.0, 0.0))
    episode.change_command(np.array([0.7, 0.0, 0.0]))
    episode.change_task(TASKS["walk"], None)
    assert episode.task.name == "trot" and episode.requested_task.name == "walk"
    forward = until_it_changes(episode)[:, 0]
    reach = half_reach("trot", "walk")[0]
    assert forward[0] == 1.6 and forward[-2] <= REACH * reach + SLACK_COMMAND and (np.diff(forward[:-1]) < 0).all()
    assert episode.task.name == "walk" and episode.phase == 0.0
    for _ in range(100):
        episode.advance(np.zeros(12), 0.02)
    assert episode.filtered_command[0] == pytest.approx(0.7, abs=1e-3)  # and goes on as it was told


def test_every_component_counts():
    for axis in range(3):
        command = 1.3 * half_reach("trot", "pace") * (np.arange(3) == axis)
        episode = running("trot", command)
        episode.change_task(TASKS["pace"], None)
        assert episode.task.name == "trot"


def test_a_robot_that_is_slow_enough_changes_at_once():
    episode = running("trot", half_reach("trot", "walk"))
    episode.change_task(TASKS["walk"], None)
    assert episode.task.name == "walk" and episode.phase == 0.0 and episode.gait_change is None


def test_a_command_beyond_the_new_gaits_range_does_not_keep_it_waiting():
    beyond = TASKS["walk"].command_limit[0]
    episode = running("trot", (beyond, 0.0, 0.0))
    episode.change_task(TASKS["walk"], None)
    until_it_changes(episode)
    assert episode.task.name == "walk" and episode.command[0] == beyond


def test_a_phase_begins_a_gait_at_any_speed():
    episode = running("trot", (0.3, 0.0, 0.0), (1.6, 0.0, 0.0))
    episode.change_task(TASKS["walk"], 0.25)
    assert episode.task.name == "walk" and episode.phase == 0.25


def test_while_a_gait_waits_the_present_one_does_not_speed_up():
    episode = running("jump", (0.0, 0.0, 0.0))
    episode.phase = 0.5
    episode.change_task(TASKS["bound"], None)
    episode.change_command(np.array([TASKS["bound"].command_range[0], 0.0, 0.0]))
    reached = until_it_changes(episode)[:, 0]
    assert len(reached) > 3 and reached[:-1].max() <= half_reach("jump", "bound")[0]


def test_a_gait_that_was_changed_to_goes_on_for_a_second():
    episode = running("trot", (0.0, 0.0, 0.0), (0.1, 0.0, 0.0))
    episode.change_task(TASKS["walk"], None)
    assert episode.task.name == "walk"
    for name in ("trot", "pace"):  # the last button counts
        episode.change_task(TASKS[name], None)
    assert len(until_it_changes(episode)) - 1 == 50 and episode.task.name == "pace"


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_a_copy_waits_as_long(duplicate):
    episode = running("trot", (1.6, 0.0, 0.0))
    episode.change_task(TASKS["walk"], None)
    twin = duplicate(episode)
    assert twin.gait_change == episode.gait_change == change("trot", "walk")
    np.testing.assert_array_equal(until_it_changes(twin), until_it_changes(episode))
