"""The window: a robot in a player's hands."""

import time
import warnings
from typing import Any

import mujoco
import numpy as np
from OpenGL import GL

from go1_mtl_gym.rendering import RenderingError, has_display
from trainers.evaluation.captions import Panel
from trainers.play.controls import Controls
from trainers.play.gamepad import Gamepad
from trainers.play.player import Player
from trainers.play.scene import Ghost, furnish
from trainers.play.status import button_at, play_panels

TITLE = "go1-mtl-gym"
SAMPLES = 4
"""Of each pixel, where the machine draws fast enough."""
SLOW_PICTURE_S = 0.04
"""A picture that takes longer is drawn without shadows, and without samples [s]."""
TRIAL_PICTURES = 3
LARGEST_HZ = 60.0
"""Pictures per second where the screen does not say when it is ready."""
CAPTIONS_HZ = 15.0
"""How often numbers change; nobody reads faster, and letters take time to draw."""
CAPACITY = 2000
"""Geoms of the scene."""
NO_WINDOW = "add --web to drive it in a browser, or --record FILE.webp to film it"
CLICK_PIXELS = 4
"""A button of the mouse that moved less than this was not dragged."""


class Window:
    """A window of GLFW's, in which MuJoCo draws.

    MuJoCo's own passive viewer tells of keys that go down and not of those that are let go, so it cannot be held like a
    game's.

    Args:
        player: that is shown.
        width: of the window [points].
        height: likewise.

    Attributes:
        controls: what keys and mouse reach.
        largest_hz: pictures per second, at most.
        ends_by_interrupt: no: it is closed.

    Raises:
        RenderingError: if no window can be opened.
    """

    largest_hz = LARGEST_HZ
    ends_by_interrupt = False

    def __init__(self, player: Player, width: int = 1280, height: int = 720) -> None:
        self._player, self.controls = player, Controls(player)
        self._glfw = _started_glfw()
        self._gamepad = Gamepad(self.controls, self._glfw)
        self._dragged = 0.0
        self._pointer = (0.0, 0.0)
        self._ghost: Ghost | None = None
        self._panels: list[Panel] = []
        self._panels_s = -np.inf
        self._window: Any = None
        try:
            self._open(width, height, SAMPLES)
            if self._is_slow():
                self._destroy()
                self._open(width, height, 0)
                self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        except BaseException:
            self.close()
            raise

    # -- Opening and closing -------------------------------------------------------------------------------------------

    def _open(self, width: int, height: int, samples: int) -> None:
        glfw, model = self._glfw, self._player.session.go1.simulation.model
        glfw.window_hint(glfw.SAMPLES, samples)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the error is told below
            self._window = glfw.create_window(width, height, TITLE, None, None)
        if not self._window:
            raise RenderingError(f"cannot open a window: {_last_error(glfw)}; {NO_WINDOW}")
        glfw.make_context_current(self._window)
        glfw.swap_interval(1)
        try:
            self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        except mujoco.FatalError as error:
            raise RenderingError(f"cannot draw in a window: {error}; {NO_WINDOW}") from error
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_WINDOW, self._context)
        self._scene = mujoco.MjvScene(model, CAPACITY)
        self._option, self._perturbation = mujoco.MjvOption(), mujoco.MjvPerturb()
        glfw.set_key_callback(self._window, self._on_key)
        glfw.set_window_focus_callback(self._window, self._on_focus)
        glfw.set_mouse_button_callback(self._window, self._on_button)
        glfw.set_cursor_pos_callback(self._window, self._on_move)
        glfw.set_scroll_callback(self._window, self._on_scroll)

    def _is_slow(self) -> bool:
        """Whether this machine needs long for a fine picture; the first one also loads what the others use."""
        self.draw()
        began = time.perf_counter()
        for _ in range(TRIAL_PICTURES):
            self.draw()
        mujoco.mjr_finish()
        return time.perf_counter() - began > TRIAL_PICTURES * SLOW_PICTURE_S

    def _destroy(self) -> None:
        if self._window:
            self._context.free()
            self._glfw.destroy_window(self._window)
            self._window = None

    def close(self) -> None:
        """Close the window; may be called twice."""
        self._destroy()
        self._glfw.terminate()

    # -- Drawing -------------------------------------------------------------------------------------------------------

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture [pixels]; on dense screens more than the window's points."""
        width, height = self._glfw.get_framebuffer_size(self._window)
        return width, height

    def draw(self, notice: str | None = None) -> None:
        """Show the present state.

        Args:
            notice: a line of text, in place of the one that would stand there.
        """
        self._paint(notice)
        self._glfw.swap_buffers(self._window)

    def picture(self) -> np.ndarray:
        """What `draw` shows; RGB, uint8, shape (height, width, 3)."""
        self._paint()
        width, height = self.size
        pixels = np.empty((height, width, 3), np.uint8)
        mujoco.mjr_readPixels(pixels, None, mujoco.MjrRect(0, 0, width, height), self._context)
        return pixels[::-1]  # OpenGL's rows run upward

    def _paint(self, notice: str | None = None) -> None:
        """Draw into the buffer that is shown next."""
        width, height = self.size
        if not width or not height:  # it was made an icon
            return
        session = self._player.session
        if self._player.ghost and self._ghost is None:
            self._ghost = Ghost(session)
        simulation, everything = session.go1.simulation, mujoco.mjtCatBit.mjCAT_ALL
        camera = self._player.camera.mjv
        mujoco.mjv_updateScene(
            simulation.model, simulation.data, self._option, self._perturbation, camera, everything, self._scene
        )
        furnish(self._scene, session, self._ghost if self._player.ghost else None)
        mujoco.mjr_render(mujoco.MjrRect(0, 0, width, height), self._scene, self._context)
        self._write(width, height, notice)

    def _write(self, width: int, height: int, notice: str | None) -> None:
        """Lay the panels over what was drawn."""
        now = time.perf_counter()
        if notice or now - self._panels_s >= 1.0 / CAPTIONS_HZ:
            panels = play_panels((width, height), self._player, notice)
            self._panels, self._panels_s = [panel.within(width, height) for panel in panels], now
        # MuJoCo's own way to draw pixels does not mix them with what is beneath; its rectangle leaves a state that can
        mujoco.mjr_rectangle(mujoco.MjrRect(0, 0, 1, 1), 0.0, 0.0, 0.0, 0.0)
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendFunc(GL.GL_SRC_ALPHA, GL.GL_ONE_MINUS_SRC_ALPHA)
        for left, top, pixels in self._panels:
            rows, columns, _ = pixels.shape
            GL.glWindowPos2i(left, height - top - rows)
            upward = np.ascontiguousarray(pixels[::-1])
            GL.glDrawPixels(columns, rows, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE, upward)
        GL.glDisable(GL.GL_BLEND)

    # -- Keys and mouse ------------------------------------------------------------------------------------------------

    def _on_key(self, window: Any, key: int, scancode: int, action: int, mods: int) -> None:
        name = _key_names(self._glfw).get(key)
        if name is not None and action in (self._glfw.PRESS, self._glfw.RELEASE):  # no repetitions
            self.controls.key(name, action == self._glfw.PRESS)

    def _on_focus(self, window: Any, focused: int) -> None:
        if not focused:
            self.controls.let_go()

    def _on_button(self, window: Any, button: int, action: int, mods: int) -> None:
        if action == self._glfw.PRESS:
            self._dragged = 0.0
        elif button == self._glfw.MOUSE_BUTTON_LEFT and self._dragged < CLICK_PIXELS:
            density = self.size[1] / self._glfw.get_window_size(window)[1]
            x, y = (density * each for each in self._pointer)
            task = button_at(self.size, self._player.session.go1.tasks, x, y)
            if task is not None:
                self.controls.choose(task)

    def _on_move(self, window: Any, x: float, y: float) -> None:
        glfw, height = self._glfw, self._glfw.get_window_size(window)[1]
        right, down = (x - self._pointer[0]) / height, (y - self._pointer[1]) / height
        self._pointer, camera = (x, y), self._player.camera
        self._dragged += (abs(right) + abs(down)) * height
        pressed = {
            button: glfw.get_mouse_button(window, button) == glfw.PRESS
            for button in (glfw.MOUSE_BUTTON_LEFT, glfw.MOUSE_BUTTON_RIGHT, glfw.MOUSE_BUTTON_MIDDLE)
        }
        if pressed[glfw.MOUSE_BUTTON_LEFT]:
            camera.rotate(right, down)
        elif pressed[glfw.MOUSE_BUTTON_RIGHT]:
            camera.pan(right, down)
        elif pressed[glfw.MOUSE_BUTTON_MIDDLE]:
            camera.zoom(-2.0 * down)

    def _on_scroll(self, window: Any, right: float, up: float) -> None:
        self._player.camera.zoom(0.1 * up)

    def poll(self) -> bool:
        """Take in keys, mouse and gamepad; False once the window was closed, or the player has had enough."""
        self._glfw.poll_events()
        self._gamepad.poll()
        return not (self._glfw.window_should_close(self._window) or self.controls.quit)


def _started_glfw() -> Any:
    """GLFW, ready to open windows.

    Raises:
        RenderingError: if there is no screen to open them on.
    """
    # without a display GLFW's functions end the process on some systems
    if not has_display():
        raise RenderingError(f"cannot open a window: there is no display; {NO_WINDOW}")
    try:
        import glfw
    except ImportError as error:
        raise RenderingError(f"cannot open a window: {error}; {NO_WINDOW}") from error
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the error is told below
        if not glfw.init():
            raise RenderingError(f"cannot open a window: {_last_error(glfw)}; {NO_WINDOW}")
    return glfw


def _last_error(glfw: Any) -> str:
    code, message = glfw.get_error()
    return message.decode(errors="replace") if isinstance(message, bytes) else str(message or code)


def _key_names(glfw: Any) -> dict[int, str]:
    """Names of GLFW's keys, without their prefix."""
    return {getattr(glfw, name): name[4:] for name in dir(glfw) if name.startswith("KEY_")}
