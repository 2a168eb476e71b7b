"""The command line, films, and what is refused in a sentence."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import trainers
from go1_mtl_gym.errors import InvalidInputError
from trainers.cli.program import run
from trainers.play.player import Player
from trainers.play.record import FilmFile

SCRIPT = {"seconds": 0.4, "moves": [[0.0, "trot"], [0.1, "walk", [0.3, 0.0, 0.0]]]}


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "script.json"
    path.write_text(json.dumps(SCRIPT))
    return str(path)


def picture(value: int, width: int = 64, height: int = 48) -> np.ndarray:
    return np.full((height, width, 3), value, np.uint8)


@pytest.mark.parametrize("kind", ["gif", "webp", "mp4"])
def test_a_film_grows_and_is_whole_or_not_there(tmp_path, kind):
    if kind == "mp4":
        pytest.importorskip("imageio_ffmpeg")
    path = tmp_path / "new" / f"x.{kind}"
    film = FilmFile(path, fps=10)
    for value in (0, 50, 100, 150):
        film.add(picture(value))
    film.add(picture(250, 131, 97))  # the window's size was changed
    assert film.count == 5 and not path.exists()
    film.close()
    film.discard()
    assert [each.name for each in path.parent.iterdir()] == [path.name]
    if kind == "mp4":
        import imageio_ffmpeg

        assert imageio_ffmpeg.count_frames_and_secs(str(path)) == (5, pytest.approx(0.5))
    else:
        with Image.open(path) as image:
            assert image.size == (64, 48) and image.n_frames == 5
    film = FilmFile(tmp_path / f"y.{kind}")
    film.add(picture(0))
    film.discard()
    film.close()
    assert not list(tmp_path.glob("*y.*"))


def test_a_film_that_waits_in_memory_is_full_after_a_minute(tmp_path):
    film = FilmFile(tmp_path / "x.gif", fps=1)
    for _ in range(70):
        film.add(picture(1, 16, 16))
    assert film.is_full and film.count == 60


def test_films_of_other_kinds_are_refused(tmp_path):
    with pytest.raises(InvalidInputError, match=r"'.mp4', '.gif', '.webp', '.png'; got '.avi'"):
        FilmFile(tmp_path / "x.avi")


def test_mp4_without_its_library_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InvalidInputError, match="pip install imageio-ffmpeg"):
        FilmFile(tmp_path / "x.mp4")


@pytest.mark.gl
def test_a_script_is_filmed_without_a_window(script, tmp_path, capsys):
    film = tmp_path / "x.gif"
    command = ["play", "--script", script, "--record", str(film), "--size", "128", "72", "--fps", "10"]
    assert run(command) == 0
    assert f"{film} has 5 pictures" in capsys.readouterr().out
    with Image.open(film) as image:
        assert image.size == (128, 72) and image.n_frames == 5


@pytest.mark.gl
def test_a_picture_of_the_end_is_one_of_the_film(script, tmp_path, capsys):
    how = ["--size", "128", "72", "--fps", "10"]
    assert run(["play", "--script", script, "--record", str(tmp_path / "x.png"), *how]) == 0
    assert f"{tmp_path / 'x.png'} is there" in capsys.readouterr().out
    assert run(["play", "--script", script, "--record", str(tmp_path / "x.webp"), *how]) == 0
    with Image.open(tmp_path / "x.png") as last, Image.open(tmp_path / "x.webp") as film:
        film.seek(4)
        difference = np.asarray(last.convert("RGB")).astype(int) - np.asarray(film.convert("RGB"))
    assert np.abs(difference).mean() < 6


@pytest.mark.gl
def test_an_episode_of_a_certificate_is_filmed(tmp_path, capsys):
    out = tmp_path / "certificate"
    trainers.certify("clocked", out, tasks=("walk",), conditions=("drawn",), episodes=1, seconds=0.2)
    film = tmp_path / "x.webp"
    asked = ["play", "--replay", str(out), "--episode", "drawn/walk/0", "--size", "96", "64", "--fps", "10"]
    assert run([*asked, "--record", str(film)]) == 0
    with Image.open(film) as image:
        assert image.n_frames == 3
    assert run(["play", "--replay", str(out), "--episode", "drawn/walk/9"]) == 2
    assert "number of an episode of drawn/walk" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--policy", "nothing.zip"], "no policy at nothing.zip"),
        (["nothing.zip"], "no policy at nothing.zip"),
        (["expret"], "no policy at expret: there is no such file; did you mean 'expert'?"),
        (["--task", "hop"], "gait must be one of 'trot'"),
        (["--script", "nothing.json"], "is no script"),
        (["--replay", "nothing.json"], "belong together"),
        (["--episode", "operator/trot/1"], "belong together"),
        (["--replay", "nothing.json", "--episode", "operator/trot/1"], "is no certificate"),
        (["--record", "x.avi"], "ending of the film"),
        (["--script", "a.json", "--replay", "b", "--episode", "c/d/1"], "one thing can drive"),
        (["--script", "a.json", "--task", "trot"], "--script says everything; beside it came --task"),
        (["--script", "a.json", "--save-script", "b.json"], "beside it came --save-script"),
        (["--seed", "-1"], "seed"),
        (["phase_free", "--policy", "clocked"], "one policy can drive: 'phase_free' came, and --policy as well"),
        (["--port", "70000"], "port must be an integer from 0 to 65535"),
        (["--web", "--script", "a.json", "--record", "b.gif"], "give --record or --web, got both"),
        (["--size", "0", "90"], "width of the picture [pixels] must be an integer from 1"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(options, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["play", *options]) == 2
    error = capsys.readouterr().err
    assert message in error and error.startswith("error: ") and error.count("\n") == 1


def test_without_a_display_nothing_that_hands_would_do_is_left_out_in_silence(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("trainers.play.program.has_display", lambda: False)
    for option in (["--task", "jump"], ["--save-script", str(tmp_path / "x.json")]):
        assert run(["play", "--record", str(tmp_path / "x.png"), *option]) == 2
        assert f"beside it came {option[0]}" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_certificate_of_an_older_policy_of_the_package_is_not_replayed_with_this_one(tmp_path, capsys):
    trainers.certify("clocked", tmp_path, tasks=("walk",), conditions=("drawn",), episodes=1, seconds=0.1)
    file = tmp_path / "certificate.json"
    values = json.loads(file.read_text())
    file.write_text(json.dumps(values | {"policy": {"name": "clocked", "sha256": "0" * 64}}))
    asked = ["play", "--replay", str(tmp_path), "--episode", "drawn/walk/0", "--record", str(tmp_path / "x.png")]
    assert run(asked) == 2
    assert "another clocked than this package's: --policy FILE" in capsys.readouterr().err
    assert not (tmp_path / "x.png").exists()


class Unplugged:
    """A surface on which somebody drives half a second and presses Ctrl-C."""

    largest_hz = 1000.0

    def __init__(self, player, *args):
        self.player = player
        self.link = "http://127.0.0.1:1"

    def poll(self):
        if self.player.session.steps >= 25:
            raise KeyboardInterrupt
        self.player.hands.move_stick((1.0, 0.0, 0.0))
        self.player.session.step()
        return True

    def draw(self, notice=None):
        pass

    def picture(self):
        return picture(self.player.session.steps % 200, 1280, 720)

    def close(self):
        pass


class UnpluggedWindow(Unplugged):
    ends_by_interrupt = False


class UnpluggedPage(Unplugged):
    ends_by_interrupt = True


@pytest.mark.parametrize(("options", "status"), [([], 130), (["--web"], 0)])
def test_what_was_driven_and_filmed_is_kept_when_interrupted(tmp_path, capsys, monkeypatch, options, status):
    monkeypatch.setattr("trainers.play.window.Window", UnpluggedWindow)
    monkeypatch.setattr("trainers.play.browser.surface.Browser", UnpluggedPage)
    monkeypatch.setattr("trainers.play.program.has_display", lambda: True)
    monkeypatch.setattr("trainers.play.surfaces.has_display", lambda: True)
    monkeypatch.setattr(Player, "advance", lambda player, seconds: None)
    tape, film = tmp_path / "tape.json", tmp_path / "film.gif"
    assert run(["play", "--save-script", str(tape), "--record", str(film), *options]) == status
    script = trainers.Script.read(tape)
    assert script.seconds == 0.5 and script.moves[0].command[0] > 0.5
    with Image.open(film) as image:
        assert image.size == (640, 360)
    assert f"{tape} has what you did" in capsys.readouterr().out


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems always have a display")
@pytest.mark.parametrize(
    ("display", "options", "messages"),
    [
        (None, [], ("there is no display", "the extra `web`")),
        (None, ["--web"], ("error: a page in a browser needs viser", "the extra `web`")),
        (":9999", [], ("cannot open a window",)),
    ],
)
def test_where_nothing_can_be_shown_the_sentence_says_what_to_do(display, options, messages):
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment |= {"PYTHONPATH": os.pathsep.join(sys.path)} | ({} if display is None else {"DISPLAY": display})
    code = (
        "import sys; sys.modules['viser'] = None\n"
        f"from trainers.cli.program import run; sys.exit(run({['play', *options]}))"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert all(message in done.stderr for message in (*messages, "--record FILE.webp"))


def test_a_student_drives_without_what_only_training_needs():
    heavy = ("scipy.stats", "torch._dynamo", "pinocchio", "osqp")
    code = (
        "import sys, trainers.play.program as program\n"
        "program.opened('clocked')\n"
        f"print([name for name in {heavy} if name in sys.modules])"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and done.stdout == "[]\n", done.stderr
