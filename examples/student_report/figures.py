"""Pictures of the student's report. Each takes {walker: {gait: {part: figures}}} and gives a figure."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from expert_report.figures import legend, new_figure, pair_matrix
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from student_report.classes import BARS
from student_report.commanded import DRAWN
from student_report.lab import EXPERT
from student_report.lessons_page import budget_figure, phase_free_figure
from student_report.pushes import PAIRS
from student_report.robustness import QUANTITIES
from student_report.sums import Count, Report, commanded_sums, gaits_of, seeds_of, variant_sums
from trainers.evaluation.metrics import wilson_interval

COLORS = ("#2166ac", "#1b9e77", "#7570b3", "#e6ab02")
"""Of the students, in turn."""
EXPERT_STYLE = {"color": "0.35", "linestyle": "--"}
BAR = 0.95
"""Share of survived episodes that a student is measured against."""


def styles(report: Report) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every walker and the style of its lines: students solid, the expert dashed."""
    for i, name in enumerate(report):
        yield name, EXPERT_STYLE if name == EXPERT else {"color": COLORS[i % len(COLORS)], "linestyle": "-"}


def commanded_figure(report: Report) -> Figure:
    """Per gait: the success of every training seed with that of all together, and velocity errors by the expert's."""
    gaits = gaits_of(report)
    figure = new_figure(9.0, 3.2)
    left, right = figure.subplots(1, 2)
    for i, gait in enumerate(gaits):
        sums, seeds = commanded_sums(report, gait), seeds_of(report, gait, DRAWN).values()
        places = i - 0.15 + np.linspace(-0.1, 0.1, len(seeds))
        left.plot(places, [own["success_rate"] for own in seeds], "o", color=COLORS[0], alpha=0.6, label="each seed")
        _interval(left, i + 0.15, sums[DRAWN], label="all, 95 %")
        errors = [np.nan if own["velocity_error"] is None else own["velocity_error"] for own in seeds]
        right.plot(places, errors, "o", color=COLORS[0], alpha=0.6)
        if sums["expert_error"] is not None:
            right.plot(i + 0.15, sums["expert_error"], "D", color=EXPERT_STYLE["color"], label=EXPERT)
    for ax, key, label in ((left, "success_rate", "success"), (right, "velocity_error", "velocity error [m/s]")):
        ax.axhline(BARS[key], color="0.7", linewidth=0.8, linestyle=":", zorder=0)
        ax.set_xticks(range(len(gaits)), gaits)
        ax.set_ylabel(label)
    left.set_ylim(-0.04, 1.04)
    right.set_ylim(bottom=0.0)
    legend(figure, (left, right))
    return figure


def _interval(ax: Axes, x: float, count: Count, label: str) -> None:
    succeeded, trials = count
    if trials:
        low, high = wilson_interval(succeeded, trials)
        rate = succeeded / trials
        span = [[max(0.0, rate - low)], [max(0.0, high - rate)]]
        ax.errorbar(x, rate, span, color="black", marker="s", markersize=4, capsize=3, label=label)


def ablation_figure(report: Report) -> Figure:
    """A dot per variant and figure; the dotted lines are the first variant's, which the others change in one thing."""
    columns = {
        "success": "success",
        "error": "velocity error [m/s]",
        "switching": "changes of gait",
        "changed": "changed world",
        "r2": "one-step R2",
    }
    sums = {name: variant_sums(tasks) for name, tasks in report.items()}
    figure = new_figure(2.1 * len(columns) + 1.8, 0.24 * len(sums) + 1.0)
    axes = figure.subplots(1, len(columns), sharey=True)
    for ax, (key, label) in zip(axes, columns.items()):
        values = [_share(own[key]) for own in sums.values()]
        ax.plot(values, range(len(values)), "o", color=COLORS[0])
        ax.axvline(values[0], color="0.6", linewidth=0.8, linestyle=":", zorder=0)
        ax.set_xlabel(label, fontsize=9)
        ax.tick_params(labelsize=8)
        ax.grid(axis="y", color="0.93")
        if key not in ("error", "r2"):
            ax.set_xlim(-0.04, 1.04)
    axes[0].set_yticks(range(len(sums)), sums)
    axes[0].invert_yaxis()
    return figure


def _share(value: Count | float | None) -> float:
    """A count as a share; NaN for nothing."""
    if isinstance(value, tuple):
        value = value[0] / value[1] if value[1] else None
    return np.nan if value is None else value


def switching_figure(report: Report) -> Figure:
    """Successful changes of gait, from the row's to the column's, one matrix per walker."""
    size = max(len(tasks) for tasks in report.values())
    figure = new_figure((1.3 + 0.75 * size) * len(report) + 0.5, 1.4 + 0.62 * size)
    axes = figure.subplots(1, len(report), squeeze=False)[0]
    for ax, (name, pairs) in zip(axes, report.items()):
        image = pair_matrix(ax, pairs, "succeeded")
        ax.set_title(f"{name}: successful changes of gait", fontsize=10)
    figure.colorbar(image, ax=axes, shrink=0.85, label="share")
    return figure


def robustness_figure(report: Report) -> Figure:
    """Survival over each quantity: of all gaits together, with 95 % intervals, and, thin, of the weakest gait."""
    measured = {what for tasks in report.values() for parts in tasks.values() for what in parts}
    shown = [name for name in QUANTITIES if name in measured]
    columns = min(4, len(shown))
    rows = -(-len(shown) // columns)
    figure = new_figure(2.9 * columns + 0.4, 2.15 * rows + 0.5)
    axes = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for ax, quantity in zip(axes.flat, shown):
        _survival(ax, report, quantity)
        ax.set_xlabel(QUANTITIES[quantity].label, fontsize=9)
        ax.tick_params(labelsize=8)
    for ax in axes.flat[len(shown) :]:
        ax.set_axis_off()
    for ax in axes[:, 0]:
        ax.set_ylabel("survival", fontsize=9)
    legend(figure, axes.flat[:1])
    return figure


def _survival(ax: Axes, report: Report, quantity: str) -> None:
    for name, style in styles(report):
        levels = [parts[quantity]["levels"] for parts in report[name].values() if quantity in parts]
        values = [level["value"] for level in levels[0]]
        survived, trials = (
            np.array([[level[key] for level in own] for own in levels]) for key in ("survived", "trials")
        )
        pooled, weakest = survived.sum(0) / trials.sum(0), (survived / trials).min(0)
        bounds = np.transpose([wilson_interval(int(s), int(n)) for s, n in zip(survived.sum(0), trials.sum(0))])
        ax.fill_between(values, *bounds, color=style["color"], alpha=0.15, linewidth=0)
        ax.plot(values, pooled, **style, linewidth=2.0, marker="o", markersize=3.5, label=name)
        ax.plot(values, weakest, **style, linewidth=0.9, label=f"{name}, weakest gait")
    ax.set_xticks(values, [f"{value:g}" for value in values])
    ax.axhline(BAR, color="0.7", linewidth=0.8, linestyle=":", zorder=0)
    ax.set_ylim(-0.04, 1.04)


def push_figure(report: Report) -> Figure:
    """Largest kick per gait, in the weaker of the two directions, walkers side by side."""
    figure = new_figure(9.6, 3.2)
    axes = figure.subplots(1, len(PAIRS), sharey=True)
    width = 0.8 / len(report)
    for ax, (title, pair) in zip(axes, PAIRS.items()):
        for i, (name, style) in enumerate(styles(report)):
            kicks = {task: weaker(parts, pair) for task, parts in report[name].items()}
            places = np.arange(len(kicks)) + (i - (len(report) - 1) / 2) * width
            color = "0.7" if name == EXPERT else style["color"]
            bars = ax.bar(places, [kick or 0.0 for kick in kicks.values()], 0.92 * width, color=color, label=name)
            ax.bar_label(
                bars, ["" if kick is None else f"{kick:.1f}" for kick in kicks.values()], fontsize=8, padding=1
            )
        ax.set_xticks(range(len(kicks)), kicks)
        ax.set_title(title, fontsize=10)
    axes[0].set_ylabel("largest kick survived [m/s]")
    axes[0].margins(y=0.12)
    legend(figure, axes[:1])
    return figure


def weaker(parts: Mapping[str, Any], pair: tuple[str, str]) -> float | None:
    """The smaller of two directions' largest kicks [m/s], of those that were measured."""
    return min((parts[name]["largest"] for name in pair if name in parts), default=None)


FIGURES: dict[str, Callable[[Report], Figure]] = {
    "commanded": commanded_figure,
    "switching": switching_figure,
    "robustness": robustness_figure,
    "pushes": push_figure,
    "ablation": ablation_figure,
    "budget": budget_figure,
    "phase_free": phase_free_figure,
}
"""Section -> what draws it."""
