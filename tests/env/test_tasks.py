"""Tasks: their order, the commands they draw and the commands they accept."""

import dataclasses

import numpy as np
import pytest

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gaits import GAITS
from go1_mtl_gym.tasks import PAPER_TASKS, TASKS, Task

EVERY = pytest.mark.parametrize("task", TASKS.values(), ids=list(TASKS))


def test_order_is_the_order_of_the_heads():
    assert tuple(TASKS)[:6] == (*PAPER_TASKS, "pace", "gallop") and PAPER_TASKS == ("trot", "bound", "jump", "walk")
    assert all(TASKS[name].name == name == TASKS[name].gait.name for name in GAITS)


@EVERY
def test_drawn_commands_fill_the_range_and_stay_within_it(task):
    rng = np.random.default_rng(0)
    commands = np.array([task.draw_command(rng) for _ in range(2000)])
    span = np.array(task.command_range)
    assert (np.abs(commands) <= span).all()
    np.testing.assert_allclose(commands.max(axis=0), span, rtol=0.01)
    np.testing.assert_allclose(commands.min(axis=0), -span, rtol=0.01)
    np.testing.assert_allclose(commands.std(axis=0), span / np.sqrt(3), rtol=0.05)


@EVERY
def test_drawn_corners_are_all_eight_and_nothing_else(task):
    rng = np.random.default_rng(0)
    corners = np.array([task.draw_corner(rng) for _ in range(800)])
    assert (np.abs(corners) == task.command_range).all()
    different, count = np.unique(corners, axis=0, return_counts=True)
    assert len(different) == 8 and count.min() > 60, "each is drawn about 100 times"


@EVERY
def test_draws_depend_on_the_generator_alone(task):
    draws = [task.draw_command(np.random.default_rng(5)) for _ in range(2)]
    np.testing.assert_array_equal(*draws)
    assert (task.draw_command(np.random.default_rng(6)) != draws[0]).all()


@EVERY
def test_limits_are_accepted_and_a_little_more_is_not(task):
    limit = np.array(task.command_limit)
    np.testing.assert_array_equal(task.check_command(-limit), -limit)
    for axis in range(3):
        command = np.zeros(3)
        command[axis] = limit[axis] + 1e-6
        with pytest.raises(InvalidInputError, match=f"command.*{task.name!r}.*within.*got"):
            task.check_command(command)


@pytest.mark.parametrize("command", [(0.1, 0.2), np.zeros((1, 3)), "fast", None, (0.1, np.nan, 0.0), (np.inf, 0, 0)])
def test_malformed_commands_are_refused(command):
    with pytest.raises(InvalidInputError, match="command"):
        TASKS["trot"].check_command(command)


def test_checked_command_is_a_copy():
    mine = np.array([0.1, 0.0, 0.2])
    checked = TASKS["trot"].check_command(mine)
    mine[0] = 99.0
    assert checked.tolist() == [0.1, 0.0, 0.2]


@pytest.mark.parametrize("span", [(-0.1, 0.0, 0.0), (3.0, 0.0, 0.0), (0.1, 0.1), (np.nan, 0, 0)])
def test_a_range_beyond_the_limit_is_refused(span):
    with pytest.raises(InvalidInputError, match="command_range of task 'x'"):
        Task("x", TASKS["trot"].gait, command_range=span)


def test_a_new_gait_is_data():
    fast = dataclasses.replace(TASKS["trot"].gait, name="fast trot", period=0.3)
    task = Task("fast trot", fast, command_range=(1.0, 0.0, 0.0))
    assert task.gait.step_rate == pytest.approx(10 / 3)
