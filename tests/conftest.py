"""Settings for every test: one thread per process, and software OpenGL where it is to be had.

`import mujoco` itself fails when MUJOCO_GL names a backend whose libraries are missing, so a backend is tried out in a
process of its own before any test sees it. Tests that render carry ``@pytest.mark.gl`` and skip where none works.
"""

import os
import subprocess
import sys

import pytest

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("MPLBACKEND", "Agg")

_RENDER = """
import mujoco
model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><geom size="1"/></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 32, 32) as renderer:
    renderer.update_scene(data)
    assert renderer.render().any(), "the picture is black"
"""


def _why_no_gl(backend: str) -> str:
    """Renders one picture in a fresh process; returns the empty string, or the last line of what went wrong."""
    env = {**os.environ, "MUJOCO_GL": backend} if backend else dict(os.environ)
    try:
        done = subprocess.run([sys.executable, "-c", _RENDER], env=env, capture_output=True, text=True, timeout=120)
    except subprocess.TimeoutExpired:
        return "rendering one picture took over 120 s"
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else f"exit status {done.returncode}"


def _choose_gl() -> None:
    """Sets MUJOCO_GL if it is unset, once per run: the answer reaches xdist's workers through the environment."""
    if "GO1_TEST_NO_GL" in os.environ:
        return
    backend = os.environ.get("MUJOCO_GL", "egl" if sys.platform.startswith("linux") else "")
    reason = _why_no_gl(backend)
    os.environ["GO1_TEST_NO_GL"] = f"no OpenGL (MUJOCO_GL={backend or 'unset'}): {reason}" if reason else ""
    if reason:
        os.environ["MUJOCO_GL"] = "disable"
    elif backend:
        os.environ["MUJOCO_GL"] = backend


_choose_gl()


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skips rendering tests, with the reason, where there is no OpenGL."""
    reason = os.environ.get("GO1_TEST_NO_GL")
    if reason and item.get_closest_marker("gl"):
        pytest.skip(reason)
