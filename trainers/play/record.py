"""Films of what is played: MP4 as it comes, GIF and WebP at the end; and pictures of how it ended."""

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from PIL import Image

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.rendering import RenderingError, choose_backend
from go1_mtl_gym.validation import integer_in, one_of
from trainers.evaluation.captions import lay_over
from trainers.evaluation.video import MAX_FPS, SHADOW_PIXELS, halved, save_gif, save_webp
from trainers.play.player import Player
from trainers.play.scene import Ghost, furnish
from trainers.play.status import play_panels
from trainers.utils.files import write_atomically

KINDS = (".mp4", ".gif", ".webp", ".png")
LONGEST_S = 60.0
"""Of a GIF or WebP, whose pictures wait in memory until the end [s]."""
WEBP_QUALITY = 40
MP4_QUALITY = 7
"""From 0 to 10, as ImageIO has it."""


class FilmFile:
    """A film that grows; the file is complete or not there.

    Args:
        path: of the file; its ending says what it becomes, one of `KINDS`.
        fps: pictures per second.
        largest: width and height [pixels] that pictures of a film that `waits` are brought down to, whose memory they
            fill; None leaves them as they come.

    Raises:
        InvalidInputError: if the ending is another, or MP4s cannot be written here.
    """

    def __init__(self, path: str | os.PathLike[str], fps: int = 25, largest: tuple[int, int] | None = None) -> None:
        self.path, self.fps, self._largest = Path(path), integer_in(fps, 1, MAX_FPS, "fps"), largest
        one_of(self.path.suffix.lower(), KINDS, f"ending of the film {str(path)!r}")
        self._kind = self.path.suffix.lower()
        if self._kind == ".mp4":
            _ffmpeg()
        self._pictures: list[np.ndarray] = []
        self._size: tuple[int, int] | None = None
        self._encoder: Any = None
        self.count = 0

    @property
    def is_still(self) -> bool:
        """Whether only the last picture counts."""
        return self._kind == ".png"

    @property
    def waits(self) -> bool:
        """Whether all pictures are kept in memory until the end."""
        return self._kind in (".gif", ".webp")

    @property
    def summary(self) -> str:
        """What there is in the file, in a sentence."""
        if not self.count:
            return f"{self.path} was not written: there was no picture"
        return f"{self.path} is there" if self.is_still else f"{self.path} has {self.count} pictures"

    @property
    def is_full(self) -> bool:
        """Whether no more pictures are taken."""
        return self.waits and self.count >= LONGEST_S * self.fps

    def add(self, picture: np.ndarray) -> None:
        """Take in the next picture, RGB, uint8, shape (h, w, 3); all become as large as the first one."""
        if self.is_full:
            return
        if self._size is None:
            self._size = self._fitting(picture.shape[1], picture.shape[0])
        width, height = self._size
        if picture.shape[0] - height not in (0, 1) or picture.shape[1] - width not in (0, 1):
            picture = np.asarray(Image.fromarray(picture).resize(self._size))  # the window's size was changed
        picture = np.ascontiguousarray(picture[:height, :width])
        self.count += 1
        if self._kind != ".mp4":
            if self.is_still:
                self._pictures.clear()
            self._pictures.append(picture)
            return
        if self._encoder is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._encoder = _ffmpeg().write_frames(
                str(self._unfinished), self._size, fps=self.fps, quality=MP4_QUALITY, macro_block_size=2
            )
            self._encoder.send(None)
        self._encoder.send(picture)

    def _fitting(self, width: int, height: int) -> tuple[int, int]:
        """Width and height of the film [pixels]; encoders want even numbers."""
        shrink = 1.0
        if self._largest is not None and self.waits:
            shrink = min(1.0, self._largest[0] / width, self._largest[1] / height)
        return max(2, int(shrink * width) // 2 * 2), max(2, int(shrink * height) // 2 * 2)

    @property
    def _unfinished(self) -> Path:
        return self.path.with_name(f".{os.getpid()}.unfinished.mp4")

    def close(self) -> None:
        """Write the file; without a picture there is none."""
        if self._encoder is not None:
            self._encoder.close()
            self._encoder = None
            os.replace(self._unfinished, self.path)
        elif self._pictures:
            frames, self._pictures = np.stack(self._pictures), []
            if self.is_still:
                last = Image.fromarray(frames[-1])
                write_atomically(self.path, lambda file: last.save(file, format="PNG", optimize=True))
            elif self._kind == ".gif":
                save_gif(frames, self.path, self.fps)
            else:
                save_webp(frames, self.path, self.fps, WEBP_QUALITY)

    def discard(self) -> None:
        """Forget everything; no file is left."""
        if self._encoder is not None:
            self._encoder.close()
            self._encoder = None
            self._unfinished.unlink(missing_ok=True)
        self._pictures = []


def _ffmpeg() -> Any:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InvalidInputError(
            "MP4s are written by imageio-ffmpeg, which is not installed: pip install imageio-ffmpeg, or name a "
            ".webp or .gif file"
        ) from None
    return imageio_ffmpeg


class Recording:
    """Takes a picture of a player whenever one is due.

    Args:
        player: that is filmed; its `played_s` is the film's time.
        film: where the pictures go, but for one of which only the last counts.
        picture: what makes one.
    """

    def __init__(self, player: Player, film: FilmFile, picture: Callable[[], np.ndarray]) -> None:
        self._player, self._film, self._picture = player, film, picture

    def __call__(self) -> None:
        """Take a picture if one is due; where the player went on for longer, the same one several times."""
        if self._film.is_still:
            return
        due = math.floor(self._player.played_s * self._film.fps + 1e-6) + 1 - self._film.count
        if due > 0 and not self._film.is_full:
            picture = self._picture()
            for _ in range(due):
                self._film.add(picture)


class OffScreen:
    """Pictures of a player without a window, as the window shows them.

    They are drawn at twice the size and averaged, as those of `trainers.evaluation.video.Film`.

    Args:
        player: that is drawn.
        width: of a picture [pixels].
        height: likewise.

    Raises:
        InvalidInputError: if a size is none.
        RenderingError: if no picture can be drawn on this machine.
    """

    def __init__(self, player: Player, width: int, height: int) -> None:
        self._player = player
        self._size = integer_in(width, 64, 2048, "width [pixels]"), integer_in(height, 64, 2048, "height [pixels]")
        model = player.session.go1.simulation.model
        model.vis.quality.offsamples, model.vis.quality.shadowsize = 0, SHADOW_PIXELS
        model.vis.global_.offwidth, model.vis.global_.offheight = 2 * width, 2 * height
        self._ghost: Ghost | None = None
        try:
            choose_backend()
            self._renderer = mujoco.Renderer(model, 2 * height, 2 * width)
        except Exception as error:  # the type differs from one OpenGL backend to the next
            raise RenderingError(
                f"cannot draw off screen: {error}; try the environment variable MUJOCO_GL=egl (or osmesa)"
            ) from error

    def picture(self) -> np.ndarray:
        """RGB, uint8, shape (height, width, 3); nothing is said of keys, which nobody has."""
        player, renderer = self._player, self._renderer
        if player.ghost and self._ghost is None:
            self._ghost = Ghost(player.session)
        renderer.update_scene(player.session.go1.simulation.data, camera=player.camera.mjv)
        furnish(renderer.scene, player.session, self._ghost if player.ghost else None)
        return lay_over(halved(renderer.render()), play_panels(self._size, player, player.title))

    def close(self) -> None:
        """Free the OpenGL context."""
        self._renderer.close()


def record(
    player: Player, film: FilmFile, width: int, height: int, progress: Callable[[int], object] = lambda steps: None
) -> None:
    """Film a player until it is over, as fast as the machine can.

    Args:
        player: whose session ends by itself.
        film: is closed in the end.
        width: of a picture [pixels].
        height: likewise.
        progress: is told the number of steps that were made.

    Raises:
        go1_mtl_gym.rendering.RenderingError: if no picture can be drawn on this machine.
    """
    off_screen = OffScreen(player, width, height)
    recording = Recording(player, film, off_screen.picture)
    try:
        recording()
        while not (player.over or film.is_full):
            player.step()
            recording()
            progress(player.session.steps)
        if film.is_still:
            film.add(off_screen.picture())
        film.close()
    finally:
        film.discard()
        off_screen.close()
