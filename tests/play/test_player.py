"""Time, keys, gamepad, camera and what is written: everything of a player's but the window."""

import types

import glfw
import numpy as np
import pytest

from tests.play.conftest import Stand
from trainers.evaluation.captions import Page, lay_over
from trainers.evaluation.episodes import EpisodeSetup
from trainers.play.camera import AIM_HEIGHT, Camera
from trainers.play.controls import GENTLE, Controls
from trainers.play.gamepad import Gamepad
from trainers.play.hands import Hands
from trainers.play.loop import play_on
from trainers.play.player import LYING_S, Player
from trainers.play.session import Session
from trainers.play.status import button_at, notice_of, play_panels
from trainers.play.window import _key_names

SETUP = EpisodeSetup("trot", 3, 60.0, command=(0.0, 0.0, 0.0))


@pytest.fixture
def player(student):
    hands = Hands()
    with Session(student, SETUP, hands.drive, expert=Stand) as session:
        yield Player(session, hands)


@pytest.fixture
def controls(player):
    return Controls(player)


# -- Time --------------------------------------------------------------------------------------------------------------


def test_time_on_the_wall_is_time_of_the_robot(player):
    assert [player.advance(wall) for wall in (0.0, 0.015, 0.015, 0.1, 0.01)] == [0, 0, 1, 5, 1]
    assert player.session.steps == 7
    for _ in range(100):
        player.advance(1 / 60)
    assert player.session.time_s == pytest.approx(0.14 + 100 / 60, abs=0.021)
    assert player.factor == pytest.approx(1.0, abs=0.03)


def test_slow_motion_and_pauses(player):
    player.slower()
    assert player.speed == 0.5 and player.advance(0.2) == 5
    assert player.played_s == pytest.approx(0.2), "as long as it took"
    player.slower(10)
    assert player.speed == 0.1 and player.advance(0.2) == 1
    player.slower(-10)
    assert player.speed == 1.0
    player.paused = True
    assert player.advance(0.3) == 0 and player.step() == 1
    player.paused = False
    assert player.advance(0.02) == 1, "a pause is not made up for"


def test_a_machine_that_is_too_slow_is_said_to_be(player):
    for _ in range(3):
        assert player.advance(1.0) == 25, "half a second is made up for, not more"
    assert player.factor == pytest.approx(0.5)


class SlowSurface:
    """Something on which a picture takes two seconds."""

    largest_hz = 1000.0

    def __init__(self, clock):
        self.clock, self.left = clock, 4

    def poll(self):
        self.left -= 1
        return self.left >= 0

    def draw(self, notice=None):
        self.clock.now += 2.0


class Clock:
    now = 0.0

    def perf_counter(self):
        return self.now


def test_pictures_that_take_long_are_part_of_the_time(player, monkeypatch):
    clock = Clock()
    monkeypatch.setattr("trainers.play.loop.time", clock)
    play_on(SlowSurface(clock), player)
    assert player.session.time_s == pytest.approx(1.5)
    assert player.factor == pytest.approx(0.25), "half a second of every two"


class Collapse:
    def predict(self, obs, deterministic=True):
        return np.where(np.arange(12) % 3 == 1, 1.0, -1.0).astype(np.float32), None


def test_a_robot_that_fell_stands_up_by_itself_in_its_gait():
    hands = Hands()
    with Session(Collapse(), SETUP, hands.drive) as session:
        player = Player(session, hands)
        hands.press("pace")
        lay = 0
        while not (lay and not session.ended):
            assert player.step() == 1
            lay += session.ended == "fall"
        assert lay == pytest.approx(LYING_S * 50, abs=2)
        assert session.steps == 1 and session.reading.task == "pace"


def test_a_film_of_a_fall_ends():
    with Session(Collapse(), SETUP) as session:
        player = Player(session, stands_up=False)
        while not player.over:
            player.step()
        assert session.ended == "fall" and player.step() == 0


# -- Keys --------------------------------------------------------------------------------------------------------------


def test_keys_are_held_and_letting_go_stands(player, controls):
    stick = lambda: player.hands.stick.tolist()  # noqa: E731
    controls.key("UP", True)
    assert stick() == [1.0, 0.0, 0.0]
    controls.key("W", True)
    controls.key("A", True)
    assert stick() == [1.0, 0.0, 1.0], "two keys for one direction pull once"
    controls.key("LEFT_SHIFT", True)
    assert stick() == [GENTLE, 0.0, GENTLE]
    controls.key("LEFT_SHIFT", False)
    controls.key("D", True)
    assert stick() == [1.0, 0.0, 0.0], "left and right"
    controls.key("UP", False)
    assert stick() == [1.0, 0.0, 0.0], "W is still down"
    for name in ("W", "A", "D"):
        controls.key(name, False)
    assert stick() == [0.0, 0.0, 0.0]
    for name, expected in (("E", [0.0, -1.0, 0.0]), ("DOWN", [-1.0, 0.0, 0.0]), ("RIGHT", [0.0, 0.0, -1.0])):
        controls.key(name, True)
        assert stick() == expected
        controls.let_go()
        assert stick() == [0.0, 0.0, 0.0]
    controls.key("F12", True)  # does nothing


def test_digits_choose_gaits(player, controls):
    for digit, task in zip("123456", player.session.go1.tasks, strict=True):
        controls.key(digit, True), controls.key(digit, False)
        player.step()
        assert player.session.go1.requested_task.name == task
    controls.choose_next(), player.step()
    assert player.session.go1.requested_task.name == "trot"
    controls.choose_next(-1), player.step()
    assert player.session.go1.requested_task.name == "gallop"


def test_the_other_keys(player, controls):
    assert player.help
    controls.key("H", True)
    assert not player.help
    controls.key("H", True)
    controls.key("SPACE", True)
    assert player.paused and not player.help, "whoever plays has read it"
    controls.key("SPACE", True)
    assert not player.paused
    controls.key("N", True)
    assert player.paused and player.session.steps == 1
    controls.key("MINUS", True)
    assert player.speed == 0.5
    controls.key("EQUAL", True)
    assert player.speed == 1.0
    controls.key("T", True)
    assert player.session.expert_drives
    controls.key("G", True)
    assert player.ghost
    controls.key("C", True)
    assert player.camera.mode == "follow"
    controls.key("R", True)
    assert player.session.steps == 0
    controls.key("ESCAPE", True)
    assert controls.quit


def test_a_push_goes_where_the_camera_looks(player, controls):
    player.camera.mode, player.camera.mjv.azimuth = "free", 90.0
    sizes = []
    for shift in (False, True):
        controls.key("LEFT_SHIFT", shift)
        before = player.session.go1.simulation.data.qvel[:2].copy()
        controls.key("P", True)
        player.hands.drive(player.session.env, 1)
        change = player.session.go1.simulation.data.qvel[:2] - before
        assert abs(change[0]) < 1e-9 < 0.3 < change[1]
        sizes.append(change[1])
    assert sizes[1] == pytest.approx(2 * sizes[0], rel=0.01)


def test_without_hands_keys_only_look(student):
    with Session(student, SETUP) as session:
        controls = Controls(Player(session))
        for name in ("W", "2", "P"):
            controls.key(name, True)
        session.step()
        assert not session.go1.command.any() and session.go1.requested_task.name == "trot"


def test_keys_have_their_names():
    names = _key_names(glfw)
    assert [names[key] for key in (glfw.KEY_W, glfw.KEY_1, glfw.KEY_UP, glfw.KEY_LEFT_SHIFT, glfw.KEY_SPACE)] == [
        "W", "1", "UP", "LEFT_SHIFT", "SPACE",
    ]  # fmt: skip


# -- Gamepad -----------------------------------------------------------------------------------------------------------


def test_a_gamepad_drives(player, controls):
    plugged = types.SimpleNamespace(axes=[0.0] * 6, buttons=[0] * 15)
    known = {name: getattr(glfw, name) for name in dir(glfw) if name.startswith(("GAMEPAD_", "JOYSTICK_"))}
    fake = types.SimpleNamespace(
        **known, joystick_is_gamepad=lambda i: i == 2 and plugged is not None, get_gamepad_state=lambda i: plugged
    )
    gamepad = Gamepad(controls, fake)
    plugged.axes[glfw.GAMEPAD_AXIS_LEFT_Y] = -1.0  # away from the player
    plugged.axes[glfw.GAMEPAD_AXIS_LEFT_X] = 0.05
    plugged.axes[glfw.GAMEPAD_AXIS_RIGHT_X] = 0.56
    gamepad.poll()
    np.testing.assert_allclose(player.hands.stick, [1.0, 0.0, -0.5])
    plugged.buttons[glfw.GAMEPAD_BUTTON_RIGHT_BUMPER] = 1
    for _ in range(3):  # held: once
        gamepad.poll()
        player.step()
    assert player.session.go1.requested_task.name == player.session.go1.tasks[1]
    plugged.buttons[glfw.GAMEPAD_BUTTON_START] = 1
    gamepad.poll()
    assert player.paused
    plugged = None
    gamepad.poll()
    assert not player.hands.stick.any(), "it was pulled out"


# -- Camera ------------------------------------------------------------------------------------------------------------


def test_a_robot_that_is_nowhere_is_not_followed():
    camera = Camera()
    camera.follow(np.array([3.0, -1.0, 0.3]), 0.5, 10.0)
    before = camera.mjv.lookat.copy(), camera.mjv.azimuth
    camera.follow(np.array([np.nan, 0.0, 0.3]), 0.5, 10.1)
    camera.follow(np.array([3.0, 0.0, 0.3]), np.nan, 10.2)
    np.testing.assert_array_equal(camera.mjv.lookat, before[0])
    assert camera.mjv.azimuth == before[1]
    camera.follow(np.array([0.0, 0.0, 0.3]), 0.0, 0.0)
    np.testing.assert_allclose(camera.mjv.lookat, [0.0, 0.0, AIM_HEIGHT], atol=1e-9)


def test_a_robot_that_diverges_while_it_lies_begins_anew(player, monkeypatch):
    ends = iter(["fall", "unstable", "unstable"])
    step = player.session.env.step

    def diverging(action):
        *rest, info = step(action)
        return (*rest, info | {"ended": next(ends, "")})

    monkeypatch.setattr(player.session.env, "step", diverging)
    player.step()
    assert player.session.ended == "fall" and not player.over
    player.step()
    assert player.session.ended == "unstable" and player.over
    assert notice_of(player).startswith("the physics has diverged")
    player.step()
    assert player.session.steps == 1, "it stood up"


def test_the_camera_follows_and_turns():
    camera = Camera()
    azimuth = camera.mjv.azimuth
    for step in range(200):
        camera.follow(np.array([3.0, -1.0, 0.3]), 7.0, step / 50)
    np.testing.assert_allclose(camera.mjv.lookat, [3.0, -1.0, AIM_HEIGHT], atol=1e-6)
    assert (camera.mjv.azimuth - azimuth) % 360 == pytest.approx(np.degrees(7.0) % 360, abs=1e-4)
    camera.next_mode()
    azimuth = camera.mjv.azimuth
    camera.follow(np.array([4.0, -1.0, 0.3]), 1.0, 14.0)
    assert camera.mjv.azimuth == azimuth and camera.mjv.lookat[0] == pytest.approx(4.0)
    camera.follow(np.array([0.0, 0.0, 0.3]), 0.0, 0.0)
    np.testing.assert_allclose(camera.mjv.lookat, [0.0, 0.0, AIM_HEIGHT]), "a new episode: it jumps"
    camera.next_mode()
    camera.follow(np.array([9.0, 0.0, 0.3]), 0.0, 1.0)
    assert camera.mode == "free" and camera.mjv.lookat[0] == 0.0


def test_the_mouse_moves_the_camera():
    camera = Camera("follow")
    camera.mjv.azimuth, camera.mjv.elevation, camera.mjv.distance = 0.0, 0.0, 2.0
    camera.rotate(0.5, 0.25)
    assert (camera.mjv.azimuth, camera.mjv.elevation) == (-90.0, -45.0)
    camera.rotate(-0.5, 5.0)
    assert camera.mjv.elevation == -89.0
    camera.mjv.elevation = 0.0
    camera.zoom(np.log(2.0))
    assert camera.mjv.distance == pytest.approx(1.0)
    camera.zoom(-100.0)
    assert camera.mjv.distance == 30.0
    camera.mjv.distance = 1.0
    camera.pan(0.1, 0.2)  # it looks along x: the world moves right, along -y, and down
    np.testing.assert_allclose(camera.mjv.lookat, [0.0, 0.1, AIM_HEIGHT + 0.2], atol=1e-12)
    assert camera.mode == "free"


# -- What is written ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(640, 360), (1280, 720), (700, 900), (64, 48)])
def test_everything_that_is_written_is_in_the_picture(player, size):
    empty = np.full((size[1], size[0], 3), 120, np.uint8)
    assert player.help
    drawn = play_panels(size, player, "something that matters")
    assert len(drawn) == 6
    for panel in drawn:
        height, width, _ = panel.pixels.shape
        assert panel.left >= 0 and panel.top >= 0
        assert panel.left + width <= size[0] + 1 and panel.top + height <= size[1] + 1
    picture = lay_over(empty, drawn)
    assert picture.shape == empty.shape and 0.15 < (picture != 120).any(-1).mean() < 0.8


def test_the_picture_says_what_is_to_be_known(player):
    def changed(**view) -> int:
        before = lay_over(np.full((360, 640, 3), 120, np.uint8), play_panels((640, 360), player))
        for name, value in view.items():
            setattr(player, name, value)
        after = lay_over(np.full((360, 640, 3), 120, np.uint8), play_panels((640, 360), player))
        return int((before != after).any(-1).sum())

    assert changed(help=False) > 10_000
    assert changed(paused=True) > 1000, "a notice"
    assert changed(factor=0.5) > 10
    assert changed() == 0


@pytest.mark.parametrize("size", [(640, 360), (1920, 1080)])
def test_a_click_finds_the_button(size):
    tasks, scale = ("trot", "bound", "jump"), Page(*size).scale
    found = [button_at(size, tasks, scale * x, scale * 20.0) for x in (5.0, 15.0, 78.0, 81.0, 200.0, 230.0)]
    assert found == [None, "trot", None, "bound", "jump", None]
    assert button_at(size, tasks, scale * 15.0, scale * 40.0) is None
