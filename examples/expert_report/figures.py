"""Pictures of the report card. Each takes what ``expert.json`` holds and gives a figure on an Agg canvas."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from expert_report.bars import PROTOTYPE
from expert_report.limits import DIRECTIONS
from go1_mtl_gym import TASKS, robot

OWN, BAR, PLAN = "#2166ac", "#d6604d", "0.82"
"""Colours of what was measured, of the prototype, and of the plan."""
DPI = 110


def save_figures(expert: Mapping[str, Any], folder: Path) -> list[Path]:
    """Write ``expert_NAME.png`` for every section that was measured; returns the files."""
    written = []
    for name, (section, draw) in FIGURES.items():
        data = expert["report"].get(section)
        if data and any(data.values()):
            written.append(save_figure(draw(data), folder / f"expert_{name}.png"))
    return written


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure, equal ones to equal bytes; returns the file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})
    return path


def transition_figure(data: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Survival of every change of gait, from the row's to the column's."""
    figure = new_figure(1.6 + 0.75 * len(data), 1.3 + 0.62 * len(data))
    ax = figure.subplots()
    image = pair_matrix(ax, data, "survived")
    ax.set_title("Survived changes of gait")
    figure.colorbar(image, ax=ax, shrink=0.85, label="share")
    return figure


def pair_matrix(ax: Axes, data: Mapping[str, Mapping[str, Any]], counted: str) -> AxesImage:
    """Draw {from: {to: {counted: ..., "trials": ...}}}, one square per change of gait; returns the image."""
    gaits = list(data)
    share = np.full((len(gaits), len(gaits)), np.nan)
    for i, source in enumerate(gaits):
        for j, target in enumerate(gaits):
            pair = data[source].get(target)
            if pair and pair["trials"]:
                share[i, j] = pair[counted] / pair["trials"]
                text, color = f"{pair[counted]}/{pair['trials']}", "white" if share[i, j] > 0.6 else "black"
                ax.text(j, i, text, ha="center", va="center", fontsize=9, color=color)
    image = ax.imshow(np.ma.masked_invalid(share), cmap="Blues", vmin=0.0, vmax=1.0)
    ax.set_facecolor("0.93")
    ax.set_xticks(range(len(gaits)), gaits)
    ax.set_yticks(range(len(gaits)), gaits)
    ax.set(xlabel="to", ylabel="from")
    ax.tick_params(length=0)
    return image


def push_figure(data: Mapping[str, Mapping[str, float]]) -> Figure:
    """Largest kick survived at every phase of the cycle, per direction, with the prototype's lines."""
    figure = new_figure(2.1 * len(data) + 1.2, 3.1)
    axes = figure.subplots(1, len(data), sharey=True, squeeze=False)[0]
    for ax, (gait, kicks) in zip(axes, data.items()):
        names = [name for name in DIRECTIONS if name in kicks]
        bars = ax.bar(range(len(names)), [kicks[name] for name in names], color=OWN, width=0.7, label="here")
        ax.bar_label(bars, fmt="%.1f", fontsize=8, padding=1)
        own = PROTOTYPE.get(gait)
        for i, name in enumerate(names):
            bar = own and (own.lateral if name in ("left", "right") else own.fore_aft)
            if bar:
                label = None if i else "prototype"
                ax.plot([i - 0.42, i + 0.42], [bar, bar], color=BAR, linewidth=2.2, label=label)
        ax.set_xticks(range(len(names)), names, rotation=40, ha="right", fontsize=9)
        ax.set_title(gait, fontsize=10)
    axes[0].set_ylabel("largest kick survived [m/s]")
    axes[0].margins(y=0.15)
    legend(figure, axes)
    return figure


def limit_figure(data: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> Figure:
    """Largest command along each axis that is survived, and that is tracked, with the prototype's lines."""
    titles = {"vx": "forward [m/s]", "-vx": "backward [m/s]", "vy": "sideways [m/s]", "yaw": "yaw rate [rad/s]"}
    shown = [axis for axis in titles if any(axis in own for own in data.values())]
    figure = new_figure(3.0 * len(shown) + 0.6, 0.36 * len(data) + 1.5)
    axes = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for ax, axis in zip(axes, shown):
        for row, (gait, own) in enumerate(data.items()):
            if axis not in own:
                continue
            ax.barh(row, own[axis]["survived"], height=0.7, color="#a6c8e4", label="survived" if not row else None)
            ax.barh(row, own[axis]["tracked"], height=0.4, color=OWN, label="and tracked" if not row else None)
            bars = PROTOTYPE.get(gait)
            bar = bars and {"vx": bars.vx, "vy": bars.vy, "yaw": bars.yaw}.get(axis)
            if bar:
                label = "prototype" if not row else None
                ax.plot([bar, bar], [row - 0.42, row + 0.42], color=BAR, linewidth=2.2, label=label)
        ax.set_title(titles[axis], fontsize=10)
        ax.set_yticks(range(len(data)), list(data))
        ax.set_xlim(left=0)
    axes[0].invert_yaxis()
    legend(figure, axes)
    return figure


def contact_figure(data: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Feet on the ground over two cycles: planned in grey, measured in color."""
    known = {gait: own["cruise"]["schedule"] for gait, own in data.items() if "schedule" in own["cruise"]}
    columns = 2 if len(known) > 1 else 1
    rows = -(-len(known) // columns)
    figure = new_figure(4.4 * columns + 0.3, 1.55 * rows + 0.6)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax, (gait, legs) in zip(axes, known.items()):
        _contacts(ax, gait, legs)
    for ax in axes[len(known) :]:
        ax.set_axis_off()
    for ax in axes[max(0, len(known) - columns) : len(known)]:
        ax.set_xlabel("gait clock [cycles]", fontsize=9)
    legend(figure, axes[:1])
    return figure


def _contacts(ax: Axes, gait: str, legs: list[list[list[float]]]) -> None:
    plan, cycles = TASKS[gait].gait, 2
    for row, intervals in enumerate(legs):
        for k in range(-1, cycles + 1):
            start = k - plan.offsets[row]
            low, high = max(0.0, start), min(float(cycles), start + plan.duty)
            if high > low:
                label = "planned" if row == 0 and low == 0.0 else None
                ax.barh(row, high - low, left=low, height=0.86, color=PLAN, label=label)
        for i, (low, high) in enumerate(intervals):
            ax.barh(row, high - low, left=low, height=0.36, color=OWN, label="measured" if not row and not i else None)
    ax.set_yticks(range(4), robot.LEGS, fontsize=8)
    ax.invert_yaxis()
    ax.set_xlim(0, cycles)
    ax.set_title(gait, fontsize=10)
    ax.tick_params(axis="x", labelsize=8)


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of some size [inch] on an Agg canvas."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def legend(figure: Figure, axes: Any) -> None:
    """One legend for all panels, above them, in as few lines as fit into the figure's width."""
    found: dict[str, Any] = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels()):
            found.setdefault(label, handle)
    for lines in range(1, len(found) + 1):
        columns = math.ceil(len(found) / lines)
        own = {"loc": "outside upper center", "ncols": columns, "fontsize": 9, "frameon": False}
        shown = figure.legend(found.values(), found.keys(), **own)
        if columns == 1 or shown.get_window_extent().width <= figure.bbox.width:
            return
        shown.remove()


FIGURES: dict[str, tuple[str, Callable[[Mapping[str, Any]], Figure]]] = {
    "limits": ("limits", limit_figure),
    "pushes": ("pushes", push_figure),
    "contacts": ("steady", contact_figure),
    "transitions": ("transitions", transition_figure),
}
"""Name of a picture -> the section that it shows, and what draws it."""
