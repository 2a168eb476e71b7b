"""Keys, by the names that GLFW gives them on an American keyboard, and what they do."""

import functools
from collections.abc import Callable

import numpy as np

from trainers.play.hands import PUSH_SHARE
from trainers.play.player import Player

FORWARD, LEFT, TURN = range(3)
STICK_KEYS = {
    "W": (FORWARD, 1.0), "UP": (FORWARD, 1.0), "S": (FORWARD, -1.0), "DOWN": (FORWARD, -1.0),
    "Q": (LEFT, 1.0), "E": (LEFT, -1.0),
    "A": (TURN, 1.0), "LEFT": (TURN, 1.0), "D": (TURN, -1.0), "RIGHT": (TURN, -1.0),
}  # fmt: skip
"""Axis of the stick that a key holds at one of its ends."""
SHIFT_KEYS = ("LEFT_SHIFT", "RIGHT_SHIFT")
GENTLE = 0.5
"""Deflection of the stick while Shift is held."""
HARD_PUSH = 2.0 * PUSH_SHARE
HELP = (
    ("W S, up down", "forward, backward"),
    ("A D, left right", "turn"),
    ("Q E", "step to the side"),
    ("Shift", "half as fast"),
    ("1 - 6", "gait (or click on it)"),
    ("P, Shift P", "push away from you, harder"),
    ("T", "student or expert"),
    ("G", "ghost of the expert's pose"),
    ("Space, N", "pause, one step on"),
    ("- =", "slower, faster"),
    ("R", "stand up again"),
    ("C", "camera: chase, follow, free"),
    ("mouse", "turn, shift, zoom the view"),
    ("H, Esc", "this help, quit"),
)
"""Keys and what they do, as the player reads it."""


class Controls:
    """Turns keys that go down and up into what the player wants; letting go stands.

    Args:
        player: that is controlled.

    Attributes:
        quit: whether the player has had enough.
    """

    def __init__(self, player: Player) -> None:
        self.quit = False
        self._player = player
        self._held: dict[str, None] = {}
        self._analog = np.zeros(3)
        presses: dict[str, Callable[[], object]] = {
            "SPACE": self._pause,
            "N": self._one_step,
            "MINUS": player.slower,
            "EQUAL": lambda: player.slower(-1),
            "R": player.reset,
            "T": self.change_driver,
            "G": self._ghost,
            "C": player.camera.next_mode,
            "P": self.push,
            "H": self._help,
            "ESCAPE": self._quit,
        }
        for number, task in enumerate(player.session.go1.tasks, 1):
            presses[str(number)] = functools.partial(self.choose, task)
        self._presses = presses

    def key(self, name: str, down: bool) -> None:
        """A key went down, or up; a key that does nothing does nothing.

        Args:
            name: of the key, as GLFW has it without its prefix: "W", "UP", "LEFT_SHIFT".
            down: which of the two.
        """
        if name in STICK_KEYS or name in SHIFT_KEYS:
            if down:
                self._held[name] = None
            else:
                self._held.pop(name, None)
            self._move_stick()
        elif down and name in self._presses:
            self._presses[name]()
        if down and name != "H":
            self._player.help = False

    def lean(self, stick: np.ndarray) -> None:
        """Where a gamepad's sticks are: (forward, left, turn), each in [-1, 1], shape (3,); keys add to it."""
        if (stick != self._analog).any():
            self._analog = stick.copy()
            self._move_stick()

    def let_go(self) -> None:
        """Release every key, as when another window gets them."""
        self._held.clear()
        self._analog = np.zeros(3)
        self._move_stick()

    def _move_stick(self) -> None:
        stick = self._analog.copy()
        pull = GENTLE if self._shifted else 1.0
        ends = {STICK_KEYS[name] for name in self._held if name in STICK_KEYS}  # W and up together pull once
        for axis, end in ends:
            stick[axis] += pull * end
        if self._player.hands is not None:
            self._player.hands.move_stick(stick)

    @property
    def _shifted(self) -> bool:
        return any(name in self._held for name in SHIFT_KEYS)

    def choose(self, task: str) -> None:
        """Press the button of a gait."""
        if self._player.hands is not None:
            self._player.hands.press(task)

    def choose_next(self, steps: int = 1) -> None:
        """Press the button of the gait that stands so many places after the one that was asked for last."""
        go1 = self._player.session.go1
        place = go1.tasks.index(go1.requested_task.name) + steps
        self.choose(go1.tasks[place % len(go1.tasks)])

    def push(self) -> None:
        """Push in the direction in which the camera looks; with Shift as hard as the expert bears."""
        if self._player.hands is not None:
            share = HARD_PUSH if self._shifted else PUSH_SHARE
            self._player.hands.push(self._player.camera.direction_w, share)

    def change_driver(self) -> None:
        """Let the student take over from the expert, or the other way round."""
        self._player.session.expert_drives = not self._player.session.expert_drives

    def _pause(self) -> None:
        self._player.paused = not self._player.paused

    def _one_step(self) -> None:
        self._player.paused = True
        self._player.step()

    def _ghost(self) -> None:
        self._player.ghost = not self._player.ghost

    def _help(self) -> None:
        self._player.help = not self._player.help

    def _quit(self) -> None:
        self.quit = True
