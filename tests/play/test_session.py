"""Sessions and hands: the same episodes as without a player, and what a player asks for."""

import dataclasses
import time

import numpy as np
import pytest

from go1_mtl_gym import BUILT_IN_TASKS, TASKS, robot
from go1_mtl_gym.errors import InvalidInputError
from tests.play.conftest import Stand
from trainers import Move, OperatorConfig, Script
from trainers.data.environments import make_env
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.tour import DEFAULT_TOUR
from trainers.play.hands import Hands
from trainers.play.session import Session

STAND = (0.0, 0.0, 0.0)
STANDING = EpisodeSetup("trot", 3, 60.0, command=STAND)


def minute(laps: int = 3) -> Script:
    """The tour of the package several times over, with pushes."""
    lap_s = 19.4
    moves = [
        dataclasses.replace(move, time_s=move.time_s + lap * lap_s, push=(0.1, -0.2) if i % 6 == 5 else None)
        for lap in range(laps)
        for i, move in enumerate(DEFAULT_TOUR.moves)
    ]
    return Script(tuple(moves), 60.0)


def states_of(session: Session, steps: int) -> np.ndarray:
    states = [session.go1.simulation.snapshot()]
    for _ in range(steps):
        session.step()
        states.append(session.go1.simulation.snapshot())
    return np.array(states)


@pytest.mark.slow
def test_a_minute_by_a_script_is_the_same_to_the_bit_as_an_episode(student):
    script = minute()
    setup = EpisodeSetup("trot", 1, script.seconds, command=STAND)
    states = []

    def watch(env, step):
        states.append(env.unwrapped.simulation.snapshot())
        script.drive(env, step)

    _, series = setup.play(student, student.env_kwargs, make_env, watch)
    assert len(series.tasks) == 3000 and set(series.tasks) == set(BUILT_IN_TASKS), "it survives, in all gaits"
    with Session(student, setup, script.drive, expert=Stand) as session:
        for expected in states:
            np.testing.assert_array_equal(session.go1.simulation.snapshot(), expected)
            if session.steps % 10 == 0:
                session.expert_target, session.reading  # who looks on changes nothing  # noqa: B018
            if not session.ended:
                session.step()
    assert session.ended == "time" and session.steps == 3000


@pytest.mark.parametrize("operator", [None, OperatorConfig(task_interval=(0.5, 1.0), push_interval=0.5)])
def test_drawn_commands_and_operators_drive_as_in_an_episode(student, operator):
    interval = None if operator else 0.5
    setup = EpisodeSetup("walk", 5, 2.0, command_interval=interval, operator=operator)
    states = []
    setup.play(student, student.env_kwargs, make_env, lambda env, i: states.append(env.unwrapped.simulation.snapshot()))
    with Session(student, setup) as session:
        np.testing.assert_array_equal(states_of(session, 100), states)


def test_a_session_begins_again_where_it_began(student):
    hands = Hands()
    hands.move_stick((1.0, 0.0, 0.3))
    with Session(student, STANDING, hands.drive) as session:
        first = states_of(session, 30)
        session.reset()
        assert session.steps == 0 and session.time_s == 0.0 and len(session.reading.contacts) == 1
        np.testing.assert_array_equal(states_of(session, 30), first)
        session.reset("pace")
        assert session.reading.task == "pace" and session.go1.command.tolist() == list(STAND)
        with pytest.raises(InvalidInputError, match="'hop'"):
            session.reset("hop")
        assert session.reading.task == "pace"


def test_a_refused_reset_changes_nothing(student):
    with Session(student, EpisodeSetup("pace", 1, 10.0, command=(1.3, 0.0, 0.0))) as session:
        session.step()
        with pytest.raises(InvalidInputError, match="walk"):
            session.reset("walk")
        session.step()
        assert session.steps == 2 and session.reading.task == "pace"
        session.reset()
        assert session.steps == 0 and session.reading.task == "pace"


@pytest.mark.parametrize(
    ("values", "message"), [(("hop", 1, 1.0), "task"), (("trot", -1, 1.0), "seed"), (("trot", 1, 0.0), "seconds")]
)
def test_impossible_episodes_are_refused(values, message):
    with pytest.raises(InvalidInputError, match=message):
        EpisodeSetup(*values)


def test_a_tape_is_full_after_ten_minutes_and_driving_goes_on(student):
    hands = Hands()
    with Session(student, STANDING, hands.drive) as session:
        session.step()
        for step in (29_998, 29_999, 30_000, 40_000):
            hands.move_stick((step / 50_000, 0.0, 0.0))
            hands.drive(session.env, step)
        command = session.go1.command[0]
    assert command == pytest.approx(0.8 * TASKS["trot"].command_range[0])
    assert hands.script.seconds == 600.0 and hands.script.moves[-1].time_s == pytest.approx(599.98)


def test_what_hands_did_is_a_script_that_does_it_again(student):
    hands = Hands()
    with Session(student, STANDING, hands.drive) as session:
        states = [session.go1.simulation.snapshot()]
        for step in range(150):
            if step == 10:
                hands.move_stick((0.7, 0.0, -0.4))
            if step == 40:
                hands.press("walk")
            if step in (60, 61):
                hands.push(0.3 + step, 0.2)
            if step == 100:
                hands.let_go()
            session.step()
            states.append(session.go1.simulation.snapshot())
    script = hands.script
    assert script.seconds == 3.0 and script.task_names == ("trot", "walk")
    assert sum(move.push is not None for move in script.moves) == 2
    first = script.moves[0]
    again = Script(**{**dataclasses.asdict(script)})
    with Session(student, EpisodeSetup(first.task, 3, 3.0, command=first.command), again.drive) as session:
        np.testing.assert_array_equal(states_of(session, 150), states)


def test_a_script_is_read_from_the_file_that_it_was_written_to(tmp_path):
    script = Script((Move(0.0, "trot", push=(0.5, 0.0)), Move(1.0, "walk", (0.3, 0.0, 0.1))), 2.0)
    script.write(tmp_path / "x.json")
    assert Script.read(tmp_path / "x.json") == script
    for text in ("[]", "{}", "no"):
        (tmp_path / "x.json").write_text(text)
        with pytest.raises(InvalidInputError, match="x.json' is no script"):
            Script.read(tmp_path / "x.json")
    (tmp_path / "x.json").write_text("[" * 100_000)
    with pytest.raises(InvalidInputError, match="nested too deep"):
        Script.read(tmp_path / "x.json")
    with pytest.raises(InvalidInputError, match="no script"):
        Script.read(tmp_path / "y.json")


def test_full_deflection_asks_for_the_range_of_the_gait(student):
    hands = Hands()
    hands.move_stick((2.0, -0.5, 0.0))
    assert hands.stick.tolist() == [1.0, -0.5, 0.0], "it has ends"
    with Session(student, STANDING, hands.drive) as session:
        session.step()
        forward, left, _ = TASKS["trot"].command_range
        np.testing.assert_allclose(session.go1.command, [forward, -left / 2, 0.0])
        hands.press("walk")
        session.step()
        forward, left, _ = TASKS["walk"].command_range
        np.testing.assert_allclose(session.go1.command, [forward, -left / 2, 0.0])
        hands.let_go()
        session.step()
        assert not session.go1.command.any()


@pytest.mark.parametrize("direction", [0.0, 2.0, -1.2])
def test_a_push_changes_the_velocity_in_the_direction_that_is_looked_at(student, direction):
    hands = Hands()
    with Session(student, STANDING, hands.drive) as session:
        session.step()
        before = session.go1.simulation.data.qvel[:3].copy()
        hands.push(direction, 0.5)
        hands.drive(session.env, session.steps)
        change = session.go1.simulation.data.qvel[:3] - before
        size = 0.5 * TASKS["trot"].largest_push(direction - session.go1.state.rpy[2])
        np.testing.assert_allclose(change, [size * np.cos(direction), size * np.sin(direction), 0.0], atol=1e-12)
        before = session.go1.simulation.data.qvel[:3].copy()
        hands.drive(session.env, session.steps)
        np.testing.assert_array_equal(session.go1.simulation.data.qvel[:3], before)  # once


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda hands: hands.press("hop"), "'hop'"),
        (lambda hands: hands.move_stick((1.0, 0.0)), "stick"),
        (lambda hands: hands.move_stick((float("nan"), 0.0, 0.0)), "finite"),
        (lambda hands: hands.push(0.0, -1.0), "share of the largest push"),
        (lambda hands: hands.push(float("nan")), "direction of a push .* must be finite"),
        (lambda hands: hands.push(None), "direction of a push"),
        (lambda hands: hands.script, "at least one"),
    ],
)
def test_impossible_wishes_are_refused(ask, message):
    with pytest.raises(InvalidInputError, match=message):
        ask(Hands())


def test_the_expert_takes_over_and_gives_back(student):
    with Session(student, STANDING, expert=Stand) as session:
        assert session.driver == "student" and not session.expert_drives
        assert session.waits_for_expert(ghost=True) and not session.waits_for_expert(ghost=False)
        target = robot.HOME_POSE + np.tile([0.0, 0.1, 0.0], 4)
        np.testing.assert_allclose(session.expert_target, target, atol=1e-6)
        assert not session.waits_for_expert(ghost=True)
        session.step()
        action = session.go1.action_map.from_radians(target)
        assert np.abs(session.go1.simulation.data.ctrl - target).max() > 0.01
        session.expert_drives = True
        session.step()
        assert session.driver == "expert"
        np.testing.assert_allclose(session.go1.simulation.data.ctrl, target, atol=1e-6)
        session.expert_drives = False
        session.step()
        assert np.abs(session.go1.action_map.from_radians(session.go1.simulation.data.ctrl) - action).max() > 1e-3


def test_without_a_student_the_expert_does_it_all():
    with Session(None, STANDING, expert=Stand) as session:
        session.expert_drives = False
        session.step()
        assert session.driver == "expert"


class Collapse:
    """A policy that throws the robot over."""

    def predict(self, obs, deterministic=True):
        return np.where(np.arange(12) % 3 == 1, 1.0, -1.0).astype(np.float32), None


def test_a_robot_that_fell_may_be_watched_and_one_whose_time_is_up_may_not():
    with Session(Collapse(), STANDING) as session:
        while not session.ended:
            session.step()
        assert session.ended == "fall"
        session.step()
        assert session.ended == "fall"
    with Session(Collapse(), dataclasses.replace(STANDING, seconds=0.04), expert=Stand, expert_drives=True) as session:
        session.step(), session.step()
        assert session.ended == "time"
        with pytest.raises(InvalidInputError, match=r"over \(time\)"):
            session.step()


def test_a_gait_that_the_policy_does_not_have_is_refused(student):
    with pytest.raises(InvalidInputError, match="'hop'"):
        Session(student, dataclasses.replace(STANDING, task="hop"))


def test_a_second_of_the_robot_takes_less_than_a_second_of_one_core(student):
    hands = Hands()
    hands.move_stick((1.0, 0.0, 0.5))
    with Session(student, STANDING, hands.drive) as session:
        session.step()
        began = time.process_time()
        for _ in range(100):
            session.step()
        assert time.process_time() - began < 2.0 * 0.5, "half of a core draws"
