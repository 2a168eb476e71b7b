"""Choosing an OpenGL for off-screen pictures before MuJoCo is imported, which reads the choice once."""

import os
import subprocess
import sys

ANSWER = "GO1_NO_GL"
"""Environment variable that holds `choose_gl`'s answer."""
_RENDER = """
import mujoco
model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><geom size="1"/></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 32, 32) as renderer:
    renderer.update_scene(data)
    assert renderer.render().any(), "the picture is black"
"""


def why_no_gl(backend: str) -> str:
    """Render one picture in a fresh process with MUJOCO_GL set to `backend` (left alone if empty).

    Returns:
        The empty string, or the last line of what went wrong.
    """
    env = {**os.environ, "MUJOCO_GL": backend} if backend else dict(os.environ)
    try:
        done = subprocess.run([sys.executable, "-c", _RENDER], env=env, capture_output=True, text=True, timeout=120)
    except subprocess.TimeoutExpired:
        return "rendering one picture took over 120 s"
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else f"exit status {done.returncode}"


def choose_gl() -> str:
    """Set MUJOCO_GL for this process and its children: as it is, or EGL on Linux, or "disable" if nothing renders.

    Importing MuJoCo fails when MUJOCO_GL names a backend whose libraries are missing, so it is tried out first, and
    only once: the answer reaches child processes through the environment.

    Returns:
        The empty string, or why no picture can be drawn.
    """
    if ANSWER in os.environ:
        return os.environ[ANSWER]
    backend = os.environ.get("MUJOCO_GL", "egl" if sys.platform.startswith("linux") else "")
    reason = why_no_gl(backend)
    if reason or backend:
        os.environ["MUJOCO_GL"] = "disable" if reason else backend
    os.environ[ANSWER] = f"no OpenGL (MUJOCO_GL={backend or 'unset'}): {reason}" if reason else ""
    return os.environ[ANSWER]
