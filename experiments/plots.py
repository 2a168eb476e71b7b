"""One style for all pictures: figures on an Agg canvas, colors, legends, and what several studies draw alike."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from experiments.stats import Rate

BLUE, RED, GREEN, PURPLE, YELLOW = "#2166ac", "#d6604d", "#1b9e77", "#7570b3", "#e6ab02"
STUDENTS = (BLUE, GREEN, PURPLE, YELLOW)
"""Colors of the policies, in turn."""
EXPERT_STYLE = {"color": "0.35", "linestyle": "--"}
DPI = 110


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of some size [inch]."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


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


def band(ax: Axes, x: Sequence[float], rates: Sequence[Rate], color: Any, alpha: float) -> None:
    """The 95 % intervals of some shares."""
    ax.fill_between(x, *np.transpose([rate.interval for rate in rates]), color=color, alpha=alpha, linewidth=0)


def log_ticks(ax: Axes, values: Sequence[float], label: str) -> None:
    """A logarithmic axis with these ticks and no others."""
    ax.set_xscale("log")
    ax.set_xticks(values, [f"{value:g}" for value in values])
    ax.minorticks_off()
    ax.set_xlabel(label)


def shares(ax: Axes) -> None:
    """An axis from none to all."""
    ax.set_ylim(-0.04, 1.04)


def transition_matrix(ax: Axes, gaits: Sequence[str], rates: dict[tuple[str, str], Rate]) -> AxesImage:
    """Successful changes of gait, one square per (from, to); returns the image."""
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
