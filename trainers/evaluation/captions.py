"""What is written into a film: the gait, the velocity and its command, and which feet are on the ground.

The colors are those of the arrows and discs in the scene, so that the captions are its legend as well.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from go1_mtl_gym import robot
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.rendering import COMMAND_COLOR, CONTACT_COLOR, VELOCITY_COLOR
from trainers.evaluation.scoring import Series

Color = tuple[int, int, int, int]

SUPERSAMPLING = 2
"""Captions are drawn so many times as large and averaged; Pillow's own circles and corners have jagged edges."""
HEIGHT = 360
"""Height of a picture for which the sizes in this file are meant [pixels]; they grow with the picture."""
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
    mean_n, strip_n = max(1, round(MEAN_S * control_hz)), round(STRIP_S * control_hz)
    return Reading(
        task=series.tasks[end - 1],
        tasks=tasks,
        command=series.wanted[end - 1],
        measured=series.measured[max(0, end - mean_n) : end].mean(0),
        contacts=series.contacts[max(0, end - strip_n) : end],
        contacts_n=strip_n,
    )


def draw_captions(picture: np.ndarray, said: Reading) -> np.ndarray:
    """A picture with captions.

    Args:
        picture: RGB, uint8, shape (h, w, 3); about 16:9 leaves the middle to the robot.
        said: what they say.

    Returns:
        RGB, uint8, shape (h, w, 3).
    """
    image = Image.fromarray(picture).convert("RGBA")
    pen = _Pen(image.size)
    _buttons(pen, said)
    _velocities(pen, said)
    _contacts(pen, said)
    return np.asarray(Image.alpha_composite(image, pen.layer.reduce(SUPERSAMPLING)).convert("RGB"))


class _Pen:
    """Draws on a transparent layer, `SUPERSAMPLING` times as large as the picture, in units of one of `HEIGHT`.

    Args:
        size: width and height of the picture [pixels].
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.layer = Image.new("RGBA", (SUPERSAMPLING * size[0], SUPERSAMPLING * size[1]))
        self._draw = ImageDraw.Draw(self.layer)
        self._scale = SUPERSAMPLING * size[1] / HEIGHT
        self.width = self.layer.width / self._scale

    def box(self, x: float, y: float, width: float, height: float, color: Color, radius: float = 0.0) -> None:
        """A filled rectangle with its upper left corner at (x, y); nothing where it would be thinner than a pixel."""
        corners = [round(self._scale * each) for each in (x, y, x + width, y + height)]
        corners[2:] = [corners[2] - 1, corners[3] - 1]  # Pillow's rectangles include their last pixel
        if corners[2] >= corners[0] and corners[3] >= corners[1]:
            self._draw.rounded_rectangle(corners, round(self._scale * radius), color)

    def disc(self, x: float, y: float, radius: float, color: Color) -> None:
        """A filled circle around (x, y)."""
        self._draw.ellipse([self._scale * each for each in (x - radius, y - radius, x + radius, y + radius)], color)

    def arrow(self, x: float, y: float, length: float, color: Color) -> None:
        """An arrow to the right that starts at (x, y)."""
        self.box(x, y - 1.5, length - 6, 3, color)
        tip = [(x + length - 8, y - 4.5), (x + length, y), (x + length - 8, y + 4.5)]
        self._draw.polygon([(self._scale * a, self._scale * b) for a, b in tip], color)

    def text(self, x: float, y: float, words: str, size: float, color: Color, anchor: str = "lm") -> None:
        """Words whose anchor, in Pillow's letters, is at (x, y)."""
        self._draw.text((self._scale * x, self._scale * y), words, color, _font(self._scale * size), anchor)


def _font(pixels: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size=max(6.0, pixels))


def _buttons(pen: _Pen, said: Reading) -> None:
    """The gaits in a row at the top; the present one is lit."""
    x, y, width, height = 10.0, 8.0, 66.0, 24.0
    for task in said.tasks:
        lit = task == said.task
        pen.box(x, y, width, height, TEXT if lit else PANEL, 6)
        pen.text(x + width / 2, y + height / 2, task, 16 if lit else 14, DARK if lit else DIM, "mm")
        x += width + 4


def _velocities(pen: _Pen, said: Reading) -> None:
    """Command and measured velocity in numbers and bars, at the lower left."""
    x, y, width, height = 10.0, 264.0, 204.0, 86.0
    pen.box(x, y, width, height, PANEL, 6)
    for left, name, color in ((8, "command", COMMAND), (104, "measured", MEASURED)):
        pen.arrow(x + left, y + 13, 18, color)
        pen.text(x + left + 23, y + 13, name, 13, color)
    for i, (name, unit) in enumerate(AXES):
        row, command, measured = y + 34 + 20 * i, float(said.command[i]), float(said.measured[i])
        pen.text(x + 8, row, name, 12, TEXT)
        _bar(pen, x + 64, row, 52, command, measured)
        pen.text(x + 145, row, _number(command), 13, COMMAND, "rm")
        pen.text(x + 172, row, _number(measured), 13, MEASURED, "rm")
        pen.text(x + 175, row, unit, 10, DIM)


def _bar(pen: _Pen, x: float, y: float, width: float, command: float, measured: float) -> None:
    """A bar from zero in the middle to the measured value, with a mark at the command."""
    pen.box(x, y - 4, width, 8, TRACK, 2)
    zero, per_unit = x + width / 2, width / 2 / FULL_SCALE
    end, mark = (zero + per_unit * np.clip(value, -FULL_SCALE, FULL_SCALE) for value in (measured, command))
    pen.box(min(zero, end), y - 4, abs(end - zero), 8, MEASURED)
    pen.box(mark - 1, y - 6, 3, 12, COMMAND)


def _number(value: float) -> str:
    """One digit behind the point, and no sign before a zero."""
    return f"{round(value, 1) + 0.0:.1f}"


def _contacts(pen: _Pen, said: Reading) -> None:
    """Which foot was on the ground when, newest at the right, at the lower right."""
    width, height = 176.0, 86.0
    x, y = pen.width - width - 10, 264.0
    pen.box(x, y, width, height, PANEL, 6)
    pen.disc(x + 17, y + 13, 5, CONTACT)
    pen.text(x + 30, y + 13, f"foot on the ground, {STRIP_S:g} s", 13, CONTACT)
    left, step = x + 34, 132 / said.contacts_n
    first = said.contacts_n - len(said.contacts)
    for leg, name in enumerate(robot.LEGS):
        row = y + 32 + 15 * leg
        pen.text(x + 10, row, name, 11, TEXT)
        pen.box(left, row - 5, 132, 10, TRACK)
        for begin, end in _spells(said.contacts[:, leg]):
            pen.box(left + step * (first + begin), row - 5, step * (end - begin), 10, CONTACT)


def _spells(on: np.ndarray) -> list[tuple[int, int]]:
    """(first, one past the last) index of each run of True, of a bool array of shape (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(int)))
    return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]
