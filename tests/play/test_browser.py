"""The page of viser's: what tabs send over the line, and what they are shown."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import urllib.request
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image

from go1_mtl_gym.errors import InvalidInputError
from tests.play.conftest import Stand
from trainers.evaluation.episodes import EpisodeSetup
from trainers.play.controls import SHIFT_KEYS, STICK_KEYS, Controls
from trainers.play.hands import Hands
from trainers.play.loop import play_on
from trainers.play.options import PlayOptions
from trainers.play.player import Player
from trainers.play.session import Session
from trainers.play.surfaces import _invitation

viser = pytest.importorskip("viser", reason="the extra `web` is not installed")
msgspec = pytest.importorskip("msgspec")
from websockets.sync.client import connect  # noqa: E402

from trainers.play.browser.buttons import _code  # noqa: E402
from trainers.play.browser.geometry import CONE, TUBE, instances, unit_mesh  # noqa: E402
from trainers.play.browser.holds import SILENT_S, Holds  # noqa: E402
from trainers.play.browser.readouts import report  # noqa: E402
from trainers.play.browser.surface import MOST_WAITING, Browser, PrivateServer  # noqa: E402

SETUP = EpisodeSetup("trot", 3, 1e6, command=(0.0, 0.0, 0.0))
PATIENCE_S = 60.0
"""For an answer of another thread or process on a busy machine [s]."""
HERE = Path(__file__).parent
NODE_MODULES = HERE.parents[1] / "web" / "node_modules"


@pytest.fixture
def player(student):
    hands = Hands()
    with Session(student, SETUP, hands.drive, expert=Stand) as session:
        yield Player(session, hands)


@pytest.fixture
def browser(player):
    browser = Browser(player, port=0)
    yield browser
    browser.close()
    browser.close()


class Tab:
    """A browser's end of the line, without the browser."""

    def __init__(self, browser: Browser, azimuth: float = 0.0, width: int = 10) -> None:
        self._browser, self._width = browser, width
        self._line = connect(
            browser.link.replace("http", "ws"), subprotocols=[f"viser-v{viser.__version__}"], max_size=None
        )
        before = browser.tabs
        self.look(azimuth)  # viser knows a tab from its first camera on
        until(browser, lambda: browser.tabs == before + 1)

    def look(self, azimuth: float) -> None:
        x, y = float(np.cos(azimuth)), float(np.sin(azimuth))
        self._send(
            "ViewerCameraMessage", wxyz=(1, 0, 0, 0), position=(-x, -y, 0.5), look_at=(0, 0, 0.2), fov=1.0, near=0.1,
            far=100.0, image_height=10, image_width=self._width, up_direction=(0, 0, 1),
        )  # fmt: skip

    def hold(self, key: str) -> None:
        self._send("GuiButtonHoldMessage", uuid=self._browser.button_ids[key], frequency=10.0)

    def click(self, key: str) -> None:
        self._send("GuiUpdateMessage", uuid=self._browser.button_ids[key], updates={"value": True})

    def ask_to_share(self) -> None:
        self._send("ShareUrlRequest")

    def close(self) -> None:
        self._line.close()

    def _send(self, kind: str, **fields: object) -> None:
        self._line.send(msgspec.msgpack.encode({"type": kind, **fields}))


def until(browser: Browser, seen) -> None:
    """Take in what comes until something is seen."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        assert browser.poll()
        if seen():
            return
        time.sleep(0.005)
    raise AssertionError("never seen")


# -- On the line -------------------------------------------------------------------------------------------------------


def test_the_page_is_served_on_the_loopback(browser):
    assert browser.link.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(browser.link, timeout=PATIENCE_S) as answer:
        assert answer.status == 200 and b"viser" in answer.read().lower()


def test_a_port_in_use_is_said_to_be(browser, player):
    with pytest.raises(InvalidInputError, match=f"port {browser.port}: Address already in use; --port 0 takes a free"):
        Browser(player, port=browser.port)
    with pytest.raises(InvalidInputError, match="cannot listen on nowhere.invalid"):
        Browser(player, host="nowhere.invalid", port=0)


def test_two_tabs_drive_the_same_robot(browser, player):
    first, second = Tab(browser), Tab(browser)
    stick = lambda: player.hands.stick.tolist()  # noqa: E731
    first.hold("W")
    until(browser, lambda: stick() == [1.0, 0.0, 0.0])
    second.hold("A"), second.hold("W")
    until(browser, lambda: stick() == [1.0, 0.0, 1.0])
    first.click("W")  # it lets go; the other one still holds
    second.hold("W"), second.click("A")
    until(browser, lambda: stick()[2] == 0.0)
    assert stick() == [1.0, 0.0, 0.0]
    second.click("4")
    until(browser, lambda: player.step() and player.session.go1.requested_task.name == "walk")
    second.hold("LEFT_SHIFT"), second.hold("W")
    until(browser, lambda: stick() == [0.5, 0.0, 0.0])
    second.close(), first.close()
    until(browser, lambda: browser.tabs == 0 and stick() == [0.0, 0.0, 0.0])


def test_a_tab_that_falls_silent_holds_nothing(browser, player):
    tab = Tab(browser)
    tab.hold("S")
    until(browser, lambda: player.hands.stick[0] == -1.0)
    began = time.monotonic()
    until(browser, lambda: not player.hands.stick.any())
    assert time.monotonic() - began > SILENT_S / 2
    tab.close()


def test_a_push_goes_away_from_whoever_clicked(browser, player):
    player.camera.mjv.azimuth += 90.0  # the camera has turned with the robot, and the world under the tabs with it
    for azimuth, expected in ((0.0, (0, 1)), (np.pi / 2, (-1, 0))):
        tab = Tab(browser, azimuth)
        before = player.session.go1.simulation.data.qvel[:2].copy()
        pushes = player.hands._pushes
        tab.click("P")
        until(browser, lambda: len(pushes) == 1)  # noqa: B023
        player.hands.drive(player.session.env, 1)
        change = player.session.go1.simulation.data.qvel[:2] - before
        np.testing.assert_allclose(change / np.hypot(*change), expected, atol=1e-6)
        tab.close()


def test_without_hands_there_is_nothing_to_drive_with(student):
    with Session(student, SETUP) as session:
        browser = Browser(Player(session), port=0)
        assert {"W", "1", "P"}.isdisjoint(browser.button_ids) and {"SPACE", "R"} <= set(browser.button_ids)
        browser.draw()
        browser.close()


def test_clicks_that_nobody_could_make_hold_nothing_up(browser, player, monkeypatch):
    acts = []

    def act():
        acts.append(browser._post(act))  # more comes while it is done

    for _ in range(3 * MOST_WAITING):
        browser._post(act)
    assert browser.poll() and len(acts) <= MOST_WAITING
    monkeypatch.setattr("trainers.play.browser.surface.LONGEST_POLL_S", 0.0)
    acts.clear()
    assert browser.poll() and not acts, "what there is no time for waits"


@pytest.mark.parametrize(
    ("host", "tunnel"),
    [("127.0.0.1", "8080:127.0.0.1:8080"), ("::1", "8080:[::1]:8080"), ("localhost", "8080:localhost")],
)
def test_the_way_from_another_machine_is_one_that_ssh_takes(host, tunnel):
    link = f"http://{f'[{host}]' if ':' in host else host}:8080"
    assert f"ssh -N -L {tunnel}" in _invitation(link, PlayOptions(web=True, host=host))


def test_on_an_upright_phone_the_robot_is_above_the_panel(browser):
    wide, narrow = Tab(browser), Tab(browser, width=4)
    clients = browser._server.get_clients()
    until(browser, lambda: len(clients) == 2)
    heights = sorted(client.camera.look_at[2] for client in clients.values())
    until(browser, lambda: min(client.camera.look_at[2] for client in clients.values()) < 0.0)
    assert heights[-1] == pytest.approx(0.2)
    wide.close(), narrow.close()


def test_no_page_can_open_the_robot_to_the_public(browser, monkeypatch):
    asked, tunnels = [], []
    refused = PrivateServer.request_share_url
    monkeypatch.setattr(PrivateServer, "request_share_url", lambda server: asked.append(refused(server)))
    monkeypatch.setattr("viser._viser.ViserTunnel", lambda *args: tunnels.append(args))
    tab = Tab(browser)
    tab.ask_to_share()
    until(browser, lambda: asked)
    assert asked == [None] and not tunnels
    tab.close()


# -- Holds and keys ----------------------------------------------------------------------------------------------------


def test_holds_end_by_silence_and_by_leaving(player):
    holds = Holds(Controls(player))
    stick = lambda: player.hands.stick.tolist()  # noqa: E731
    holds.hold(1, "W", 10.0)
    holds.hold(2, "D", 10.0 + SILENT_S / 2)
    holds.forget_silent(10.0 + SILENT_S)
    assert stick() == [1.0, 0.0, -1.0]
    holds.forget_silent(10.1 + SILENT_S)
    assert stick() == [0.0, 0.0, -1.0]
    holds.release(1, "D")  # not the one that holds it
    assert stick() == [0.0, 0.0, -1.0]
    holds.hold(1, "D", 11.0)
    holds.leave(2)
    assert stick() == [0.0, 0.0, -1.0]
    holds.leave(1)
    assert stick() == [0.0, 0.0, 0.0]


def test_every_key_of_the_stick_presses_a_button(browser):
    script = browser.keyboard
    found = json.loads(re.search(r"\(({\"buttons\".*})\)", script).group(1))
    for key in (*STICK_KEYS, *SHIFT_KEYS):
        assert found["buttons"][_code(key)] in found["held"], key
    assert found["buttons"]["ArrowUp"] == found["buttons"]["KeyW"] == browser.button_ids["W"]
    assert found["buttons"]["Digit6"] == browser.button_ids["6"] and found["buttons"]["Digit6"] not in found["held"]


@pytest.mark.skipif(shutil.which("node") is None, reason="no node")
def test_the_keyboard_s_script_can_be_read(browser):
    subprocess.run(["node", "--check", "-"], input=browser.keyboard, text=True, check=True, timeout=PATIENCE_S)


# -- What is shown -----------------------------------------------------------------------------------------------------

SHAPES = """
<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  .2 0 0  0 .3 0  0 0 .4"/></asset>
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <body pos="1 2 3" quat="0.8 0.6 0 0">
      <freejoint/>
      <geom type="capsule" size=".1 .5" pos="0 0 1"/>
      <geom type="ellipsoid" size=".1 .2 .3"/>
      <geom type="box" size=".1 .2 .3" rgba="1 .5 0 .4"/>
      <geom type="mesh" mesh="wedge"/>
    </body>
  </worldbody>
</mujoco>
"""


def corners(model: mujoco.MjModel, each) -> np.ndarray:
    """Vertices of an instance in the world."""
    vertices, _ = unit_mesh(each.shape, model)
    return each.position_w + (vertices * each.scale) @ each.rotation.T


def test_shapes_are_where_mujoco_has_them():
    model = mujoco.MjModel.from_xml_string(SHAPES)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene = mujoco.MjvScene(model, 20)
    mujoco.mjv_updateScene(
        model, data, mujoco.MjvOption(), mujoco.MjvPerturb(), mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL, scene
    )
    geom = scene.geoms[scene.ngeom]
    scene.ngeom += 1
    mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_ARROW, np.ones(3), np.zeros(3), np.eye(3).ravel(), np.ones(4, "f4"))
    mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_ARROW, 0.02, np.array([1.0, 0, 0]), np.array([2.0, 1.0, 0]))
    drawn = instances(scene)
    turn = data.xmat[1].reshape(3, 3)

    def extent(parts, axes=turn, origin=data.xpos[1]):
        inside = (np.concatenate([corners(model, each) for each in parts]) - origin) @ axes
        return np.stack([inside.min(0), inside.max(0)])

    capsule, ellipsoid, box, wedge = drawn[:3], drawn[3:4], drawn[4:5], drawn[5:6]
    np.testing.assert_allclose(extent(capsule), [[-0.1, -0.1, 0.4], [0.1, 0.1, 1.6]], atol=2e-3)
    np.testing.assert_allclose(extent(ellipsoid), [[-0.1, -0.2, -0.3], [0.1, 0.2, 0.3]], atol=2e-3)
    np.testing.assert_allclose(extent(box), [[-0.1, -0.2, -0.3], [0.1, 0.2, 0.3]], atol=1e-6)
    np.testing.assert_allclose(box[0].rgba, [1.0, 0.5, 0.0, 0.4], atol=1e-6)
    np.testing.assert_allclose(extent(wedge), [[0, 0, 0], [0.2, 0.3, 0.4]], atol=1e-5)
    shaft, head = drawn[6:]
    assert (shaft.shape, head.shape) == (TUBE, CONE)
    axis = np.array([1.0, 1.0, 0.0]) / np.sqrt(2)
    along = np.concatenate([corners(model, shaft), corners(model, head)]) @ axis
    np.testing.assert_allclose([along.min(), along.max()], [1 / np.sqrt(2), 3 / np.sqrt(2)], atol=1e-6)


def test_the_robot_stays_in_the_middle_of_every_tab(browser, player):
    player.hands.move_stick((1.0, 0.0, 1.0))
    for _ in range(60):
        player.step()
    browser.draw()
    centers = {key: handle.batched_positions for key, handle in browser._mirror._handles.items()}
    assert sum(map(len, centers.values())) > 150
    middle = np.concatenate(list(centers.values())).mean(0)
    assert np.hypot(*player.session.go1.state.position_w[:2]) > 0.5 > 0.3 > np.hypot(*middle[:2])
    player.ghost = True
    browser.draw()
    clear = [handle for (_, clear), handle in browser._mirror._handles.items() if clear]
    assert any((handle.batched_opacities > 0).sum() > 10 for handle in clear)
    player.ghost = False
    browser.draw()
    assert all(not (handle.batched_opacities > 0).sum() > 10 for handle in clear)


def test_the_report_says_what_is_to_be_known(browser, player):
    player.hands.move_stick((1.0, 0.0, 0.0))
    for _ in range(100):
        player.step()
    said = report(player, player.session.reading)
    root = ElementTree.fromstring(said)
    words = " ".join(root.itertext())
    measured = player.session.reading.measured[0]
    for each in ("trot", "student drives", "2.0 s", "phase", "real time", f"{measured:.1f}", "FL", "RR"):
        assert each in words
    strips = [rect for rect in root.iter("rect") if rect.get("fill") == "#fa8c1a"]
    assert 8 < len(strips) < 60
    player.paused = True
    assert "paused" in report(player, player.session.reading)
    assert "&lt;wait&gt;" in report(player, player.session.reading, "<wait>")


def test_plots_follow_the_time(browser, player):
    for _ in range(30):
        player.step()
        browser._readouts.update()
    browser._readouts._plots_s = -np.inf
    browser._readouts.update()
    times, command, measured = browser._readouts._plots[0].data
    assert times[-1] == pytest.approx(0.6) and (np.diff(times) > 0).all()
    assert len(command) == len(measured) == len(times)
    player.reset()
    browser._readouts._plots_s = -np.inf
    browser._readouts.update()
    assert browser._readouts._plots[0].data[0].tolist() == [0.0]


# -- As a program ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems always have a display")
def test_without_a_display_a_page_is_served(tmp_path):
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment |= {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "trainers", "play", "--port", "0", "--save-script", str(tmp_path / "did.json")]
    process = subprocess.Popen(
        command,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # tests in a background job ignore Ctrl-C
    )
    try:
        line = process.stdout.readline()
        assert line.startswith("there is no display: drive in a browser at http://127.0.0.1:")
        link = re.search(r"http://\S+", line).group()
        assert f"ssh -N -L {link.rpartition(':')[2]}:127.0.0.1:" in process.stdout.readline()
        with urllib.request.urlopen(link, timeout=PATIENCE_S) as answer:
            assert answer.status == 200
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
    assert process.returncode == 0 and "Traceback" not in err
    assert "does it again" in out and (tmp_path / "did.json").exists()


CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
MISSING = [
    name
    for name, there in (
        ("node", shutil.which("node")),
        ("Chromium", CHROMIUM),
        ("puppeteer (make web)", (NODE_MODULES / "puppeteer-core").exists()),
    )
    if not there
]


@pytest.mark.slow
@pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")
def test_a_person_drives_in_chromium(browser, player, tmp_path):
    picture = tmp_path / "page.png"
    command = ["node", str(HERE / "drive_page.mjs"), browser.link, CHROMIUM, str(picture)]
    environment = os.environ | {"PUPPETEER": str(NODE_MODULES / "puppeteer-core"), "PATIENCE_S": str(PATIENCE_S)}
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    sticks, gaits, drivers = set(), set(), set()

    def note() -> None:
        sticks.add(tuple(player.hands.stick))
        gaits.add(player.session.go1.requested_task.name)
        drivers.add(player.session.driver)

    play_on(browser, player, until=lambda: process.poll() is not None, each=note)
    assert process.returncode == 0, process.stdout.read()
    assert {(1.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0)} <= sticks
    assert {"trot", "bound", "pace"} <= gaits and drivers == {"student", "expert"}
    until(browser, lambda: not player.hands.stick.any())
    pixels = np.asarray(Image.open(picture).convert("RGB"))
    assert pixels.shape == (720, 1100, 3) and pixels.std() > 20
