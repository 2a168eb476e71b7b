"""Films: their shapes and contents, and the GIF that is read back."""

import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from go1_mtl_gym import robot
from go1_mtl_gym.errors import InvalidInputError
from trainers import record_frames, save_gif, save_webp, tile


def film(value: int, count: int = 3, height: int = 48, width: int = 64) -> np.ndarray:
    frames = np.full((count, height, width, 3), value, dtype=np.uint8)
    frames[:, :, :, 0] += np.arange(count, dtype=np.uint8)[:, None, None]
    return frames


class Collapse:
    """An "expert" that folds the legs under the robot's weight, or throws it over."""

    def reset(self, state):
        self.calls = 0

    def action(self, state):
        self.calls += 1
        target = robot.HOME_POSE.copy()
        target[[1, 7]] += 2.0
        return target


def test_tile_places_films_in_a_square_and_holds_the_last_picture():
    mosaic = tile({"trot": film(10), "bound": film(60, count=5), "jump": film(110), "walk": film(160)})
    assert mosaic.shape == (5, 96, 128, 3) and mosaic.dtype == np.uint8
    corners = mosaic[:, [47, 47, 95, 95], [63, 127, 63, 127], 1]
    np.testing.assert_array_equal(corners, np.tile([10, 60, 110, 160], (5, 1)))
    np.testing.assert_array_equal(mosaic[:, 47, 63, 0], [10, 11, 12, 12, 12])
    np.testing.assert_array_equal(mosaic[:, 47, 127, 0], [60, 61, 62, 63, 64])


def test_tile_writes_each_name_in_its_corner():
    mosaic = tile({"trot": film(0), "bound": film(0)})
    assert mosaic.shape == (3, 48, 128, 3)
    for column in (0, 64):
        corner = mosaic[0, :20, column : column + 40]
        assert (corner > 200).all(axis=2).sum() > 10, "white letters"
        assert (mosaic[0, 24:, column : column + 64, 1] == 0).all()
    assert (mosaic[0, :20, :40] != mosaic[0, :20, 64:104]).any()


def test_tile_leaves_a_missing_film_white():
    mosaic = tile({name: film(9) for name in ("trot", "bound", "jump")})
    assert (mosaic[:, 48:, 64:] == 255).all()
    assert tile({"trot": film(9), "bound": film(9)}, columns=1).shape == (3, 96, 64, 3)


@pytest.mark.parametrize(
    ("films", "message"),
    [
        ({}, "no film"),
        ({"trot": film(1), "walk": film(1, width=32)}, "one size"),
        ({"trot": film(1).astype(float)}, "frames of 'trot' must be uint8"),
        ({"trot": film(1)[:0]}, "n > 0"),
    ],
)
def test_tile_refuses_what_does_not_fit_together(films, message):
    with pytest.raises(InvalidInputError, match=message):
        tile(films)


def test_a_gif_reads_back(tmp_path):
    frames = film(30, count=6)
    for i, frame in enumerate(frames):
        frame[10:20, 8 * i : 8 * i + 8] = [250, 140, 25]
    save_gif(frames, tmp_path / "new" / "walk.gif", fps=25)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["walk.gif"], "no temporary file stays"
    with Image.open(tmp_path / "new" / "walk.gif") as gif:
        assert gif.n_frames == 6 and gif.size == (64, 48)
        assert gif.info["loop"] == 0 and gif.info["duration"] == 40
        gif.seek(5)
        again = np.asarray(gif.convert("RGB")).astype(int)
    assert np.abs(again - frames[5]).max() <= 10


def test_a_gif_of_one_frame_is_a_picture(tmp_path):
    save_gif(film(30, count=1), tmp_path / "one.gif")
    with Image.open(tmp_path / "one.gif") as gif:
        assert gif.n_frames == 1


@pytest.mark.parametrize(("fps", "frames"), [(0, film(1)), (60, film(1)), (25, film(1)[0])])
def test_a_gif_of_something_else_is_refused(tmp_path, fps, frames):
    with pytest.raises(InvalidInputError, match="fps must|frames must"):
        save_gif(frames, tmp_path / "x.gif", fps)
    assert not list(tmp_path.iterdir())


def test_a_webp_reads_back_and_its_rounded_durations_add_up(tmp_path):
    frames = film(30, count=6)
    for i, frame in enumerate(frames):
        frame[8:24, 8 * i : 8 * i + 16] = [250, 140, 25]
    save_webp(frames, tmp_path / "new" / "walk.webp", fps=30, quality=90)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["walk.webp"]
    with Image.open(tmp_path / "new" / "walk.webp") as webp:
        assert webp.n_frames == 6 and webp.size == (64, 48) and webp.info["loop"] == 0
        durations = []
        for i in range(6):
            webp.seek(i)
            again = np.asarray(webp.convert("RGB")).astype(int)
            durations.append(webp.info["duration"])
    assert durations == [33, 34, 33, 33, 34, 33]
    assert np.abs(again - frames[5]).mean() < 5


@pytest.mark.parametrize("wrong", [{"fps": 0}, {"fps": 60}, {"quality": 101}, {"quality": "best"}])
def test_a_webp_of_something_else_is_refused(tmp_path, wrong):
    with pytest.raises(InvalidInputError, match="fps must|quality must"):
        save_webp(film(1), tmp_path / "x.webp", **wrong)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "wrong", [{"seconds": 0.0}, {"fps": 0}, {"fps": 51}, {"width": 4}, {"height": 5000}, {"command": (9.0, 0.0, 0.0)}]
)
def test_a_film_with_impossible_settings_is_refused(wrong):
    with pytest.raises(InvalidInputError):
        record_frames("expert", "trot", **({"seconds": 0.1} | wrong))


@pytest.mark.gl
def test_a_film_begins_with_a_stand_and_shows_motion():
    frames = record_frames("expert", "trot", seconds=0.6, fps=10, width=96, height=64, channels=("command",))
    assert frames.shape == (6, 64, 96, 3) and frames.dtype == np.uint8
    moved = np.abs(frames.astype(int) - frames[0]).mean(axis=(1, 2, 3))
    assert (moved[1:] > 0.1).all() and frames.std() > 20
    again = record_frames("expert", "trot", seconds=0.2, fps=10, width=96, height=64)
    np.testing.assert_array_equal(again, frames[:2])


@pytest.mark.gl
def test_after_a_fall_the_last_picture_stays():
    expert = Collapse()
    frames = record_frames(expert, "trot", seconds=3.0, fps=5, width=48, height=32, command=(0.0, 0.0, 0.0))
    assert len(frames) == 15
    assert expert.calls < 130, "it fell before the end"
    np.testing.assert_array_equal(frames[-1], frames[-2])


_NO_OPEN_GL = """
from go1_mtl_gym.rendering import RenderingError
from trainers import record_frames
try:
    record_frames("expert", "trot", seconds=0.1)
except RenderingError as error:
    print("refused:", error)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems always have a display")
def test_without_open_gl_the_error_is_a_rendering_error():
    hidden = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    env = hidden | {"MUJOCO_GL": "disable", "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", _NO_OPEN_GL], env=env, capture_output=True, text=True, timeout=120)
    assert done.stdout.startswith("refused: "), done.stderr
