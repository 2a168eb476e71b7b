"""Figures of a table: the held-out loss, joint targets, and foot contacts."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from expert_report.figures import OWN, legend, new_figure
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

import trainers
from go1_mtl_gym import robot
from go1_mtl_gym.sensing.observation import ObservationLayout
from paper_report.published import KINDS, MULTI_HEAD, POOLED

COLORS = {MULTI_HEAD: "#2166ac", POOLED: "#d6604d"}
STYLES = ("-", "--", ":", "-.")
"""Of the widths, the widest first."""


def loss_figure(students: Sequence[Mapping[str, Any]], gaits: Sequence[str]) -> Figure:
    """Held-out loss over gradient steps, a panel per gait and a line per student, pooled against multi-head.

    Args:
        students: what is known of them; other kinds are not drawn.
        gaits: of the table.
    """
    drawn = [own for own in students if own["kind"] in COLORS]
    widths = sorted({own["width"] for own in drawn}, reverse=True)
    figure = new_figure(3.3 * len(gaits) + 0.4, 3.2)
    axes = figure.subplots(1, len(gaits), squeeze=False, sharey=True)[0]
    for ax, gait in zip(axes, gaits):
        for own in drawn:
            style = STYLES[min(widths.index(own["width"]), len(STYLES) - 1)]
            label = f"{KINDS[own['kind']]}, {own['width']} wide"
            ax.plot(own["curve"]["steps"], own["curve"]["mse"][gait], style, color=COLORS[own["kind"]], label=label)
        ax.set_yscale("log")
        ax.xaxis.set_major_locator(MaxNLocator(4))
        ax.set_title(gait, fontsize=10)
        ax.set_xlabel("gradient steps", fontsize=9)
        ax.tick_params(labelsize=8)
    axes[0].set_ylabel("held-out MSE [rad²]", fontsize=9)
    if drawn:
        legend(figure, axes)
    return figure


def contact_figure(rows: trainers.Demonstrations, seconds: float = 1.0) -> Figure:
    """Feet on the ground over the last `seconds` of the first episode of every gait.

    Args:
        rows: of the expert, without channels and history.
        seconds: how much is shown [s].
    """
    per_gait = rows.per_task()
    figure = new_figure(3.3 * len(per_gait) + 0.4, 1.9)
    axes = figure.subplots(1, len(per_gait), squeeze=False, sharey=True)[0]
    place = ObservationLayout(rows.tasks).slices["contacts"]
    for ax, (gait, own) in zip(axes, per_gait.items()):
        episode = next(own.episodes())
        first = max(episode.start, episode.stop - round(seconds * own.control_hz))
        _stances(ax, own.obs[first : episode.stop, place] > 0.5, own.control_hz)
        ax.set_title(gait, fontsize=10)
        ax.set_xlabel("time [s]", fontsize=9)
        ax.tick_params(labelsize=8)
    axes[0].set_yticks(range(4), robot.LEGS, fontsize=8)
    axes[0].invert_yaxis()
    return figure


def stances(contact: np.ndarray) -> list[tuple[int, int]]:
    """First row and number of rows of every stretch on the ground.

    Args:
        contact: of one foot, bool, shape (n,).
    """
    edges = np.flatnonzero(np.diff(contact.astype(int), prepend=0, append=0))
    return [(int(begin), int(end - begin)) for begin, end in zip(edges[::2], edges[1::2])]


def _stances(ax: Axes, contacts: np.ndarray, control_hz: float) -> None:
    for leg in range(4):
        spans = [(begin / control_hz, count / control_hz) for begin, count in stances(contacts[:, leg])]
        ax.broken_barh(spans, (leg - 0.35, 0.7), color=OWN)
    ax.set_xlim(0, len(contacts) / control_hz)
