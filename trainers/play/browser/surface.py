"""A page that shows a player's robot to any number of browsers, and takes in what is done there."""

import contextlib
import io
import queue
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
import viser

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.rotations import quat_from_matrix, yaw_matrix
from trainers.play.browser.buttons import Buttons
from trainers.play.browser.geometry import Mirror
from trainers.play.browser.holds import Holds
from trainers.play.browser.readouts import Readouts
from trainers.play.camera import AIM_HEIGHT
from trainers.play.controls import Controls
from trainers.play.options import LOOPBACK, PORT
from trainers.play.player import Player
from trainers.play.record import OffScreen
from trainers.play.scene import Ghost, furnish

TITLE = "go1-mtl-gym"
LARGEST_HZ = 30.0
"""Pictures per second; more would only fill the line to another machine."""
NARROW, PHONE_SHIFT = 0.8, 0.35
"""Pages narrower than this share of their height look lower, by so much of the camera's distance."""
LONGEST_POLL_S, MOST_WAITING = 0.05, 500
"""Time that is spent on what was done in tabs between two pictures [s], and how much of it may wait."""
CAPACITY = 2000
"""Geoms of the scene."""
FLOOR: dict[str, Any] = {
    "plane_color": (58, 66, 76),
    "plane_opacity": 1.0,
    "cell_color": (84, 94, 106),
    "section_color": (112, 124, 138),
    "fade_distance": 25.0,
}


class Browser:
    """A server on this machine, whose page is open in some tabs, or in none.

    The world is moved and turned under the robot rather than every tab's camera over it: so each can be turned by hand
    while it follows.

    Args:
        player: that is shown.
        host: name or address of the interface to listen on; others than the loopback let others drive.
        port: to listen on; 0 takes a free one.
        film_size: width and height of `picture` [pixels].

    Attributes:
        controls: what buttons and keys reach.
        largest_hz: pictures per second, at most.
        ends_by_interrupt: yes: nothing on the page ends it.
        port: that is listened on.

    Raises:
        InvalidInputError: if it cannot listen there.
    """

    largest_hz = LARGEST_HZ
    ends_by_interrupt = True

    def __init__(
        self, player: Player, host: str = LOOPBACK, port: int = PORT, film_size: tuple[int, int] = (1280, 720)
    ) -> None:
        self._player, self.controls = player, Controls(player)
        self._holds = Holds(self.controls)
        self._inbox: queue.Queue[Callable[[], object]] = queue.Queue(MOST_WAITING)
        self._film_size = film_size
        self._off_screen: OffScreen | None = None
        self._ghost: Ghost | None = None
        self._host = host
        self._server = _started(host, port)
        self.port = self._server.get_port()
        try:
            self._furnish()
        except BaseException:
            self.close()
            raise

    def _furnish(self) -> None:
        """Fill the page."""
        server, player = self._server, self._player
        model = player.session.go1.simulation.model
        self._scene = mujoco.MjvScene(model, CAPACITY)
        self._option, self._perturbation = mujoco.MjvOption(), mujoco.MjvPerturb()
        mjv = player.camera.mjv
        self._azimuth = float(mjv.azimuth)
        angle, up = np.radians([self._azimuth, mjv.elevation])
        looking = np.array([np.cos(up) * np.cos(angle), np.cos(up) * np.sin(angle), np.sin(up)])
        aim = np.array([0.0, 0.0, AIM_HEIGHT])
        server.initial_camera.look_at = tuple(aim)
        server.initial_camera.position = tuple(aim - mjv.distance * looking)
        self._floor = server.scene.add_grid("/floor", infinite_grid=True, **FLOOR)
        self._mirror = Mirror(server.scene, model)
        server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False, control_width="medium")
        self._readouts = Readouts(server.gui, player)
        self._buttons = Buttons(server.gui, player, self.controls, self._holds, self._post, self._turn_to)
        self._readouts.add_plots()

        @server.on_client_disconnect
        async def _(tab: Any) -> None:
            self._post(lambda: self._holds.leave(tab.client_id))

        @server.on_client_connect
        async def _(tab: Any) -> None:
            if tab.camera.aspect < NARROW:  # a panel covers the lower half of an upright phone
                look_at = np.array([0.0, 0.0, AIM_HEIGHT - PHONE_SHIFT * mjv.distance])
                tab.camera.look_at = tuple(look_at)

    def _post(self, act: Callable[[], object]) -> None:
        """Have something done between two pictures, in the thread that plays, unless too much waits already."""
        with contextlib.suppress(queue.Full):
            self._inbox.put_nowait(act)

    @property
    def link(self) -> str:
        """What is to be opened in a browser."""
        host = socket.gethostname() if self._host in ("0.0.0.0", "::", "") else self._host
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}"

    @property
    def tabs(self) -> int:
        """How many tabs are open."""
        return len(self._server.get_clients())

    @property
    def button_ids(self) -> dict[str, str]:
        """Key, by its name as `Controls.key` has it -> id of the button on the page that presses it."""
        return self._buttons.ids

    @property
    def keyboard(self) -> str:
        """JavaScript that lets the keyboard of a tab press these buttons."""
        return self._buttons.keyboard

    # -- What a surface does -------------------------------------------------------------------------------------------

    def poll(self) -> bool:
        """Take in what was done in all tabs; True, since none of them can end the playing for the others.

        What cannot be done between two pictures waits, and what comes faster than anybody clicks is left out.
        """
        end, waiting = time.monotonic() + LONGEST_POLL_S, self._inbox.qsize()
        with contextlib.suppress(queue.Empty):
            while waiting > 0 and time.monotonic() < end:
                waiting -= 1
                self._inbox.get_nowait()()
        self._holds.forget_silent(time.monotonic())
        return True

    def draw(self, notice: str | None = None) -> None:
        """Show the present state in all tabs.

        Args:
            notice: a line of text, in place of the one that would stand there.
        """
        player = self._player
        if player.ghost and self._ghost is None:
            self._ghost = Ghost(player.session)
        simulation, everything = player.session.go1.simulation, mujoco.mjtCatBit.mjCAT_ALL
        camera, option, perturbation = player.camera.mjv, self._option, self._perturbation
        mujoco.mjv_updateScene(simulation.model, simulation.data, option, perturbation, camera, everything, self._scene)
        furnish(self._scene, player.session, self._ghost if player.ghost else None)
        with self._server.atomic():
            turn, shift = self._place()
            self._floor.wxyz, self._floor.position = quat_from_matrix(turn), shift
            self._mirror.update(self._scene, turn, shift)
        self._readouts.update(notice)
        self._buttons.update()

    def picture(self) -> np.ndarray:
        """The same, as the window shows it; RGB, uint8, shape (height, width, 3)."""
        if self._off_screen is None:
            self._off_screen = OffScreen(self._player, *self._film_size)
        return self._off_screen.picture()

    def close(self) -> None:
        """End the server; may be called twice."""
        if self._off_screen is not None:
            self._off_screen.close()
            self._off_screen = None
        if self._server is not None:
            with _silence():
                self._server.stop()
            self._server = None

    # -- Where from ----------------------------------------------------------------------------------------------------

    @property
    def _turn(self) -> float:
        """How far the player's camera has turned with the robot [rad]."""
        return float(np.radians(self._player.camera.mjv.azimuth - self._azimuth))

    def _place(self) -> tuple[np.ndarray, np.ndarray]:
        """How the world is turned, and then shifted: what is followed comes into the middle, and its heading stays."""
        turn = np.eye(3)
        turn[:2, :2] = yaw_matrix(-self._turn)
        x, y, _ = self._player.camera.mjv.lookat
        return turn, -turn @ np.array([x, y, 0.0])

    def _turn_to(self, tab: Any) -> None:
        """Let a tab be the one whose direction "away from you" means."""
        if tab is None:
            return
        toward = np.asarray(tab.camera.look_at) - np.asarray(tab.camera.position)
        if np.hypot(*toward[:2]) > 1e-6:  # not from straight above
            self._player.camera.orbit = float(np.arctan2(toward[1], toward[0]) - np.radians(self._azimuth))


class PrivateServer(viser.ViserServer):
    """A server of viser's that opens no tunnel to the public, whoever asks: viser's pages can."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Nothing: who else may drive is said where the program is started, by ``--host``."""


def _started(host: str, port: int) -> Any:
    """A server of viser's.

    Raises:
        InvalidInputError: if it cannot listen there.
    """
    _check_free(host, port)
    with _silence():
        server = PrivateServer(host=host, port=port, label=TITLE, verbose=False)
    if port not in (0, server.get_port()):  # somebody was faster; viser takes the next one
        with _silence():
            server.stop()
        raise _busy(host, port, "address already in use")
    return server


def _check_free(host: str, port: int) -> None:
    """Take it for a moment: viser would take another port without a word, or never answer.

    Raises:
        InvalidInputError: if that is not possible.
    """
    try:
        family, kind, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        with socket.socket(family, kind) as trial:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as viser does: one that was just left is free
            trial.bind(address)
    except OSError as error:
        raise _busy(host, port, error.strerror or str(error)) from error


def _busy(host: str, port: int, reason: str) -> InvalidInputError:
    return InvalidInputError(
        f"cannot listen on {host}, port {port}: {reason}; --port 0 takes a free port, --host another interface"
    )


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Viser greets and takes leave in frames of its own."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
