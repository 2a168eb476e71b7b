"""Tables and pictures of the sections that teach their own students; each takes {walker: {gait: {part: figures}}}."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from expert_report.figures import legend, new_figure
from matplotlib.figure import Figure

from student_report.budget import drops
from student_report.lessons import ALL
from student_report.sums import Report, mean
from trainers.evaluation.metrics import wilson_interval
from trainers.utils.report import markdown, number

COLORS = ("#d6604d", "#e6ab02", "#7570b3", "#1b9e77", "#2166ac")
"""Of the methods of "budget", in turn."""
MEASURED = {"walking": ("#2166ac", "o"), "noisy": ("#e6ab02", "s"), "switching": ("#1b9e77", "^")}
"""What is drawn of "phase_free": color and marker."""
PHASE_FLOOR = 1e-3
"""Smaller errors of the phase are drawn as this [cycles]."""


# -- DAgger against cloning --------------------------------------------------------------------------------------------


def pooled_levels(seeds: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The budgets of a method, the episodes of all its training seeds together.

    Args:
        seeds: {part: {"levels": [...]}}, equal budgets in every part.

    Returns:
        "seconds"; "succeeded", "survived" and "trials" with "success_rate", "success_interval" and "survival_rate";
        and the means over seeds of "velocity_error" [m/s], "falls" and "learner_fraction".
    """
    found = []
    for levels in zip(*(part["levels"] for part in seeds.values()), strict=True):
        own = [level["pooled"] for level in levels]
        count = {name: sum(each[name] for each in own) for name in ("succeeded", "survived", "trials")}
        means = {name: float(np.mean([level[name] for level in levels])) for name in ("falls", "learner_fraction")}
        found.append(
            {
                "seconds": levels[0]["seconds"],
                "success_rate": count["succeeded"] / count["trials"],
                "success_interval": wilson_interval(count["succeeded"], count["trials"]),
                "survival_rate": count["survived"] / count["trials"],
                "velocity_error": mean(each["velocity_error"] for each in own),
                **count,
                **means,
            }
        )
    return found


def budget_table(report: Report) -> str:
    """Per method: success and survival at every budget; error, falls and learner's share at the last; real drops."""
    methods = {name: pooled_levels(tasks[ALL]) for name, tasks in report.items()}
    budgets = [f"{level['seconds']:g} s" for level in next(iter(methods.values()))]
    rows = []
    for name, levels in methods.items():
        last = levels[-1]
        cells = [f"{level['success_rate']:.0%} ({level['survival_rate']:.0%})" for level in levels]
        counts = [f"{last['falls']:.1f}", f"{last['learner_fraction']:.0%}"]
        fell = ", ".join(budgets[i] for i in drops(levels)) or "none"
        rows.append([name, *cells, number(last["velocity_error"], ".3f"), *counts, fell])
    more = ["velocity error [m/s]", "falls while collecting", "driven by the learner", "drops at"]
    return markdown(["", *budgets, *more], rows)


def budget_figure(report: Report) -> Figure:
    """Survival (solid) and success (dashed) over labels, and falls while collecting them, one color per method."""
    figure = new_figure(9.6, 3.6)
    shares, falls = figure.subplots(1, 2)
    for color, (name, tasks) in zip(COLORS, report.items()):
        levels = pooled_levels(tasks[ALL])
        seconds = [level["seconds"] for level in levels]
        survival = [level["survival_rate"] for level in levels]
        bounds = np.transpose([wilson_interval(level["survived"], level["trials"]) for level in levels])
        shares.fill_between(seconds, *bounds, color=color, alpha=0.12, linewidth=0)
        shares.plot(seconds, survival, color=color, linewidth=2.0, marker="o", markersize=3.5, label=name)
        shares.plot(seconds, [level["success_rate"] for level in levels], color=color, linewidth=1.2, linestyle="--")
        fallen = [level["falls"] for level in levels]
        falls.plot(seconds, fallen, color=color, linewidth=2.0, marker="o", markersize=3.5)
    for ax in (shares, falls):
        ax.set_xscale("log")
        ax.set_xticks(seconds, [f"{value:g}" for value in seconds])
        ax.minorticks_off()
        ax.set_xlabel("labels per gait [s]")
    shares.set_ylabel("survival (solid), success (dashed)")
    shares.set_ylim(-0.04, 1.04)
    falls.set_ylabel("falls while collecting, all gaits")
    falls.set_ylim(bottom=0.0)
    legend(figure, [shares])
    return figure


# -- Without a clock ---------------------------------------------------------------------------------------------------


def phase_free_rows(report: Report) -> dict[str, Mapping[str, Any]]:
    """{name of the student, and its part if it has several: figures}."""
    return {
        name if len(tasks[ALL]) == 1 else f"{name}, {what}": figures
        for name, tasks in report.items()
        for what, figures in tasks[ALL].items()
    }


def phase_free_table(report: Report) -> str:
    """Per student: success in every gait, what all gaits have in common, and the error of the phase."""
    named = phase_free_rows(report)
    gaits = list(next(iter(named.values()))["tasks"])
    rows = []
    for name, found in named.items():
        walking, phase = found["walking"], found["phase"]
        success = [_of(found["tasks"][gait], "succeeded") for gait in gaits]
        others = [_of(found[key], "succeeded") for key in ("switching", "noisy")]
        error = "-" if phase is None else f"{phase['median']:.3f}, {phase['p99']:.3f}"
        tracked = number(walking["velocity_error"], ".3f")
        rows.append([name, *success, _of(walking, "survived"), tracked, *others, error])
    more = ["survived", "velocity error [m/s]", "changes of gait", "noisy sensors", "phase error [cycles]"]
    return markdown(["", *gaits, *more], rows)


def phase_free_figure(report: Report) -> Figure:
    """Success while walking, with noisy sensors and in changes of gait; the phase error from median to 99 %."""
    named = phase_free_rows(report)
    places = np.arange(len(named))[::-1]
    figure = new_figure(9.6, 1.2 + 0.4 * len(named))
    shares, errors = figure.subplots(1, 2, sharey=True, width_ratios=(2, 1))
    for i, (key, (color, marker)) in enumerate(MEASURED.items()):
        shown = [(place, found[key]) for place, found in zip(places, named.values()) if found[key]]
        for place, own in shown:
            shares.plot(own["success_interval"], [place + 0.2 * (1 - i)] * 2, color=color, linewidth=1.0, alpha=0.6)
        rates = [own["success_rate"] for _, own in shown]
        heights = [place + 0.2 * (1 - i) for place, _ in shown]
        shares.plot(rates, heights, marker, color=color, markersize=5, linestyle="", label=key)
    for place, found in zip(places, named.values()):
        if found["phase"] is not None:
            both = [max(PHASE_FLOOR, found["phase"][name]) for name in ("median", "p99")]
            errors.plot(both, [place, place], color="0.35", linewidth=1.5, marker="|", markersize=9)
    errors.set_xscale("log")
    errors.set_xlim(PHASE_FLOOR, 0.6)
    errors.set_xlabel("phase error [cycles]")
    shares.set_xlim(-0.02, 1.02)
    shares.set_xlabel("success")
    shares.set_yticks(places, list(named))
    legend(figure, [shares])
    return figure


# -- Cells -------------------------------------------------------------------------------------------------------------


def _of(summed: Mapping[str, Any] | None, key: str) -> str:
    return f"{summed[key]}/{summed['trials']}" if summed else "-"
