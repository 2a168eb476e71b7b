"""Tables in Markdown from the numbers that the main job writes."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from go1_mtl_gym.errors import InvalidInputError

LEARNERS = {
    "expert": "MPC expert",
    "multi_head": "multi-head student",
    "phase_free": "the same without a clock (phase told from raw frames)",
    "pooled": "pooled baseline (no task id)",
    "paper_literal": "paper-literal 34 + K (no command, phase, last action)",
}
"""Name in ``metrics.json`` -> name in a table, in the order of the rows."""
RESULT_COLUMNS = {
    "MSE [rad^2]": ("mse", ".6f"),
    "MAE [rad]": ("mae", ".4f"),
    "R2": ("r2", ".4f"),
    "success": ("success_rate", "share"),
    "survival": ("survival_rate", "share"),
    "velocity error [m/s]": ("velocity_error", ".3f"),
    "steps/s": ("step_rate", ".2f"),
    "in hands": ("operator_success_rate", "share"),
}
"""Header -> key in ``metrics.json`` and how its value is written."""
IF_MEASURED = ("in hands",)
"""Columns that a table without such values does without."""
PAPER_R2 = {
    "trot": (0.919537, 0.770130, "simulation"),
    "jump": (0.892613, 0.796875, "simulation"),
    "bound": (0.991763, 0.906929, "simulation"),
    "walk": (0.961206, None, "hardware"),
}
"""R2 of the multi-task policy, of the single-task baseline, and where: the tables of arXiv 2505.08574."""


def results_table(metrics: Mapping[str, Any]) -> str:
    """One row per task and learner: one-step errors and closed-loop figures.

    Args:
        metrics: what ``metrics.json`` holds; ``{"tasks": {task: {learner: {figure: value or None}}}}``. "episodes" is
            their count or the list of their records.

    Raises:
        InvalidInputError: if there are no tasks in it.
    """
    tasks, rows = _tasks(metrics), []
    known = {key for scores in tasks.values() for learner in scores.values() for key in learner}
    columns = {
        name: (key, how) for name, (key, how) in RESULT_COLUMNS.items() if name not in IF_MEASURED or key in known
    }
    for task, scores in tasks.items():
        for learner in _learners(scores):
            cells = [_cell(scores[learner], key, how) for key, how in columns.values()]
            rows.append([task, LEARNERS.get(learner, learner), *cells])
    return markdown(["gait", "learner", *columns], rows, text_columns=2)


def paper_table(metrics: Mapping[str, Any]) -> str:
    """R2 of the multi-head student and the pooled baseline here, and of their counterparts in arXiv 2505.08574.

    The settings differ (other expert, gains, rates, commands and inputs), so this says how well each network fits its
    own expert, not which one is better.

    Args:
        metrics: what ``metrics.json`` holds.

    Raises:
        InvalidInputError: if there are no tasks in it.
    """
    rows = []
    for task, scores in _tasks(metrics).items():
        multi, single, where = PAPER_R2.get(task, (None, None, "-"))
        ours = [number(scores.get(learner, {}).get("r2"), ".4f") for learner in ("multi_head", "pooled")]
        rows.append([task, *ours, number(multi, ".4f"), number(single, ".4f"), where])
    header = ["gait", "multi-head, here", "pooled, here", "multi-task, paper", "single-task, paper", "paper's setting"]
    return markdown(header, rows, text_columns=1)


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]], text_columns: int = 1) -> str:
    """A Markdown table; the first `text_columns` columns are set left, the others right. No newline at its end."""
    rule = [":--" if i < text_columns else "--:" for i in range(len(header))]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (header, rule, *rows))


def _tasks(metrics: Mapping[str, Any]) -> Mapping[str, Mapping[str, Any]]:
    tasks = metrics.get("tasks")
    if not isinstance(tasks, Mapping) or not tasks:
        raise InvalidInputError(f'expected metrics with at least one task under "tasks", got {sorted(metrics)}')
    return tasks


def _learners(scores: Mapping[str, Any]) -> list[str]:
    """Those that are there, in the order of `LEARNERS`, unknown ones last."""
    return [name for name in LEARNERS if name in scores] + [name for name in scores if name not in LEARNERS]


def _cell(scores: Mapping[str, Any], key: str, how: str) -> str:
    value = scores.get(key)
    return _share(value, scores.get("episodes")) if how == "share" else number(value, how)


def number(value: float | None, how: str) -> str:
    """A number by a format; "-" for one that is not there."""
    return "-" if value is None or not math.isfinite(value) else format(value, how)


def _share(value: float | None, episodes: Any) -> str:
    """A rate as a count of episodes where their number is known, else in percent."""
    if value is None or not math.isfinite(value):
        return "-"
    count = len(episodes) if isinstance(episodes, Sequence) else episodes
    return f"{100 * value:.0f} %" if not count else f"{round(value * count)}/{count}"
