"""Pictures: their shape, what is drawn into them, and what happens where none can be drawn."""

import copy
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import gymnasium
import mujoco
import numpy as np
import pytest

from go1_mtl_gym import robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.rendering import CONTACT_COLOR, Pace, RenderingError, annotate, why_no_pictures


@pytest.fixture
def env():
    env = Go1Env("trot", render_mode="rgb_array", width=160, height=120)
    env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    yield env
    env.close()


@pytest.mark.gl
def test_picture_is_an_rgb_array_of_the_size_asked_for(env):
    picture = env.render()
    assert picture.shape == (120, 160, 3) and picture.dtype == np.uint8
    assert picture.std() > 5 and len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
    np.testing.assert_array_equal(picture, env.render())


@pytest.mark.gl
def test_pictures_follow_the_robot(env):
    before = env.render()
    for _ in range(10):
        env.step(env.action_map.from_radians(robot.HOME_POSE + 0.3))
    assert (env.render() != before).any()


@pytest.mark.gl
def test_a_command_draws_a_green_arrow(env):
    before = env.render().astype(int)
    snapshot = env.simulation.snapshot()
    env.set_command((0.6, 0.0, 0.0))
    for _ in range(30):
        env.step(env.action_map.from_radians(robot.HOME_POSE))
    env.simulation.restore(snapshot)
    after = env.render().astype(int)
    changed = (after != before).any(axis=2)
    assert 10 < changed.sum() < changed.size / 4
    red, green, blue = (after - before)[changed].mean(axis=0)
    assert green > red and green > blue


@pytest.mark.gl
def test_contacts_draw_discs_under_the_feet_on_the_ground(env):
    for _ in range(20):
        env.step(env.action_map.from_radians(robot.HOME_POSE))
    assert env.state.contacts.all()
    with_contacts = env.render().astype(int)
    touch = [env.simulation.model.sensor(f"{leg}_touch").adr[0] for leg in robot.LEGS]
    env.simulation.data.sensordata[touch] = 0.0
    without = env.render().astype(int)
    changed = (with_contacts != without).any(axis=2)
    assert 5 < changed.sum() < changed.size / 4
    red, _, blue = (with_contacts - without)[changed].mean(axis=0)
    assert red > blue, "the discs are orange"


@pytest.mark.gl
def test_the_camera_tracks_a_robot_far_away(env):
    near = env.render().astype(int)
    env.simulation.data.qpos[0] += 50.0
    env.simulation.step(env.state.q, 1)
    far = env.render().astype(int)
    assert np.abs(far - near).mean() < 25 and far.std() > 5


def test_annotations_stop_at_the_capacity_of_the_scene():
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.5, 0, 0)})
    home = env.action_map.from_radians(robot.HOME_POSE)
    for _ in range(100):
        env.step(home)
    for capacity, expected in ((100, 5), (3, 3), (0, 0)):
        scene = mujoco.MjvScene(env.simulation.model, capacity)
        annotate(scene, env.simulation, env.state)
        assert scene.ngeom == expected, "four discs and the command; the robot stands still"
        if expected:
            np.testing.assert_allclose(scene.geoms[0].rgba, CONTACT_COLOR, atol=1e-6)
            np.testing.assert_allclose(scene.geoms[0].pos[:2], env.simulation.feet_w[0, :2], atol=1e-5)


def test_render_without_a_mode_warns_and_draws_nothing():
    env = Go1Env("trot")
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="without a render_mode"):
        assert env.render() is None
    env.close(), env.close()


@pytest.mark.parametrize("control_hz", [50, 100, 500])
def test_pictures_are_played_at_true_speed(control_hz):
    env = gymnasium.make("Go1Trot-v0", control_hz=control_hz)
    assert env.metadata["render_fps"] == control_hz == copy.deepcopy(env).metadata["render_fps"]
    assert Go1Env.metadata == {"render_modes": ["human", "rgb_array"], "render_fps": 50}


def test_a_window_waits_for_the_time_to_pass():
    now, slept = [10.0], []

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        now[0] += seconds

    pace = Pace(50.0, lambda: now[0], sleep)
    for busy in (0.005, 0.015, 0.050, 0.0):  # the third one takes longer than the period
        now[0] += busy
        pace.wait()
    np.testing.assert_allclose(slept, [0.015, 0.005, 0.02])


@pytest.mark.gl
def test_large_pictures():
    env = Go1Env("trot", render_mode="rgb_array", width=1920, height=1080)
    env.reset(seed=0)
    picture = env.render()
    assert picture.shape == (1080, 1920, 3) and picture.std() > 5
    env.close()


@pytest.mark.gl
def test_another_thread_is_told_why_it_cannot_draw(env):
    env.render()
    for action in (env.render, env.close):
        with ThreadPoolExecutor(1) as pool, pytest.raises(RenderingError, match="thread .* OpenGL context belongs"):
            pool.submit(action).result()
    assert env.render().shape == (120, 160, 3)


@pytest.mark.gl
def test_a_thread_may_draw_its_own_environment():
    def draw() -> np.ndarray:
        env = Go1Env("trot", render_mode="rgb_array", width=64, height=48)
        env.reset(seed=0)
        picture = env.render()
        env.close()
        return picture

    with ThreadPoolExecutor(1) as pool:
        np.testing.assert_array_equal(pool.submit(draw).result(), draw())


_WITHOUT_A_DISPLAY = """
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.rendering import RenderingError
try:
    env = Go1Env("trot", render_mode="{mode}")
    env.reset(seed=0)
    env.render()
except RenderingError as error:
    print("refused:", error)
"""


def refusal(mode: str, gl: str) -> str:
    hidden = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-c", _WITHOUT_A_DISPLAY.format(mode=mode)],
        env=hidden | {"MUJOCO_GL": gl, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    return done.stdout


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems always have a display")
def test_off_screen_without_open_gl_says_what_to_try():
    assert "MUJOCO_GL=egl" in refusal("rgb_array", "disable")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems always have a display")
def test_a_window_without_a_display_says_what_to_do_instead():
    assert "rgb_array" in refusal("human", "egl")


_WITHOUT_A_CHOICE = """
import os, sys
import mujoco
from go1_mtl_gym.env import Go1Env
env = Go1Env("trot", render_mode="rgb_array", width=32, height=32)
env.reset(seed=0)
assert "MUJOCO_GL" not in os.environ, "nothing is chosen before the first picture"
assert env.render().std() > 5
print(os.environ["MUJOCO_GL"])
"""


@pytest.mark.gl
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems always have a display")
def test_the_first_picture_needs_no_display_and_no_environment_variable():
    kept = {
        name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL")
    }
    done = subprocess.run(
        [sys.executable, "-c", _WITHOUT_A_CHOICE],
        env=kept | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.stdout.strip() in ("egl", "osmesa"), done.stderr


def test_a_picture_that_cannot_be_drawn_has_a_reason(monkeypatch):
    def refuse(*_):
        raise RuntimeError("no framebuffer")

    monkeypatch.setattr(mujoco, "Renderer", refuse)
    monkeypatch.setenv("MUJOCO_GL", "egl")
    assert why_no_pictures() == "no OpenGL (MUJOCO_GL=egl): no framebuffer"
