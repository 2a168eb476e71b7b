"""What is written into a film: the gait, the velocity and its command, and which feet are on the ground.

The colors are those of the arrows and discs in the scene, so that the captions are its legend as well.
"""

import dataclasses
import functools
import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from go1_mtl_gym import robot
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.rendering import COMMAND_COLOR, CONTACT_COLOR, VELOCITY_COLOR
from trainers.evaluation.scoring import Series

Color = tuple[int, int, int, int]

SUPERSAMPLING = 2
"""Captions are drawn so many times as large and averaged; Pillow's own circles and corners have jagged edges."""
DENSE = 3.0
"""Pixels per unit from which on nobody sees them, and averaging would only take time."""
WIDTH, HEIGHT = 640, 360
"""Of a picture for which the sizes in this file are meant [pixels]; they grow with the picture."""
MEAN_S = 0.4
"""A velocity is shown as its mean over this time, about a gait cycle; within a cycle it swings [s]."""
STRIP_S = 2.0
"""How much of the past the strip of foot contacts shows [s]."""
FULL_SCALE = 1.5
"""Velocity at the end of a bar [m/s, rad/s]."""
AXES = (("forward", "m/s"), ("sideways", "m/s"), ("turn", "rad/s"))


def _color(rgba: Sequence[float], lighter: float = 0.0) -> Color:
    """A color of the scene in bytes, brought nearer to white by a fraction: text needs contrast with its panel."""
    red, green, blue = (round(255 * (part + lighter * (1.0 - part))) for part in rgba[:3])
    return red, green, blue, 255


COMMAND, MEASURED, CONTACT = _color(COMMAND_COLOR, 0.2), _color(VELOCITY_COLOR, 0.35), _color(CONTACT_COLOR)
TEXT: Color = (240, 243, 247, 255)
DIM: Color = (172, 181, 192, 255)
PANEL: Color = (24, 28, 36, 205)
TRACK: Color = (70, 78, 90, 255)
DARK: Color = (24, 28, 36, 255)


@dataclasses.dataclass(frozen=True)
class Reading:
    """What the captions say at one instant.

    Attributes:
        task: name of the present task.
        tasks: that there is a button for.
        command: filtered (vx [m/s], vy [m/s], yaw rate [rad/s]), as the green arrow shows it, shape (3,).
        measured: likewise, mean over `MEAN_S`, shape (3,).
        contacts: feet on the ground (FL, FR, RL, RR) during the last `STRIP_S`, newest last, bool, shape (n, 4).
        contacts_n: n of a full strip; at the start of an episode there is less to show.
    """

    task: str
    tasks: tuple[str, ...]
    command: np.ndarray
    measured: np.ndarray
    contacts: np.ndarray
    contacts_n: int

    @classmethod
    def of(
        cls,
        task: str,
        tasks: tuple[str, ...],
        command: np.ndarray,
        measured: np.ndarray,
        contacts: np.ndarray,
        control_hz: float,
    ) -> "Reading":
        """From what was measured until now, newest last; only as much of it as is shown counts.

        Args:
            task: name of the present task.
            tasks: that there is a button for.
            command: filtered, now, shape (3,).
            measured: (vx [m/s], vy [m/s], yaw rate [rad/s]), shape (n, 3).
            contacts: feet on the ground, bool, shape (n, 4).
            control_hz: rows per second.
        """
        mean_n, strip_n = max(1, round(MEAN_S * control_hz)), round(STRIP_S * control_hz)
        return cls(task, tasks, command, measured[-mean_n:].mean(0), contacts[-strip_n:], strip_n)


def reading(series: Series, steps: int, tasks: tuple[str, ...], control_hz: float) -> Reading:
    """What the captions say after some steps of an episode; after its end what they said there.

    Args:
        series: what was measured.
        steps: how many.
        tasks: that there is a button for.
        control_hz: steps per second.

    Raises:
        InvalidInputError: if nothing was measured.
    """
    if not len(series.measured):
        raise InvalidInputError("expected a series of at least one step, got an empty one")
    end = min(max(steps, 1), len(series.measured))  # the stand before the first step is as good as the one after it
    measured, contacts = series.measured[:end], series.contacts[:end]
    return Reading.of(series.tasks[end - 1], tasks, series.wanted[end - 1], measured, contacts, control_hz)


# -- Panels ------------------------------------------------------------------------------------------------------------


class Panel(NamedTuple):
    """A piece of the captions.

    Attributes:
        left: of its place in the picture [pixels].
        top: likewise.
        pixels: RGBA, uint8, shape (h, w, 4).
    """

    left: int
    top: int
    pixels: np.ndarray

    def within(self, width: int, height: int) -> "Panel":
        """The part of the panel that is in a picture of a size [pixels]."""
        skipped = (max(0, -self.top), max(0, -self.left))
        seen = self.pixels[skipped[0] : max(0, height - self.top), skipped[1] : max(0, width - self.left)]
        return Panel(self.left + skipped[1], self.top + skipped[0], np.ascontiguousarray(seen))

    def laid_over(self, beneath: np.ndarray) -> np.ndarray:
        """The panel over a part of a picture that is of its size; RGB, uint8, shape (h, w, 3)."""
        over = Image.alpha_composite(Image.fromarray(beneath).convert("RGBA"), Image.fromarray(self.pixels))
        return np.asarray(over.convert("RGB"))


def panels(size: tuple[int, int], said: Reading) -> list[Panel]:
    """The captions of a picture, piece by piece.

    Args:
        size: width and height of the picture [pixels]; about 16:9 leaves the middle to the robot.
        said: what they say.
    """
    page = Page(*size)
    drawn = [_velocities(page, said), _contacts(page, said)]
    return [_buttons(page, said), *drawn] if said.tasks else drawn


def lay_over(picture: np.ndarray, drawn: Iterable[Panel]) -> np.ndarray:
    """A picture with panels.

    Args:
        picture: RGB, uint8, shape (h, w, 3).
        drawn: what is laid over it.

    Returns:
        RGB, uint8, shape (h, w, 3).
    """
    picture = picture.copy()
    height, width, _ = picture.shape
    for panel in drawn:
        left, top, pixels = panel = panel.within(width, height)
        if pixels.size:
            place = slice(top, top + pixels.shape[0]), slice(left, left + pixels.shape[1])
            picture[place] = panel.laid_over(picture[place])
    return picture


def draw_captions(picture: np.ndarray, said: Reading) -> np.ndarray:
    """A picture with captions.

    Args:
        picture: RGB, uint8, shape (h, w, 3); about 16:9 leaves the middle to the robot.
        said: what they say.

    Returns:
        RGB, uint8, shape (h, w, 3).
    """
    height, width, _ = picture.shape
    return lay_over(picture, panels((width, height), said))


class Page:
    """Where things are in a picture, in units of one pixel of a picture of `WIDTH` x `HEIGHT`.

    Args:
        width: of the picture [pixels].
        height: likewise.

    Attributes:
        scale: pixels per unit; small enough for all of `WIDTH` and `HEIGHT` to be in the picture.
        width: of the picture [units].
        height: likewise.
    """

    def __init__(self, width: int, height: int) -> None:
        self.scale = min(width / WIDTH, height / HEIGHT)
        self.width, self.height = width / self.scale, height / self.scale

    def pen(self, x: float, y: float, width: float, height: float) -> "Pen":
        """What draws a panel whose upper left corner is at (x, y)."""
        left, top, right, bottom = (each * self.scale for each in (x, y, x + width, y + height))
        return Pen(self.scale, math.floor(left), math.floor(top), math.ceil(right), math.ceil(bottom))


class Pen:
    """Draws a panel, larger than it will be, in the units and from the origin of its page.

    Args:
        scale: pixels per unit.
        left, top, right, bottom: of the panel [pixels].
    """

    def __init__(self, scale: float, left: int, top: int, right: int, bottom: int) -> None:
        self._finer = SUPERSAMPLING if scale < DENSE else 1
        self._left, self._top, self._scale = left, top, self._finer * scale
        self._layer = Image.new("RGBA", (self._finer * (right - left), self._finer * (bottom - top)))
        self._draw = ImageDraw.Draw(self._layer)

    def panel(self) -> Panel:
        """What was drawn."""
        return Panel(self._left, self._top, np.asarray(self._layer.reduce(self._finer)))

    def _place(self, x: float, y: float) -> tuple[float, float]:
        return self._scale * x - self._finer * self._left, self._scale * y - self._finer * self._top

    def box(self, x: float, y: float, width: float, height: float, color: Color, radius: float = 0.0) -> None:
        """A filled rectangle with its upper left corner at (x, y); nothing where it would be thinner than a pixel."""
        left, top, right, bottom = (round(e) for e in (*self._place(x, y), *self._place(x + width, y + height)))
        if right > left and bottom > top:  # Pillow's rectangles include their last pixel
            corners = (left, top, right - 1, bottom - 1)
            self._draw.rounded_rectangle(corners, round(self._scale * radius), color)

    def disc(self, x: float, y: float, radius: float, color: Color) -> None:
        """A filled circle around (x, y)."""
        self._draw.ellipse([*self._place(x - radius, y - radius), *self._place(x + radius, y + radius)], color)

    def sector(self, x: float, y: float, radius: float, turns: float, color: Color) -> None:
        """A part of a disc around (x, y): from its top, clockwise, as many turns."""
        corners = [*self._place(x - radius, y - radius), *self._place(x + radius, y + radius)]
        self._draw.pieslice(corners, -90.0, -90.0 + 360.0 * turns, color)

    def arrow(self, x: float, y: float, length: float, color: Color) -> None:
        """An arrow to the right that starts at (x, y)."""
        self.box(x, y - 1.5, length - 6, 3, color)
        tip = [(x + length - 8, y - 4.5), (x + length, y), (x + length - 8, y + 4.5)]
        self._draw.polygon([self._place(*corner) for corner in tip], color)

    def text(self, x: float, y: float, words: str, size: float, color: Color, anchor: str = "lm") -> None:
        """Words whose anchor, in Pillow's letters, is at (x, y)."""
        self._draw.text(self._place(x, y), words, color, _font(self._scale * size), anchor)


@functools.lru_cache(maxsize=64)
def _font(pixels: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size=max(6.0, pixels))


BUTTON = (66.0, 24.0)
"""Width and height of a gait's button [units]."""
BUTTONS = (10.0, 8.0)
"""Left and top of the first one [units]."""
BUTTON_PITCH = 70.0
"""From one to the next [units]."""
VELOCITIES = (204.0, 86.0)
CONTACTS = (176.0, 86.0)
"""Width and height of a panel [units]."""
MARGIN = 10.0
"""Between panels and the sides and bottom of the picture [units]."""


def _buttons(page: Page, said: Reading) -> Panel:
    """The gaits in a row at the top; the present one is lit."""
    (x, y), (width, height) = BUTTONS, BUTTON
    pen = page.pen(x, y, BUTTON_PITCH * (len(said.tasks) - 1) + width, height)
    for task in said.tasks:
        lit = task == said.task
        pen.box(x, y, width, height, TEXT if lit else PANEL, 6)
        pen.text(x + width / 2, y + height / 2, task, 16 if lit else 14, DARK if lit else DIM, "mm")
        x += BUTTON_PITCH
    return pen.panel()


def _velocities(page: Page, said: Reading) -> Panel:
    """Command and measured velocity in numbers and bars, at the lower left."""
    width, height = VELOCITIES
    x, y = MARGIN, page.height - height - MARGIN
    pen = page.pen(x, y, width, height)
    pen.box(x, y, width, height, PANEL, 6)
    for left, name, color in ((8, "command", COMMAND), (104, "measured", MEASURED)):
        pen.arrow(x + left, y + 13, 18, color)
        pen.text(x + left + 23, y + 13, name, 13, color)
    for i, (name, unit) in enumerate(AXES):
        row, command, measured = y + 34 + 20 * i, float(said.command[i]), float(said.measured[i])
        pen.text(x + 8, row, name, 12, TEXT)
        _bar(pen, x + 64, row, 52, command, measured)
        pen.text(x + 145, row, number(command), 13, COMMAND, "rm")
        pen.text(x + 172, row, number(measured), 13, MEASURED, "rm")
        pen.text(x + 175, row, unit, 10, DIM)
    return pen.panel()


def _bar(pen: Pen, x: float, y: float, width: float, command: float, measured: float) -> None:
    """A bar from zero in the middle to the measured value, with a mark at the command."""
    pen.box(x, y - 4, width, 8, TRACK, 2)
    zero, per_unit = x + width / 2, width / 2 / FULL_SCALE
    end, mark = (zero + per_unit * np.clip(value, -FULL_SCALE, FULL_SCALE) for value in (measured, command))
    pen.box(min(zero, end), y - 4, abs(end - zero), 8, MEASURED)
    pen.box(mark - 1, y - 6, 3, 12, COMMAND)


def number(value: float) -> str:
    """A velocity in writing: one digit behind the point, and no sign before a zero."""
    return f"{round(value, 1) + 0.0:.1f}"


def _contacts(page: Page, said: Reading) -> Panel:
    """Which foot was on the ground when, newest at the right, at the lower right."""
    width, height = CONTACTS
    x, y = page.width - width - MARGIN, page.height - height - MARGIN
    pen = page.pen(x, y, width, height)
    pen.box(x, y, width, height, PANEL, 6)
    pen.disc(x + 17, y + 13, 5, CONTACT)
    pen.text(x + 30, y + 13, f"foot on the ground, {STRIP_S:g} s", 13, CONTACT)
    left, step = x + 34, 132 / said.contacts_n
    first = said.contacts_n - len(said.contacts)
    for leg, name in enumerate(robot.LEGS):
        row = y + 32 + 15 * leg
        pen.text(x + 10, row, name, 11, TEXT)
        pen.box(left, row - 5, 132, 10, TRACK)
        for begin, end in spells(said.contacts[:, leg]):
            pen.box(left + step * (first + begin), row - 5, step * (end - begin), 10, CONTACT)
    return pen.panel()


def spells(on: np.ndarray) -> list[tuple[int, int]]:
    """(first, one past the last) index of each run of True, of a bool array of shape (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(int)))
    return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]
