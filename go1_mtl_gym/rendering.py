"""Pictures of the robot, with its foot contacts and its command drawn in: off screen or in a window."""

import ctypes.util
import importlib
import os
import sys
import threading
import time
from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from go1_mtl_gym.errors import Go1Error
from go1_mtl_gym.robot import FOOT_RADIUS
from go1_mtl_gym.rotations import yaw_matrix
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.sim.simulation import Simulation

CAMERA = "track"
COMMAND_COLOR = (0.15, 0.75, 0.30, 0.9)
VELOCITY_COLOR = (0.20, 0.45, 0.95, 0.9)
CONTACT_COLOR = (0.98, 0.55, 0.10, 0.8)
ARROW_S = 0.6
"""Length of an arrow per speed [m per m/s]."""


class RenderingError(Go1Error, RuntimeError):
    """No picture can be drawn on this machine."""


def choose_backend() -> None:
    """On Linux without a display, let MuJoCo draw by EGL, or by OSMesa where only that is installed.

    MuJoCo reads the environment variable MUJOCO_GL once, when it is imported, and takes GLFW if it is not set, which
    needs a display. So the module that reads it is loaded again here, before the first picture. A choice that the user
    has made stays, and child processes inherit ours.
    """
    if "MUJOCO_GL" in os.environ or has_display():
        return
    only_osmesa = ctypes.util.find_library("OSMesa") and not ctypes.util.find_library("EGL")
    os.environ["MUJOCO_GL"] = "osmesa" if only_osmesa else "egl"
    try:
        importlib.reload(sys.modules[mujoco.Renderer.__module__].gl_context)
    except Exception:  # no such library; child processes would fail to import MuJoCo
        del os.environ["MUJOCO_GL"]
        raise


def has_display() -> bool:
    """Whether there is a window system: announced as X11 and Wayland do on Linux, and always on other systems."""
    announced = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return bool(announced) or not sys.platform.startswith("linux")


def why_no_pictures() -> str:
    """Draw one small picture off screen; the empty string, or what went wrong."""
    try:
        choose_backend()
        model = mujoco.MjModel.from_xml_string("<mujoco/>")
        with mujoco.Renderer(model, 16, 16) as renderer:
            renderer.render()
    except Exception as error:  # the type differs from one OpenGL backend to the next
        return f"no OpenGL (MUJOCO_GL={os.environ.get('MUJOCO_GL', 'unset')}): {error}"
    return ""


def annotate(scene: mujoco.MjvScene, simulation: Simulation, state: RobotState) -> None:
    """Add to a scene: a disc under each foot on the ground, the command (green) and the velocity (blue) as arrows."""
    for foot, contact in zip(simulation.feet_w, state.contacts, strict=True):
        if contact:
            size = [2.2 * FOOT_RADIUS, 2.2 * FOOT_RADIUS, 0.002]
            _add(scene, mujoco.mjtGeom.mjGEOM_ELLIPSOID, size, [*foot[:2], 0.003], CONTACT_COLOR)
    turn = yaw_matrix(state.rpy[2])
    above = state.position_w + [0.0, 0.0, 0.22]
    for velocity, color, lift in (
        (state.command, COMMAND_COLOR, 0.03),
        (state.base_velocity, VELOCITY_COLOR, 0.0),
    ):
        tip = above + np.append(turn @ velocity[:2] * ARROW_S, lift)
        start = above + [0.0, 0.0, lift]
        if np.linalg.norm(tip - start) > 0.02:
            geom = _add(scene, mujoco.mjtGeom.mjGEOM_ARROW, [0.0] * 3, [0.0] * 3, color)
            if geom is not None:
                mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_ARROW, 0.012, start, tip)


def _add(
    scene: mujoco.MjvScene, kind: int, size: Sequence[float], position: Sequence[float], color: Sequence[float]
) -> mujoco.MjvGeom | None:
    if scene.ngeom >= scene.maxgeom:
        return None
    geom = scene.geoms[scene.ngeom]
    scene.ngeom += 1
    mujoco.mjv_initGeom(geom, kind, np.array(size), np.array(position), np.eye(3).ravel(), np.array(color, np.float32))
    return geom


class Camera:
    """Off-screen pictures from the tracking camera.

    An OpenGL context belongs to the thread that made it: the first picture decides which thread draws them all.

    Args:
        simulation: what to look at; the off-screen buffer of its model is made large enough.
        width: of the picture [pixels].
        height: of the picture [pixels].
        fps: not used; whoever plays the pictures decides.

    Raises:
        RenderingError: if no OpenGL context can be had.
    """

    def __init__(self, simulation: Simulation, width: int, height: int, fps: float) -> None:
        """Open an OpenGL context."""
        self._simulation = simulation
        self._thread = threading.get_ident()
        buffer = simulation.model.vis.global_
        buffer.offwidth, buffer.offheight = max(buffer.offwidth, width), max(buffer.offheight, height)
        try:
            choose_backend()
            self._renderer = mujoco.Renderer(simulation.model, height, width)
        except Exception as error:  # the type differs from one OpenGL backend to the next
            raise RenderingError(
                f"cannot draw off screen: {error}; try the environment variable MUJOCO_GL=egl (or osmesa)"
            ) from error

    def draw(self, state: RobotState) -> np.ndarray:
        """RGB array, uint8, shape (height, width, 3).

        Raises:
            RenderingError: in another thread than that of the first picture.
        """
        self._check_thread("draw")
        self._renderer.update_scene(self._simulation.data, camera=CAMERA)
        annotate(self._renderer.scene, self._simulation, state)
        return self._renderer.render()

    def close(self) -> None:
        """Free the OpenGL context.

        Raises:
            RenderingError: in another thread than that of the first picture.
        """
        self._check_thread("close")
        self._renderer.close()

    def _check_thread(self, action: str) -> None:
        if threading.get_ident() != self._thread:
            raise RenderingError(
                f"cannot {action} in the thread {threading.current_thread().name!r}: the OpenGL context belongs to the "
                "thread that drew the first picture; draw and close there, or give each thread its own environment"
            )


class Pace:
    """Lets things happen at most so often.

    Args:
        hz: how often per second.
        clock: the time [s].
        sleep: lets seconds pass.
    """

    def __init__(
        self,
        hz: float,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Begin now."""
        self._period, self._clock, self._sleep = 1.0 / hz, clock, sleep
        self._due = clock()

    def wait(self) -> None:
        """Let the rest of the period pass; one that took too long is not made up for."""
        now = self._clock()
        self._due = max(self._due + self._period, now)
        if self._due > now:
            self._sleep(self._due - now)


class Viewer:
    """An interactive window.

    Args:
        simulation: what to look at.
        width: not used; the window can be resized.
        height: not used, likewise.
        fps: how many states are shown per second; a faster simulation waits.

    Raises:
        RenderingError: if no window can be opened.
    """

    def __init__(self, simulation: Simulation, width: int, height: int, fps: float) -> None:
        """Open the window."""
        # without a display GLFW ends the whole process instead of raising
        if not has_display():
            raise RenderingError('cannot open a window: there is no display; use render_mode="rgb_array"')
        import mujoco.viewer

        self._simulation = simulation
        try:
            self._window = mujoco.viewer.launch_passive(
                simulation.model, simulation.data, show_left_ui=False, show_right_ui=False
            )
        except Exception as error:  # GLFW and MuJoCo raise different types
            raise RenderingError(f'cannot open a window: {error}; use render_mode="rgb_array"') from error
        self._pace = Pace(fps)
        self._window.cam.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._window.cam.fixedcamid = simulation.model.camera(CAMERA).id

    def draw(self, state: RobotState) -> None:
        """Show the present state."""
        with self._window.lock():
            self._window.user_scn.ngeom = 0
            annotate(self._window.user_scn, self._simulation, state)
        self._window.sync()
        self._pace.wait()

    def close(self) -> None:
        """Close the window."""
        self._window.close()
