"""Scripts of moves, the captions of a film, and the film of a policy that is driven by a script."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import trainers
from go1_mtl_gym import BUILT_IN_TASKS, TASKS
from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import make_stub
from trainers import Move, Script, film_tour, save_tour
from trainers.evaluation import captions
from trainers.evaluation.captions import CONTACT, MEASURED, TEXT, draw_captions, reading
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.scoring import Series
from trainers.evaluation.tour import DEFAULT_TOUR

FILM = Path(__file__).parents[2] / "docs" / "results" / "hero.webp"
STAND = (0.0, 0.0, 0.0)
SHORT = Script(((0.0, "trot", STAND), (0.1, "walk", (0.3, 0.0, 0.0))), 0.4)

# -- Scripts -----------------------------------------------------------------------------------------------------------


def test_a_script_is_read_from_tuples_dictionaries_and_json():
    fields = {"time_s": 1, "task": "walk", "command": [0.3, 0, 0.5]}
    script = Script((Move(0, "trot"), fields, (2, "trot")), 3)
    assert script.moves == (Move(0.0, "trot", STAND), Move(1.0, "walk", (0.3, 0.0, 0.5)), Move(2.0, "trot"))
    assert script.task_names == ("trot", "walk") and script.seconds == 3.0
    assert Script(**json.loads(json.dumps(dataclasses.asdict(script)))) == script


@pytest.mark.parametrize(
    ("moves", "seconds", "message"),
    [
        ((), 1.0, "at least one"),
        ("trot", 1.0, "must be a sequence"),
        (((0.5, "trot"),), 1.0, "first move of a script must be at 0 s, got 0.5 s"),
        (((0.0, "trot"), (2.0, "walk"), (1.0, "trot")), 3.0, "in order of time, got 1 s after 2 s"),
        (((0.0, "trot"), (1.0, "walk")), 1.0, "end after its last move at 1 s, got seconds=1"),
        (((0.0, "trot"),), float("nan"), "seconds of a script"),
        (((0.0, "hop"),), 1.0, "task of the move at 0 s must be one of .*'hop'"),
        (((-1.0, "trot"),), 1.0, "time_s of a move"),
        (((0.0, "walk", (1.5, 0.0, 0.0)),), 1.0, "move at 0 s: command .* for task 'walk' must lie within"),
        (((0.0, "walk", (0.5, 0.0)),), 1.0, "move at 0 s: command .* must have shape"),
        (((0.0,),), 1.0, r"a move is \(time_s, task, command, push\), got \(0.0,\)"),
        (({"time_s": 0.0},), 1.0, "needs time_s and task"),
        (({"time_s": 0.0, "task": "trot", "speed": 1.0},), 1.0, "field of a move"),
        (((0.0, "walk", STAND, (0.5,)),), 1.0, "push of the move at 0 s must have shape"),
        ((None,), 1.0, "a move must be a Move, got None"),
    ],
)
def test_impossible_scripts_are_refused(moves, seconds, message):
    with pytest.raises(InvalidInputError, match=message):
        Script(moves, seconds)


def test_the_moves_are_made_in_their_step():
    script = Script(((0.0, "trot", (1.5, 0.0, 0.0)), (0.1, "walk", (0.3, 0.0, 0.0)), (0.2, "trot", STAND)), 0.3)

    first = script.moves[0]
    setup = EpisodeSetup(first.task, 1, script.seconds, first.command)
    _, series = setup.play("expert", {}, make_stub, script.drive)
    assert series.tasks == ("trot",) * 5 + ("walk",) * 5 + ("trot",) * 5
    np.testing.assert_array_equal(series.commands[:, 0], [1.5] * 5 + [0.3] * 5 + [0.0] * 5)


def test_the_default_tour_shows_every_gait_from_a_stand_to_a_stand():
    assert set(DEFAULT_TOUR.task_names) == set(BUILT_IN_TASKS)
    assert 18.0 <= DEFAULT_TOUR.seconds <= 20.0
    first, last = DEFAULT_TOUR.moves[0], DEFAULT_TOUR.moves[-1]
    assert first.command == last.command == STAND and first.task == last.task == "trot"
    for move in DEFAULT_TOUR.moves:
        assert (np.abs(move.command) <= TASKS[move.task].command_range).all(), "what the policy was trained on"


# -- Captions ----------------------------------------------------------------------------------------------------------


def series(n: int = 100) -> Series:
    """Trot, then walk; ever faster; the front left foot in the air during the second half."""
    contacts = np.ones((n, 4), dtype=bool)
    contacts[n // 2 :, 0] = False
    measured = np.zeros((n, 3))
    measured[:, 0] = np.arange(n) / 100
    tasks = ("trot",) * (n // 2) + ("walk",) * (n - n // 2)
    return Series(measured, 2 * measured, contacts, np.ones(n, dtype=bool), 3 * measured, tasks)


def test_captions_say_what_was_measured_until_then():
    said = reading(series(), 60, ("trot", "walk"), 50)
    assert said.task == "walk" and said.contacts.shape == (60, 4) and said.contacts_n == 100
    assert said.command[0] == pytest.approx(2 * 0.59)
    assert said.measured[0] == pytest.approx(np.arange(40, 60).mean() / 100), "0.4 s are 20 steps"
    assert reading(series(), 50, (), 50).task == "trot"
    assert len(reading(series(), 0, (), 50).contacts) == 1
    after_the_end = reading(series(), 500, (), 50)
    assert after_the_end.command[0] == pytest.approx(2 * 0.99) and len(after_the_end.contacts) == 100
    with pytest.raises(InvalidInputError, match="at least one step"):
        reading(series(0), 1, (), 50)


def count(picture: np.ndarray, color: tuple[int, ...]) -> int:
    """Pixels of about a color."""
    return int((np.abs(picture.astype(int) - color[:3]).max(-1) < 12).sum())


@pytest.mark.parametrize("scale", [1, 2])
def test_captions_change_with_the_gait_and_leave_the_middle(scale):
    empty = np.full((360 * scale, 640 * scale, 3), 120, np.uint8)
    trot, walk = (draw_captions(empty, reading(series(), at, ("trot", "walk"), 50)) for at in (50, 51))
    assert trot.shape == empty.shape and trot.dtype == np.uint8
    left, right = (
        (slice(8 * scale, 32 * scale), slice(0, 78 * scale)),
        (slice(8 * scale, 32 * scale), slice(78 * scale, None)),
    )
    assert count(trot[left], TEXT) > 500 * scale**2 > 10 > count(trot[right], TEXT)
    assert count(walk[right], TEXT) > 500 * scale**2 > 10 > count(walk[left], TEXT)
    assert (trot[40 * scale : 260 * scale] == 120).all(), "the robot's place"


def test_bars_and_strip_show_the_numbers():
    empty = np.full((360, 640, 3), 120, np.uint8)
    slow, fast = (draw_captions(empty, reading(series(), at, (), 50)) for at in (25, 100))
    row = slice(294, 303)  # "forward"
    # half a bar, 26 pixels, is 1.5 m/s: means of 0.145 and 0.895 m/s are 3 and 16 pixels, which the mark partly hides
    assert count(fast[row, 74:126], MEASURED) > count(slow[row, 74:126], MEASURED) + 60
    strips = fast[291:351, 488:620]
    lengths = [count(strips[5 + 15 * leg : 6 + 15 * leg], CONTACT) for leg in range(4)]
    assert lengths == [66, 132, 132, 132]


@pytest.mark.parametrize(("value", "text"), [(-0.04, "0.0"), (0.0, "0.0"), (-0.06, "-0.1"), (1.26, "1.3")])
def test_numbers_have_one_digit_and_no_negative_zero(value, text):
    assert captions.number(value) == text


# -- Films -------------------------------------------------------------------------------------------------------------


@pytest.mark.gl
def test_a_film_of_a_script_is_an_animation_of_its_length(tmp_path):
    policy = trainers.load_pretrained()
    save_tour(policy, tmp_path / "tour.webp", SHORT, fps=10, width=160, height=96, quality=40)
    with Image.open(tmp_path / "tour.webp") as webp:
        assert webp.is_animated and webp.n_frames == 4 and webp.size == (160, 96)
        webp.load()
        assert webp.info["duration"] == 100
    frames = film_tour(policy, dataclasses.asdict(SHORT), fps=10, width=160, height=96)
    assert frames.shape == (4, 96, 160, 3) and frames.dtype == np.uint8
    lit = [[count(frame[2:8, left : left + 16], TEXT) for left in (4, 23)] for frame in frames]
    assert [np.argmax(each) for each in lit] == [0, 0, 1, 1], "the button of walk is lit after 0.1 s"


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"script": "trot"}, "script must be"),
        ({"fps": 0}, "fps must"),
        ({"episode_s": 3.0}, "episode_s is set by script"),
        ({"tasks": ("trot",)}, "'walk'"),
    ],
)
def test_a_tour_with_impossible_settings_is_refused(wrong, message):
    with pytest.raises(InvalidInputError, match=message):
        film_tour("expert", **({"script": SHORT} | wrong))


def test_the_published_film_is_the_default_tour():
    assert FILM.stat().st_size <= 3_000_000
    with Image.open(FILM) as webp:
        assert webp.size == (640, 360) and webp.info["loop"] == 0
        assert webp.n_frames <= round(25 * DEFAULT_TOUR.seconds)
        milliseconds = 0
        for i in range(webp.n_frames):
            webp.seek(i)
            webp.load()
            milliseconds += webp.info["duration"]
    assert milliseconds == 1000 * DEFAULT_TOUR.seconds
