"""Moving pictures of a policy or an expert at work."""

import math
from collections.abc import Mapping
from os import PathLike
from typing import Any, cast

import gymnasium
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from go1_mtl_gym import Go1Env
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import integer_in
from trainers.data.environments import base_env, make_env
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.rollout import checked_agent
from trainers.utils.files import write_atomically
from trainers.utils.validation import refuse_overridden

COLORS = 128
"""Entries of the palette that all frames of a GIF share."""
PALETTE_FRAMES = 8
"""Frames that the palette is made from."""
SHADOW_PIXELS = 1024
"""Side of the shadow map; the model's own is finer and slower."""
MAX_FPS = 50
"""Browsers slow down GIFs that ask for more."""
WEBP_EFFORT = 4
"""From 0, fast, to 6, small."""
KEY_FRAMES = (3, 5)
"""Fewest and most frames from one whole picture of a WebP to the next."""


def record_frames(
    policy_or_expert: Any,
    task: str,
    seconds: float = 4.0,
    command: tuple[float, float, float] = (0.5, 0.0, 0.0),
    seed: int = 0,
    fps: int = 25,
    width: int = 320,
    height: int = 240,
    **env_kwargs: Any,
) -> np.ndarray:
    """Film one episode from its standing start; after a fall the last picture stays.

    Pictures are drawn at twice the size without the renderer's own anti-aliasing and averaged over 2 x 2 pixels, which
    is smoother and, on software OpenGL, faster.

    Args:
        policy_or_expert: as in `trainers.evaluate`: a policy, an expert, or "expert".
        task: name of the task.
        seconds: duration [s].
        command: (vx [m/s], vy [m/s], yaw rate [rad/s]).
        seed: of the reset.
        fps: pictures per second, at most the control rate.
        width: of a picture [pixels].
        height: likewise.
        env_kwargs: of the environment; on top of the policy's own ``env_kwargs``.

    Returns:
        RGB, uint8, shape (n, height, width, 3), with n = seconds times fps.

    Raises:
        InvalidInputError: if an argument is not as described.
        go1_mtl_gym.rendering.RenderingError: if no picture can be drawn on this machine.
    """
    if not seconds > 0:
        raise InvalidInputError(f"seconds must be > 0, got {seconds}")
    policy_or_expert = checked_agent(policy_or_expert)
    refuse_overridden(env_kwargs, episode_s="seconds", render_mode="record_frames", task="task")
    film = Film(width, height, fps)
    kwargs = {**getattr(policy_or_expert, "env_kwargs", {}), **env_kwargs, **film.env_kwargs}
    EpisodeSetup(task, seed, seconds, command=command).play(policy_or_expert, kwargs, make_env, film)
    return film.frames(max(1, round(seconds * fps)))


class Film:
    """Takes pictures of an episode while it is played: the `watch` of `EpisodeSetup.play`.

    Args:
        width: of a picture [pixels].
        height: likewise.
        fps: pictures per second, at most the control rate.
        start_s: when the first one is taken [s].

    Raises:
        InvalidInputError: if a size or rate cannot be.
    """

    def __init__(self, width: int, height: int, fps: int, start_s: float = 0.0) -> None:
        if not 0 < fps <= MAX_FPS:
            raise InvalidInputError(f"fps must be from 1 to {MAX_FPS}, got {fps}")
        if min(width, height) < 16 or max(width, height) > 2048:
            raise InvalidInputError(f"width and height must be from 16 to 2048 pixels, got {width} and {height}")
        self._size, self._fps, self._start_s = (2 * width, 2 * height), fps, start_s
        self._pictures: list[np.ndarray] = []

    @property
    def env_kwargs(self) -> dict[str, Any]:
        """What the environment needs to be filmed."""
        width, height = self._size
        return {"render_mode": "rgb_array", "width": width, "height": height}

    def __call__(self, env: gymnasium.Env, step: int) -> None:
        """Take a picture if it is due."""
        due = round((self._start_s + len(self._pictures) / self._fps) * base_env(env).control_hz)
        if step >= due:
            if not self._pictures:
                self._set_up(env)
            self._pictures.append(_picture(env))

    def _set_up(self, env: gymnasium.Env) -> None:
        visual = cast(Go1Env, env.unwrapped).simulation.model.vis
        visual.quality.offsamples, visual.quality.shadowsize = 0, SHADOW_PIXELS
        visual.global_.offwidth, visual.global_.offheight = self._size

    def frames(self, count: int) -> np.ndarray:
        """The first `count` pictures, uint8, shape (count, height, width, 3); the last one stays if there are fewer."""
        pictures = self._pictures[:count]
        return np.stack([*pictures, *pictures[-1:] * (count - len(pictures))])


def _picture(env: gymnasium.Env) -> np.ndarray:
    """What the environment draws, in half the size in both directions."""
    return halved(cast(np.ndarray, env.render()))  # Gymnasium's annotation leaves open what it is


def halved(picture: np.ndarray) -> np.ndarray:
    """A picture in half the size in both directions, uint8, shape (h, w, 3) of (2 h, 2 w, 3)."""
    height, width, _ = picture.shape
    blocks = picture.reshape(height // 2, 2, width // 2, 2, 3).astype(np.uint16)
    return ((blocks.sum((1, 3)) + 2) // 4).astype(np.uint8)


def tile(frames_by_task: Mapping[str, np.ndarray], columns: int | None = None) -> np.ndarray:
    """Several films side by side, each with its name in the upper left corner; shorter ones hold their last picture.

    Args:
        frames_by_task: name -> film, uint8, shape (n, h, w, 3); all of one h and w.
        columns: of the mosaic; None makes it about square (four films: 2 x 2).

    Returns:
        uint8, shape (longest n, rows * h, columns * w, 3).

    Raises:
        InvalidInputError: if there is no film, or the films do not fit together.
    """
    films = {name: _checked(frames, f"frames of {name!r}") for name, frames in frames_by_task.items()}
    sizes = {film.shape[1:3] for film in films.values()}
    if len(sizes) != 1:
        raise InvalidInputError(f"expected films of one size (height, width), got {sorted(sizes) or 'no film'}")
    columns = math.ceil(math.sqrt(len(films))) if columns is None else columns
    if columns < 1:
        raise InvalidInputError(f"columns must be at least 1, got {columns}")
    (height, width), length = sizes.pop(), max(map(len, films.values()))
    mosaic = np.full((length, math.ceil(len(films) / columns) * height, columns * width, 3), 255, dtype=np.uint8)
    for i, (name, film) in enumerate(films.items()):
        row, column = divmod(i, columns)
        where = (slice(row * height, (row + 1) * height), slice(column * width, (column + 1) * width))
        for j in range(length):
            mosaic[j][where] = _labelled(film[min(j, len(film) - 1)], name)
    return mosaic


def _labelled(picture: np.ndarray, name: str) -> np.ndarray:
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(size=max(10, image.height // 13))
    corner = (image.height // 20, image.height // 24)
    outline = max(1, image.height // 120)
    draw.text(corner, name, (255, 255, 255), font, stroke_width=outline, stroke_fill=(40, 44, 52))
    return np.asarray(image)


def save_gif(frames: np.ndarray, path: str | PathLike[str], fps: float = 25) -> None:
    """Write an endlessly looping GIF; all frames share one palette made from some of them, without dithering.

    The file is complete or not there. GIFs count in hundredths of a second, so 25 and 50 frames per second are exact.

    Args:
        frames: RGB, uint8, shape (n, h, w, 3).
        path: of the file.
        fps: frames per second, 1 ... 50.

    Raises:
        InvalidInputError: if frames or fps are not as described.
    """
    frames = _checked(frames, "frames")
    if not 1 <= fps <= MAX_FPS:
        raise InvalidInputError(f"fps must be from 1 to {MAX_FPS}, got {fps}")
    some = frames[np.unique(np.linspace(0, len(frames) - 1, PALETTE_FRAMES).round().astype(int))]
    palette = Image.fromarray(np.concatenate(some)).quantize(COLORS, method=Image.Quantize.FASTOCTREE)
    images = [Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    how = {"save_all": True, "append_images": images[1:], "duration": 10 * round(100 / fps), "loop": 0}
    write_atomically(path, lambda file: images[0].save(file, format="GIF", optimize=False, **how))


def save_webp(frames: np.ndarray, path: str | PathLike[str], fps: float = 25, quality: int = 50) -> None:
    """Write an endlessly looping WebP: all colors, and a fraction of a GIF's size.

    The file is complete or not there.

    Args:
        frames: RGB, uint8, shape (n, h, w, 3).
        path: of the file.
        fps: frames per second, 1 ... 50.
        quality: of the pictures, 0 ... 100.

    Raises:
        InvalidInputError: if an argument is not as described.
    """
    frames = _checked(frames, "frames")
    if not 1 <= fps <= MAX_FPS:
        raise InvalidInputError(f"fps must be from 1 to {MAX_FPS}, got {fps}")
    quality = integer_in(quality, 0, 100, "quality")
    images = [Image.fromarray(frame) for frame in frames]
    # WebP counts in milliseconds: the ends are rounded, so that rounding does not add up
    ends = [round(1000 * (i + 1) / fps) for i in range(len(images))]
    durations = [end - start for start, end in zip([0, *ends], ends, strict=False)]
    how = {"save_all": True, "append_images": images[1:], "duration": durations, "loop": 0, "quality": quality}
    # each key frame wipes out what coarse pictures have left behind on the ground
    keys = {"kmin": KEY_FRAMES[0], "kmax": KEY_FRAMES[1]}
    write_atomically(path, lambda file: images[0].save(file, format="WEBP", method=WEBP_EFFORT, **how, **keys))


def _checked(frames: Any, label: str) -> np.ndarray:
    frames = np.asarray(frames)
    if frames.dtype != np.uint8 or frames.ndim != 4 or frames.shape[3] != 3 or not frames.size:
        raise InvalidInputError(f"{label} must be uint8 of shape (n > 0, h, w, 3), got {frames.dtype} {frames.shape}")
    return frames
