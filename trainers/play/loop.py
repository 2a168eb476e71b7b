"""Playing by the clock on the wall, on whatever surface shows it."""

import time
from collections.abc import Callable
from typing import Protocol

import numpy as np

from go1_mtl_gym.rendering import Pace
from trainers.play.player import Player

LONGEST_PICTURE_S = 60.0
"""Time that passed since the last picture counts up to this [s]: a machine may have slept meanwhile."""
LOADING = "the expert is being loaded: some seconds, half a minute the first time"


class Surface(Protocol):
    """What shows a player's robot, and takes in what the player wants: a window, or pages in browsers.

    Attributes:
        largest_hz: pictures per second, at most.
        ends_by_interrupt: whether Ctrl+C, where the program runs, is how one ends it.
    """

    largest_hz: float
    ends_by_interrupt: bool

    def poll(self) -> bool:
        """Take in what was done since the last time; False once nobody wants to play on."""

    def draw(self, notice: str | None = None) -> None:
        """Show the present state.

        Args:
            notice: a line of text, in place of the one that would stand there.
        """

    def picture(self) -> np.ndarray:
        """What is shown, for a film; RGB, uint8, shape (height, width, 3)."""

    def close(self) -> None:
        """Free what it holds; may be called twice."""


def play_on(
    surface: Surface,
    player: Player,
    until: Callable[[], bool] = lambda: False,
    each: Callable[[], object] = lambda: None,
) -> None:
    """Let time pass, and show it, until nobody wants to play on.

    Args:
        surface: that shows it.
        player: whose session goes on.
        until: ends it too.
        each: is called after every picture.
    """
    pace = Pace(surface.largest_hz)
    before = time.perf_counter()
    while surface.poll() and not until():
        if player.session.waits_for_expert(player.ghost):
            surface.draw(LOADING)
            player.session.prepare_expert()
            before = time.perf_counter()  # nobody is to catch up with that
        now = time.perf_counter()
        player.advance(min(now - before, LONGEST_PICTURE_S))
        before = now
        surface.draw()
        each()
        pace.wait()
