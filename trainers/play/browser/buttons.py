"""The page's buttons. Each is a key of `Controls`, so that a click, a finger and the keyboard mean the same."""

import functools
import html
import importlib.resources
import json
import time
from collections.abc import Callable
from typing import Any

from trainers.play.browser.holds import Holds
from trainers.play.controls import HELP, SHIFT_KEYS, STICK_KEYS, Controls
from trainers.play.player import Player

Post = Callable[[Callable[[], object]], None]
"""Takes something that is to be done between two pictures, in the thread that plays."""

PAD = (("Q", "Q ⇠"), ("W", "W ▲"), ("E", "⇢ E"), ("A", "A ↺"), ("S", "S ▼"), ("D", "↻ D"))
"""Keys that are held to move the stick, as they lie on a keyboard, and what is written on them."""
GENTLY = ("LEFT_SHIFT", "⇧ half as fast, push twice as hard")
ACTIONS = (
    ("P", "Push"), ("R", "Stand up"), ("T", "Expert"),
    ("SPACE", "Pause"), ("N", "One step"), ("G", "Ghost"),
    ("MINUS", "Slower"), ("EQUAL", "Faster"), ("C", "Camera"),
)  # fmt: skip
LOOKS = ("SPACE", "N", "G", "MINUS", "EQUAL", "C", "R", "T")
"""What there is to do where no hands drive."""
NOT_HERE = ("H, Esc",)
"""Of `HELP`: keys of the window alone."""
CODES = {"SPACE": "Space", "MINUS": "Minus", "EQUAL": "Equal", "LEFT_SHIFT": "ShiftLeft", "RIGHT_SHIFT": "ShiftRight"}
"""Codes that browsers give to keys, where they do not follow from the names."""
ARROWS = {"UP": "ArrowUp", "DOWN": "ArrowDown", "LEFT": "ArrowLeft", "RIGHT": "ArrowRight"}
HOLD_HZ = 10.0
"""How often a tab says that a button is held."""
LIT, DARK = "blue", "gray"
COLUMNS = 3
EDGE = 9
"""Between the buttons and the panel's edges [pixels]."""


class Buttons:
    """Buttons for gaits, stick and everything else, and the keyboard that presses them.

    Args:
        gui: viser's `GuiApi`.
        player: whose gaits and state they show.
        controls: that they reach.
        holds: that they are held by.
        post: what brings that to the thread that plays.
        turn_to: is told of a tab's handle before one of its buttons acts.

    Attributes:
        keyboard: JavaScript that lets the keyboard press them.
    """

    def __init__(
        self, gui: Any, player: Player, controls: Controls, holds: Holds, post: Post, turn_to: Callable[[Any], None]
    ) -> None:
        self._gui, self._player, self._controls, self._holds = gui, player, controls, holds
        self._post, self._turn_to = post, turn_to
        self._buttons: dict[str, Any] = {}
        self._gaits: dict[str, str] = {}
        driven = player.hands is not None
        if driven:
            for number, task in enumerate(player.session.go1.tasks, 1):
                self._gaits[task] = str(number)
                self._add(str(number), f"{number} {task}", self._press)
            for key, label in (*PAD, GENTLY):
                self._add(key, label, self._hold)
        for key, label in ACTIONS:
            if driven or key in LOOKS:
                self._add(key, label, self._press)
        self.keyboard = self._keyboard()
        # a picture that cannot be loaded runs the script: those in HTML that comes later are not run
        picture = f'<img alt="" style="display: none" src="data:," onerror="{html.escape(self.keyboard)}">'
        gui.add_html(self._style() + picture)
        with gui.add_folder("Keys", expand_by_default=False):
            gui.add_html(_help())

    def update(self) -> None:
        """Light those that are on."""
        player, session = self._player, self._player.session
        lit = {
            self._gaits.get(session.go1.requested_task.name): True,
            "T": session.expert_drives, "SPACE": player.paused, "G": player.ghost, "MINUS": player.speed < 1.0,
        }  # fmt: skip
        for key, button in self._buttons.items():
            button.color = LIT if lit.get(key) else DARK
        self._buttons["SPACE"].label = "Go on" if player.paused else "Pause"
        self._buttons["C"].label = f"Cam: {player.camera.mode}"

    def _add(self, key: str, label: str, act: Callable[[str, Any], None]) -> None:
        button = self._buttons[key] = self._gui.add_button(label, color=DARK)
        act(key, button)

    def _press(self, key: str, button: Any) -> None:
        """Let a click press a key."""

        @button.on_click
        async def _(event: Any) -> None:  # async: viser calls it at once, and in the order in which things were done
            self._post(functools.partial(self._pressed, key, event.client))

    def _pressed(self, key: str, tab: Any) -> None:
        self._turn_to(tab)
        self._controls.key(key, True)

    def _hold(self, key: str, button: Any) -> None:
        """Let a button that is held hold a key; a click is how viser tells that it was let go."""

        @button.on_hold(callback_hz=HOLD_HZ)
        async def _(event: Any) -> None:
            self._post(functools.partial(self._holds.hold, event.client_id, key, time.monotonic()))

        @button.on_click
        async def _(event: Any) -> None:
            self._post(functools.partial(self._holds.release, event.client_id, key))

    # -- In the browser ------------------------------------------------------------------------------------------------

    @property
    def ids(self) -> dict[str, str]:
        """Key -> id of its button's element, for which viser has no public name."""
        return {key: button._impl.uuid for key, button in self._buttons.items()}

    def _style(self) -> str:
        """Three in a row; viser gives each button a line of its own."""
        rows = ", ".join(self._box(key) for key in self._buttons if key != GENTLY[0])
        first = ", ".join(self._box(key) for group in self._groups() for key in group[:COLUMNS])
        width = f"calc({100 / COLUMNS:.3f}% - {2 * EDGE / COLUMNS:.3f}px)"
        place = (
            f"display: inline-block; box-sizing: border-box; width: {width};"
            " margin: 0 !important; padding: 0 2px 4px !important"
        )
        each = ", ".join(f"{self._box(key)} button" for key in self._buttons)
        # the edges of the panel are the margins of the outer ones
        left = ", ".join(self._box(key) for group in self._groups() for key in group[::COLUMNS])
        return (
            f"<style>{rows} {{ {place} }} {left} {{ margin-left: {EDGE}px !important }}"
            f" {first} {{ padding-top: 6px !important }}"
            f" {each} {{ padding: 0 2px; touch-action: none }}"
            "</style>"
        )

    def _box(self, key: str) -> str:
        """What selects the box around a button."""
        return f'div:has(> [id="{self.ids[key]}"])'

    def _groups(self) -> list[list[str]]:
        """Keys of the buttons that stand together in rows."""
        groups = (self._gaits.values(), (key for key, _ in PAD), (key for key, _ in ACTIONS))
        return [[key for key in group if key in self._buttons] for group in groups]

    def _keyboard(self) -> str:
        """`keyboard.js` for these buttons."""
        held = [self.ids[key] for key, _ in (*PAD, GENTLY) if key in self._buttons]
        buttons = {_code(key): self.ids[alike] for key, alike in self._aliases().items()}
        script = importlib.resources.files(__package__).joinpath("keyboard.js").read_text("utf-8")
        return script.replace("KEYS", json.dumps({"buttons": buttons, "held": held}))

    def _aliases(self) -> dict[str, str]:
        """The button that each key presses: its own, or that of another one which does the same."""
        keys = {key: key for key in self._buttons}
        for key, end in STICK_KEYS.items():
            for alike, _ in PAD:
                if STICK_KEYS[alike] == end and alike in self._buttons:
                    keys[key] = alike
        if GENTLY[0] in self._buttons:
            keys |= dict.fromkeys(SHIFT_KEYS, GENTLY[0])
        return keys


def _code(key: str) -> str:
    """What browsers call a key that has a name of GLFW's."""
    if len(key) == 1:
        return f"Digit{key}" if key.isdigit() else f"Key{key}"
    return (CODES | ARROWS)[key]


def _help() -> str:
    shown = [(keys, does) for keys, does in HELP if keys not in NOT_HERE]
    rows = "".join(f"<tr><td>{html.escape(keys)}</td><td>{html.escape(does)}</td></tr>" for keys, does in shown)
    return f'<table style="font-size: 0.85em; margin: 0 0.75em 0.5em; border-spacing: 0.6em 0.1em">{rows}</table>'
