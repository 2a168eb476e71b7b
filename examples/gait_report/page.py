"""Table and picture of the report on new gaits, from what ``new_gaits.json`` holds."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from expert_report.figures import legend, new_figure
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from student_report.lab import EXPERT

from gait_report.methods import BEFORE, METHODS
from trainers.evaluation.metrics import wilson_interval
from trainers.utils.report import markdown, number

COLORS = dict(zip(METHODS, ("#2166ac", "#7570b3", "#1b9e77", "#d6604d"), strict=True))
"""Of the methods."""
NOTE = (
    "Success (survival) and R2 on held-out rows by seconds of demonstrations, all training seeds together; the "
    "velocity error is that of the most. From `all survive from` on no episode ends in a fall. The last column says "
    "what became of the gaits that the policy had: of their actions, and of their success."
)
"""What the table holds."""


def level_sums(level: Mapping[str, Any]) -> dict[str, Any]:
    """All training seeds of one budget together.

    Args:
        level: {"seconds", "seeds": {seed: figures}}.

    Returns:
        "seconds"; "trials", "survived" and "succeeded" episodes; "survival_rate", its 95 % "survival_interval" and
        "success_rate"; means over seeds of "r2" and of "velocity_error" [m/s], None where nobody has one.
    """
    seeds = list(level["seeds"].values())
    count = {name: sum(own[name] for own in seeds) for name in ("trials", "survived", "succeeded")}
    errors = [own["velocity_error"] for own in seeds if own["velocity_error"] is not None]
    return {
        "seconds": level["seconds"],
        **count,
        "survival_rate": count["survived"] / count["trials"],
        "survival_interval": wilson_interval(count["survived"], count["trials"]),
        "success_rate": count["succeeded"] / count["trials"],
        "r2": float(np.mean([own["r2"] for own in seeds])),
        "velocity_error": float(np.mean(errors)) if errors else None,
    }


def enough(sums: Sequence[Mapping[str, Any]]) -> float | None:
    """The fewest seconds from which on, at every budget, all episodes survive; None if there are none.

    Args:
        sums: `level_sums` of every budget, in rising order.
    """
    found = None
    for own in reversed(sums):
        if own["survived"] < own["trials"]:
            break
        found = own["seconds"]
    return found


def new_gaits_table(data: Mapping[str, Any]) -> str:
    """One row per gait and method, and a sentence on those that they are compared with."""
    some = next(iter(next(iter(data["report"].values())).values()))
    budgets = [f"{level['seconds']:g} s" for level in some]
    rows = []
    for gait, methods in data["report"].items():
        for method, levels in methods.items():
            sums = [level_sums(level) for level in levels]
            cells = [f"{own['success_rate']:.0%} ({own['survival_rate']:.0%}) {own['r2']:.4f}" for own in sums]
            least = enough(sums)
            error = number(sums[-1]["velocity_error"], ".3f")
            rows.append([gait, method, *cells, "-" if least is None else f"{least:g} s", error, old_cell(levels)])
    header = ["gait", "learned", *budgets, "all survive from", "velocity error [m/s]", "old gaits"]
    return "\n\n".join([markdown(header, rows, text_columns=2), _references(data)])


def old_cell(levels: Sequence[Mapping[str, Any]]) -> str:
    """What became of the old gaits: of their actions in all budgets, or of their success in the largest."""
    figures = [own for level in levels for own in level["seeds"].values()]
    if not all("changes" in own for own in figures):
        return "-"
    if all(own["changes"]["equal"] for own in figures):
        return "equal to the bit"
    last = [own["old"] for own in levels[-1]["seeds"].values() if "old" in own]
    largest = max(own["changes"]["largest_rad"] for own in figures)
    changed = f"changed by up to {largest:.2g} rad"
    return f"{_succeeded([each for own in last for each in own.values()])}, {changed}" if last else changed


def _references(data: Mapping[str, Any]) -> str:
    own = ", ".join(f"{_succeeded([figures])} of {gait}" for gait, figures in data[EXPERT].items())
    return (
        f"The expert succeeds in {own}; the policy, before, in {_succeeded(list(data[BEFORE].values()))} of its own "
        "gaits."
    )


def _succeeded(episodes: Sequence[Mapping[str, Any]]) -> str:
    return f"{sum(own['succeeded'] for own in episodes)}/{sum(own['trials'] for own in episodes)}"


def new_gaits_figure(data: Mapping[str, Any]) -> Figure:
    """Per gait: survival and success by seconds of demonstrations, and what is left to explain of the actions."""
    report = data["report"]
    figure = new_figure(9.6, 2.9 * len(report) + 0.3)
    axes = figure.subplots(len(report), 2, sharex=True, squeeze=False)
    for (shares, errors), (gait, methods) in zip(axes, report.items()):
        for method, levels in methods.items():
            _draw(shares, errors, method, levels)
        shares.set_title(gait, loc="left", fontsize=10)
        shares.set_ylabel("survival (solid), success (dashed)", fontsize=9)
        shares.set_ylim(-0.04, 1.04)
        errors.set_ylabel("1 - R2, held out", fontsize=9)
        errors.set_yscale("log")
    seconds = [level["seconds"] for level in next(iter(methods.values()))]
    for ax in axes[-1]:
        ax.set_xscale("log")
        ax.set_xticks(seconds, [f"{value:g}" for value in seconds])
        ax.minorticks_off()
        ax.set_xlabel("demonstrations of the new gait [s]")
    legend(figure, axes[0, :1])
    return figure


def _draw(shares: Axes, errors: Axes, method: str, levels: Sequence[Mapping[str, Any]]) -> None:
    sums, color = [level_sums(level) for level in levels], COLORS[method]
    seconds = [own["seconds"] for own in sums]
    bounds = np.transpose([own["survival_interval"] for own in sums])
    shares.fill_between(seconds, *bounds, color=color, alpha=0.12, linewidth=0)
    survival = [own["survival_rate"] for own in sums]
    shares.plot(seconds, survival, color=color, linewidth=2.0, marker="o", markersize=3.5, label=method)
    shares.plot(seconds, [own["success_rate"] for own in sums], color=color, linewidth=1.2, linestyle="--")
    errors.plot(seconds, [1 - own["r2"] for own in sums], color=color, linewidth=2.0)
    for level in levels:
        missing = [1 - own["r2"] for own in level["seeds"].values()]
        errors.plot([level["seconds"]] * len(missing), missing, "o", color=color, markersize=3.5, alpha=0.6)


def new_gaits_section(data: Mapping[str, Any], made_by: str, picture: bool) -> list[str]:
    """Paragraphs of the page of results.

    Args:
        data: what ``new_gaits.json`` holds.
        made_by: how it was made.
        picture: whether ``new_gaits.png`` is there.
    """
    shown = ["![Survival and R2 of new gaits by seconds of demonstrations](new_gaits.png)"] if picture else []
    return ["## New gaits for a trained policy", new_gaits_table(data), f"{NOTE} {made_by}", *shown]
