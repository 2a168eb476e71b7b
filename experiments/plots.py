"""One style for all pictures: figures on an Agg canvas, colors, legends, and what several studies draw alike."""

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from experiments.results import Group, Record, group
from experiments.stats import Rate

BLUE, RED, GREEN, PURPLE, YELLOW = "#2166ac", "#d6604d", "#1b9e77", "#7570b3", "#e6ab02"
STUDENTS = (BLUE, GREEN, PURPLE, YELLOW)
"""Colors of the policies, in turn."""
COLORS = (BLUE, RED, GREEN, PURPLE, YELLOW, "0.35")
"""Of series, in turn."""
EXPERT_STYLE = {"color": "0.35", "linestyle": "--"}
DPI = 110


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of some size [inch]."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def grid(
    count: int, columns: int, panel: tuple[float, float], margin: tuple[float, float], **options: Any
) -> tuple[Figure, np.ndarray]:
    """A figure and its axes, at most so many side by side; those that are not needed are hidden.

    Args:
        count: of panels.
        columns: at most.
        panel: width and height of each [inch].
        margin: width and height of what is around them [inch].
        **options: of `Figure.subplots`.
    """
    columns = max(1, min(columns, count))
    rows = max(1, math.ceil(count / columns))
    figure = new_figure(panel[0] * columns + margin[0], panel[1] * rows + margin[1])
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for ax in axes.flat[count:]:
        ax.set_axis_off()
    return figure, axes


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure, equal ones to equal bytes; returns the file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})
    return path


def legend(figure: Figure, axes: Iterable[Axes]) -> None:
    """One legend for all panels, above them, in as few lines as fit into the figure's width."""
    handles: dict[str, Any] = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels()):
            handles.setdefault(label, handle)
    for lines in range(1, len(handles) + 1):
        columns = math.ceil(len(handles) / lines)
        style = {"loc": "outside upper center", "ncols": columns, "fontsize": 9, "frameon": False}
        shown = figure.legend(handles.values(), handles.keys(), **style)
        if columns == 1 or shown.get_window_extent().width <= figure.bbox.width:
            return
        shown.remove()


def agent_styles(names: Sequence[str], expert: str) -> dict[str, dict[str, Any]]:
    """Line styles: policies solid in their colors, the expert dashed."""
    policies = [name for name in names if name != expert]
    solid = {name: {"color": STUDENTS[i % len(STUDENTS)], "linestyle": "-"} for i, name in enumerate(policies)}
    return {name: solid.get(name, EXPERT_STYLE) for name in names}


def dots(panels: Mapping[str, Mapping[str, Mapping[str, Rate | float | None]]], log: Sequence[str] = ()) -> Figure:
    """A panel per metric, a row per label, a dot per series; shares with their 95 % intervals.

    Args:
        panels: metric -> series -> label of a row -> value; None leaves the place empty.
        log: metrics with a logarithmic axis.
    """
    rows = list(dict.fromkeys(row for series in panels.values() for values in series.values() for row in values))
    names = list(dict.fromkeys(name for series in panels.values() for name in series))
    figure = new_figure(max(4.0, 2.0 * len(panels) + 1.8), 0.26 * len(rows) + 1.3)
    axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for ax, (metric, series) in zip(axes, panels.items()):
        for name, values in series.items():
            i = names.index(name)
            for row, value in values.items():
                _dot(ax, value, rows.index(row) + 0.18 * (i - (len(names) - 1) / 2), COLORS[i % len(COLORS)], name)
        ax.set_xlabel(metric, fontsize=9)
        ax.tick_params(labelsize=8)
        ax.grid(axis="y", color="0.93")
        if metric in log:
            ax.set_xscale("log")
        elif (shown := ax.get_xlim())[0] > 0 and shown[0] < 0.7 * shown[1]:
            ax.set_xlim(left=0.0)
    axes[0].set_yticks(range(len(rows)), rows)
    axes[0].invert_yaxis()
    if len(names) > 1:
        legend(figure, axes)
    return figure


def panel(records: Iterable[Record], series: str, row: str, value: Callable[[Group], Any]) -> dict[str, dict[str, Any]]:
    """A panel of `dots`: values of one key as series, those of another as rows."""
    of_series = group(records, series).items()
    return {name: {label: value(each) for label, each in group(members, row).items()} for name, members in of_series}


def _dot(ax: Axes, value: Rate | float | None, height: float, color: str, label: str) -> None:
    if isinstance(value, Rate):
        ax.plot(value.interval, [height] * 2, color=color, linewidth=1.0, alpha=0.6)
        ax.set_xlim(-0.04, 1.04)
        value = value.value
    if value is not None:
        ax.plot(value, height, "o", color=color, markersize=5, label=label)


def band(ax: Axes, x: Sequence[float], rates: Sequence[Rate], color: Any, alpha: float) -> None:
    """The 95 % intervals of some shares."""
    ax.fill_between(x, *np.transpose([rate.interval for rate in rates]), color=color, alpha=alpha, linewidth=0)


def survival_and_success(ax: Axes, levels: Mapping[float, Group], color: str, label: str) -> None:
    """Survival (solid, with 95 % intervals) and success (dashed) over what the levels differ in."""
    survival, success = ([members.rate(key) for members in levels.values()] for key in ("survived", "succeeded"))
    band(ax, [*levels], survival, color, 0.12)
    solid = {"color": color, "linewidth": 2.0, "marker": "o", "markersize": 3.5, "label": label}
    ax.plot([*levels], [rate.value for rate in survival], **solid)
    ax.plot([*levels], [rate.value for rate in success], color=color, linewidth=1.2, linestyle="--")
    ax.set_ylabel("survival (solid), success (dashed)", fontsize=9)
    shares(ax)


def log_ticks(ax: Axes, values: Sequence[float], label: str) -> None:
    """A logarithmic axis with these ticks and no others."""
    ax.set_xscale("log")
    ax.set_xticks(values, [f"{value:g}" for value in values])
    ax.minorticks_off()
    ax.set_xlabel(label)


def shares(ax: Axes) -> None:
    """An axis from none to all."""
    ax.set_ylim(-0.04, 1.04)


def transition_figure(agents: Mapping[str, Mapping[tuple[str, str], Rate]], title: str) -> Figure:
    """Changes of gait, one matrix per agent and one square per pair, from the row's gait to the column's.

    Args:
        agents: name -> (from, to) -> share.
        title: what is counted.
    """
    gaits = list(dict.fromkeys(gait for pairs in agents.values() for gait in itertools.chain(*zip(*pairs))))
    figure = new_figure((1.3 + 0.75 * len(gaits)) * len(agents) + 0.5, 1.4 + 0.62 * len(gaits))
    axes = figure.subplots(1, len(agents), squeeze=False)[0]
    for ax, (agent, pairs) in zip(axes, agents.items()):
        image = _matrix(ax, gaits, pairs)
        ax.set_title(f"{agent}: {title}", fontsize=10)
    figure.colorbar(image, ax=axes, shrink=0.85, label="fraction")
    return figure


def _matrix(ax: Axes, gaits: Sequence[str], rates: Mapping[tuple[str, str], Rate]) -> AxesImage:
    values = np.full((len(gaits), len(gaits)), np.nan)
    for i, first in enumerate(gaits):
        for j, second in enumerate(gaits):
            rate = rates.get((first, second))
            if rate and rate.trials:
                values[i, j] = rate.value
                color = "white" if rate.value > 0.6 else "black"
                ax.text(j, i, f"{rate.successes}/{rate.trials}", ha="center", va="center", fontsize=9, color=color)
    image = ax.imshow(np.ma.masked_invalid(values), cmap="Blues", vmin=0.0, vmax=1.0)
    ax.set_facecolor("0.93")
    ax.set_xticks(range(len(gaits)), gaits)
    ax.set_yticks(range(len(gaits)), gaits)
    ax.set(xlabel="to", ylabel="from")
    ax.tick_params(length=0)
    return image
