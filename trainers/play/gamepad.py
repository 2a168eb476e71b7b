"""A gamepad's sticks and buttons, by GLFW, which knows the layouts of some hundreds of them."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from trainers.play.controls import Controls

DEAD_ZONE = 0.12
"""Deflection of a stick that is rest: sticks do not come back to exactly zero."""


class Gamepad:
    """The first gamepad that is plugged in, now or later. Left stick: walk; right stick: turn.

    Args:
        controls: what it reaches.
        glfw: the module, started.
    """

    def __init__(self, controls: Controls, glfw: Any) -> None:
        self._controls, self._glfw = controls, glfw
        self._down: set[int] = set()
        self._presses: dict[int, Callable[[], object]] = {
            glfw.GAMEPAD_BUTTON_A: controls.push,
            glfw.GAMEPAD_BUTTON_LEFT_BUMPER: lambda: controls.choose_next(-1),
            glfw.GAMEPAD_BUTTON_RIGHT_BUMPER: controls.choose_next,
        } | {
            button: functools.partial(controls.key, name, True)
            for button, name in (
                (glfw.GAMEPAD_BUTTON_B, "R"),
                (glfw.GAMEPAD_BUTTON_X, "G"),
                (glfw.GAMEPAD_BUTTON_Y, "T"),
                (glfw.GAMEPAD_BUTTON_BACK, "C"),
                (glfw.GAMEPAD_BUTTON_START, "SPACE"),
            )
        }

    def poll(self) -> None:
        """Take in where its sticks are, and which of its buttons went down since the last time."""
        state = self._state()
        if state is None:
            if self._down:  # it was unplugged
                self._down.clear()
            self._controls.lean(np.zeros(3))
            return
        glfw, axes = self._glfw, state.axes
        ends = (glfw.GAMEPAD_AXIS_LEFT_Y, glfw.GAMEPAD_AXIS_LEFT_X, glfw.GAMEPAD_AXIS_RIGHT_X)
        self._controls.lean(-_rested(np.array([axes[axis] for axis in ends])))  # theirs point down and right
        down = {button for button in self._presses if state.buttons[button]}
        for button in down - self._down:
            self._presses[button]()
        self._down = down

    def _state(self) -> Any:
        glfw = self._glfw
        for joystick in range(glfw.JOYSTICK_1, glfw.JOYSTICK_LAST + 1):
            if glfw.joystick_is_gamepad(joystick):
                return glfw.get_gamepad_state(joystick)
        return None


def _rested(axes: np.ndarray) -> np.ndarray:
    """Deflections without the dead zone; the rest is stretched, so that it begins at zero and ends at one."""
    return np.sign(axes) * np.clip((np.abs(axes) - DEAD_ZONE) / (1.0 - DEAD_ZONE), 0.0, 1.0)
