"""What the page writes of a robot: who drives, gait and phase, velocities, foot contacts, and plots."""

import html
import time
from collections import deque
from typing import Any

import numpy as np

from go1_mtl_gym import robot
from trainers.evaluation.captions import (
    AXES,
    COMMAND,
    CONTACT,
    FULL_SCALE,
    MEASURED,
    STRIP_S,
    TRACK,
    Color,
    Reading,
    number,
    spells,
)
from trainers.play.player import Player
from trainers.play.session import EXPERT
from trainers.play.status import EXPERT_COLOR, notice_of

TEXT_HZ, PLOTS_HZ = 10.0, 5.0
"""How often letters and plots change."""
PLOT_S = 10.0
"""How much of the past the plots show [s]."""
PLOT_HEIGHT = 120
WIDTH, ROW = 300.0, 20.0
"""Of the drawing, in its own units."""
ONE_LINE = "min-height: 1.5em; white-space: nowrap; overflow: hidden; text-overflow: ellipsis"
"""Of text that must not move what stands below it."""
LIGHT, DIM = "#e8ecf1", "#9aa5b1"


class Readouts:
    """Text, drawings and plots that follow a player.

    Args:
        gui: viser's `GuiApi`.
        player: that they follow.
    """

    def __init__(self, gui: Any, player: Player) -> None:
        self._gui, self._player = gui, player
        self._html = gui.add_html("")
        self._trace: deque[np.ndarray] = deque()
        self._plots: list[Any] = []
        self._text_s = self._plots_s = -np.inf

    def add_plots(self) -> None:
        """Put the plots at the end of what the page has until now."""
        axis = {"stroke": DIM, "size": 24, "grid": {"stroke": "#ffffff18", "width": 1}}
        empty = tuple(np.zeros(1) for _ in range(3))
        with self._gui.add_folder(f"Command and measured velocity, {PLOT_S:g} s"):
            for name, unit in AXES:
                series = (
                    {"label": "s"},
                    {"label": "command", "stroke": _css(COMMAND), "width": 2, "points": {"show": False}},
                    {"label": "measured", "stroke": _css(MEASURED), "width": 2, "points": {"show": False}},
                )
                scales = {"x": {"time": False, "auto": True}, "y": {"range": (-FULL_SCALE, FULL_SCALE)}}
                self._plots.append(
                    self._gui.add_uplot(
                        empty,
                        series,
                        title=f"{name} [{unit}]",
                        scales=scales,
                        axes=(axis, {**axis, "size": 36}),
                        legend={"show": False},
                        height=PLOT_HEIGHT,
                        padding=(4, 8, 0, 0),
                    )
                )

    def update(self, notice: str | None = None) -> None:
        """Say how it stands; letters that nobody could read before they change are left as they are.

        Args:
            notice: a line of text, in place of the one that would stand there.
        """
        now, reading = time.monotonic(), self._player.session.reading
        self._remember(reading)
        if notice is not None or now - self._text_s >= 1.0 / TEXT_HZ:
            self._text_s = now
            self._html.content = report(self._player, reading, notice)
        if now - self._plots_s >= 1.0 / PLOTS_HZ:
            self._plots_s = now
            columns = np.array(self._trace).T
            for i, plot in enumerate(self._plots):
                plot.data = (columns[0], columns[1 + i], columns[4 + i])

    def _remember(self, reading: Reading) -> None:
        """Add a row (time, command, measured) to what is plotted."""
        time_s, trace = self._player.session.time_s, self._trace
        if trace and time_s < trace[-1][0]:  # a new episode
            trace.clear()
        if not trace or time_s > trace[-1][0]:
            trace.append(np.array([time_s, *reading.command, *reading.measured]))
        while trace[-1][0] - trace[0][0] > PLOT_S:
            trace.popleft()


def report(player: Player, reading: Reading, notice: str | None = None) -> str:
    """The state in HTML.

    Args:
        player: whose.
        reading: of its session.
        notice: a line of text, in place of the one that would stand there.
    """
    session, state = player.session, player.session.go1.state
    driver_color = _css(EXPERT_COLOR) if session.driver == EXPERT else LIGHT
    phase = "stands" if state.standing else f"phase {state.phase:.2f}"
    said = notice_of(player) if notice is None else notice
    return (
        f'<div style="padding: 0 0.75em 0.4em; color: {LIGHT}; font-variant-numeric: tabular-nums; line-height: 1.5">'
        f'<div style="display: flex; justify-content: space-between"><b>{html.escape(reading.task)}</b>'
        f'<span style="color: {driver_color}">{session.driver} drives</span><span>{session.time_s:.1f} s</span></div>'
        f'<div style="display: flex; justify-content: space-between"><span>{_clock(state.phase)} {phase}</span>'
        f'<span style="color: {DIM}">real time {player.factor:.2f}</span></div>'
        f'<div style="color: {_css(EXPERT_COLOR)}; {ONE_LINE}">{html.escape(said)}</div>'
        f"{_drawing(reading)}</div>"
    )


def _clock(phase: float) -> str:
    """A disc that fills as the gait's cycle goes on."""
    angle = 2.0 * np.pi * phase
    x, y, far = 8 + 7 * np.sin(angle), 8 - 7 * np.cos(angle), int(phase > 0.5)
    return (
        '<svg width="16" height="16" style="vertical-align: -3px">'
        f'<circle cx="8" cy="8" r="7" fill="{_css(TRACK)}"/>'
        f'<path d="M8 8 V1 A7 7 0 {far} 1 {x:.2f} {y:.2f} Z" fill="{_css(COMMAND)}"/></svg>'
    )


def _drawing(reading: Reading) -> str:
    """Velocities as numbers and bars, and below them the strip of foot contacts."""
    parts = [_label(112, 0, "command", COMMAND), _label(232, 0, "measured", MEASURED)]
    for i, (name, unit) in enumerate(AXES):
        parts.append(_velocity(ROW * (1 + i), name, unit, float(reading.command[i]), float(reading.measured[i])))
    top = ROW * (len(AXES) + 1) + 6
    parts.append(_label(34, top, f"feet on the ground, {STRIP_S:g} s", CONTACT))
    for leg, name in enumerate(robot.LEGS):
        parts.append(_strip(top + ROW + 15 * leg, name, reading.contacts[:, leg], reading.contacts_n))
    height = top + ROW + 15 * len(robot.LEGS)
    return f'<svg viewBox="0 0 {WIDTH:g} {height:g}" style="width: 100%; font-size: 12px">{"".join(parts)}</svg>'


def _velocity(y: float, name: str, unit: str, command: float, measured: float) -> str:
    left, width = 112.0, 112.0
    zero, per_unit = left + width / 2, width / 2 / FULL_SCALE
    end, mark = (zero + per_unit * np.clip(value, -FULL_SCALE, FULL_SCALE) for value in (measured, command))
    return (
        _text(0, y, name)
        + _text(102, y, number(command), _css(COMMAND), "end")
        + _box(left, y + 4, width, 10, _css(TRACK))
        + _box(min(zero, end), y + 4, abs(end - zero), 10, _css(MEASURED))
        + _box(mark - 1, y + 1, 3, 16, _css(COMMAND))
        + _text(262, y, number(measured), _css(MEASURED), "end")
        + _text(268, y, unit, DIM)
    )


def _strip(y: float, name: str, contacts: np.ndarray, full: int) -> str:
    left, width = 34.0, WIDTH - 34.0
    step, first = width / full, full - len(contacts)
    spans = (_box(left + step * (first + a), y, step * (b - a), 10, _css(CONTACT)) for a, b in spells(contacts))
    return _text(0, y - 4, name) + _box(left, y, width, 10, _css(TRACK)) + "".join(spans)


def _label(x: float, y: float, words: str, color: Color) -> str:
    return _text(x, y, words, _css(color), "start" if x < 100 else "middle")


def _text(x: float, y: float, words: str, color: str = LIGHT, anchor: str = "start") -> str:
    return f'<text x="{x:g}" y="{y + 13:g}" fill="{color}" text-anchor="{anchor}">{html.escape(words)}</text>'


def _box(x: float, y: float, width: float, height: float, color: str) -> str:
    return f'<rect x="{x:.1f}" y="{y:g}" width="{width:.1f}" height="{height:g}" fill="{color}"/>'


def _css(color: Color) -> str:
    return "#" + "".join(f"{part:02x}" for part in color[:3])
