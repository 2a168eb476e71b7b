"""What shows the robot: which of MuJoCo's back ends draws here, whether the chosen one does, and pages in a browser."""

import os
import sys
from collections.abc import Iterator
from importlib.util import find_spec

from trainers.cli.checks.finding import FAILED, NOTE, OK, WARNING, Finding, tried
from trainers.play.options import WEB_PACKAGES

BACKENDS = {"egl": "off screen, on a GPU or in software", "osmesa": "off screen, in software", "glfw": "in a window"}
"""Value of MUJOCO_GL -> where it draws."""
_DRAW = """
import json
from go1_mtl_gym.rendering import why_no_pictures
print(json.dumps({"reason": why_no_pictures()}))
"""
_IMPORT = "import mujoco; print('{}')"
INSTALL = "sudo apt-get install libegl1 libgl1 libgl1-mesa-dri libosmesa6 (Debian, Ubuntu)"


def check() -> Iterator[Finding]:
    """The user's own setting first: if MuJoCo cannot even be imported with it, nothing works."""
    chosen = os.environ.get("MUJOCO_GL", "")
    setting = f"MUJOCO_GL={chosen}" if chosen else "MUJOCO_GL is not set"
    _, broken = tried(_IMPORT)
    if broken and chosen:
        _, otherwise = tried(_IMPORT, MUJOCO_GL=None)
        if not otherwise:
            yield Finding("OpenGL", FAILED, f"{setting}, and MuJoCo cannot be imported: {broken}", _instead())
            return
    if broken:
        remedy = 'python -m pip install --force-reinstall "mujoco>=3.3.4"'
        yield Finding("MuJoCo", FAILED, f"cannot be imported: {broken}", remedy)
        return
    reasons = {name: why_not(name) for name in BACKENDS} if sys.platform.startswith("linux") else {}
    if nothing := why_not(None):
        yield Finding(
            "OpenGL",
            WARNING,
            f"no pictures and films ({setting}): {nothing}",
            _remedy([name for name, reason in reasons.items() if not reason]),
        )
    else:
        yield Finding("OpenGL", OK, f"pictures and films can be drawn ({setting})")
    for name, reason in reasons.items():
        text = f"{name} does not draw: {reason}" if reason else f"{name} draws {BACKENDS[name]}"
        yield Finding("OpenGL", NOTE if reason else OK, text)
    if not all(find_spec(name) for name in WEB_PACKAGES):
        yield Finding("browser", NOTE, "no `play --web`: viser and trimesh are not both here", 'pip install ".[web]"')


def why_not(backend: str | None) -> str:
    """Why a back end does not draw; "" if it does.

    Args:
        backend: of `BACKENDS`; None for what MuJoCo takes with the present environment.
    """
    answer, reason = tried(_DRAW) if backend is None else tried(_DRAW, MUJOCO_GL=backend)
    return reason or " ".join(answer["reason"].split())


def _instead() -> str:
    working = [name for name in ("egl", "osmesa") if not why_not(name)]
    return (
        f"export MUJOCO_GL={working[0]}" if working else "unset MUJOCO_GL, or MUJOCO_GL=disable to do without pictures"
    )


def _remedy(working: list[str]) -> str:
    off_screen = [name for name in working if name != "glfw"]
    return f"export MUJOCO_GL={off_screen[0]}" if off_screen else f"{INSTALL}; all but pictures works without"
