"""Causes of failures, from scripted episodes."""

import numpy as np
import pytest

from trainers.evaluation.causes import cause_of
from trainers.evaluation.scoring import EpisodeRecord, Series

HZ, STEPS = 50, 200


def episode(command=(0.4, 0.0, 0.0), until=STEPS, events=None, moves=None, tasks=None, error=0.0, hands=True):
    """Four seconds under one command, let go after `until` steps; `error` is a velocity error in the third second."""
    commands = np.tile(np.array(command), (STEPS, 1))
    commands[until:] = 0.0
    measured = commands.copy()
    measured[100:150, 0] += error
    tasks = tasks or ("trot",) * STEPS
    happened = [()] * STEPS
    for step, names in (events or {}).items():
        happened[step] = names
    return Series(
        measured=measured,
        wanted=commands,
        contacts=np.ones((STEPS, 4), dtype=bool),
        running=np.ones(STEPS, dtype=bool),
        commands=commands,
        tasks=tasks,
        moves=(moves or ("hold",) * STEPS) if hands else (),
        events=tuple(happened) if hands else (),
    )


def record(fallen=True, velocity_error=0.0):
    return EpisodeRecord(1, ((0.0, 0.0, 0.0),), STEPS / HZ, fallen, velocity_error, 0.0, (0.0,) * 4, False)


def cause(fallen=True, velocity_error=0.0, **script):
    return cause_of(episode(**script), record(fallen, velocity_error), "trot", HZ)


@pytest.mark.parametrize(
    ("command", "doing"),
    [
        ((0.4, 0.0, 0.0), "forward"),
        ((-0.4, 0.1, 0.0), "backward"),
        ((0.1, -0.3, 0.1), "sideways"),
        ((0.1, 0.1, 0.5), "turning"),
        ((0.0, 0.0, 0.0), "standing"),
    ],
)
def test_what_it_was_doing_follows_from_the_command(command, doing):
    found = cause(command=command)
    assert (found.what, found.doing, found.task, found.time_s, found.after) == ("fell", doing, "trot", 4.0, "nothing")


@pytest.mark.parametrize(
    ("until", "doing", "after"), [(190, "braking", "let go"), (140, "braking", "nothing"), (80, "standing", "nothing")]
)
def test_a_robot_that_was_let_go_brakes_and_then_stands(until, doing, after):
    found = cause(until=until)
    assert (found.doing, found.after) == (doing, after)


def test_a_jerk_is_more_than_where_the_stick_is():
    assert cause(moves=("hold",) * 150 + ("jerk",) * 50).doing == "jerking"
    assert cause(moves=("hold",) * 150 + ("jerk",) * 50, until=195).doing == "braking"


def test_events_of_the_last_second_are_told_in_order():
    tasks = ("trot",) * 100 + ("bound",) * 80 + ("walk",) * 20
    found = cause(events={20: ("push",), 100: ("bound",), 175: ("walk",), 190: ("push",)}, tasks=tasks)
    assert found.task == "walk" and found.events == (("bound to walk", 24 / HZ), ("push", 9 / HZ))
    assert found.after == "push" and "bound to walk 0.5 s before" in str(found)


def test_without_hands_a_new_command_is_an_event():
    series = episode(hands=False)
    series.commands[180:] = (0.0, 0.2, 0.0)
    found = cause_of(series, record(), "trot", HZ)
    assert (found.doing, found.after) == ("sideways", "new command")


def test_bad_tracking_is_told_of_the_worst_second():
    found = cause(fallen=False, velocity_error=0.2, error=0.9, events={140: ("push",), 190: ("push",)})
    assert found.what == "did not track" and found.time_s == 3.0
    assert found.events == (("push", 9 / HZ),), "the later push is not to blame"


def test_who_survives_and_tracks_did_not_step():
    found = cause(fallen=False, velocity_error=0.1)
    assert (found.what, found.doing) == ("did not step", "all along")
