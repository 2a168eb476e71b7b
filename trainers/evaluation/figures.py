"""Pictures of what a policy learned."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from go1_mtl_gym.errors import InvalidInputError
from trainers.data.demonstrations import Demonstrations
from trainers.data.stateful import act_on_rows

if TYPE_CHECKING:
    from stable_baselines3.common.policies import BasePolicy

JOINTS = {"front-left hip": 0, "front-left thigh": 1, "front-left knee": 2}
"""Shown joints and their index in the action."""


def joint_target_figure(
    policy: "BasePolicy", demonstrations: Demonstrations | Mapping[str, Demonstrations], seconds: float = 2.0
) -> Figure:
    """Predicted against expert joint targets, a row per task and a column per joint of the front left leg.

    Args:
        policy: anything with ``predict(obs, deterministic=True)`` on batches; each row is asked for by itself, as in
            `trainers.offline_metrics`.
        demonstrations: held-out rows, or task -> rows; of each task the last `seconds` of its first episode are shown.
        seconds: how much is shown [s].

    Returns:
        A figure on an Agg canvas: ``figure.savefig(path)`` works without a display, and pyplot is not involved.

    Raises:
        InvalidInputError: if there are no rows, they do not belong to the policy's contract, or rows that are said to
            be of one task are of another.
    """
    per_task = _rows_per_task(policy, demonstrations)
    figure = Figure(figsize=(3.6 * len(JOINTS), 1.9 * len(per_task) + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(per_task), len(JOINTS), squeeze=False, sharex=True)
    for row, (task, rows) in enumerate(per_task.items()):
        episode = next(rows.episodes())
        shown = slice(max(episode.start, episode.stop - round(seconds * rows.control_hz)), episode.stop)
        time = np.arange(shown.stop - shown.start) / rows.control_hz
        predicted = rows.contract.to_radians(act_on_rows(policy, rows.obs[shown]))
        expert = rows.contract.to_radians(rows.acts[shown])
        for column, (joint, index) in enumerate(JOINTS.items()):
            ax = axes[row, column]
            ax.plot(time, expert[:, index], color="0.55", linewidth=2.5, label="expert")
            ax.plot(time, predicted[:, index], color="C0", linewidth=1.0, label="policy")
            ax.tick_params(labelsize=7)
            if row == 0:
                ax.set_title(joint, fontsize=9)
            if column == 0:
                ax.set_ylabel(f"{task}\ntarget [rad]", fontsize=8)
            if row == len(per_task) - 1:
                ax.set_xlabel("time [s]", fontsize=8)
    axes[0, 0].legend(fontsize=7, loc="upper right")
    return figure


def _rows_per_task(
    policy: "BasePolicy", demonstrations: Demonstrations | Mapping[str, Demonstrations]
) -> dict[str, Demonstrations]:
    """The rows of each task that has any, in the policy's order of tasks."""
    contract = getattr(policy, "contract", None)
    if isinstance(demonstrations, Demonstrations):
        per_task = demonstrations.fitted_to(contract).per_task()
    else:
        per_task = {name: rows.fitted_to(contract) for name, rows in demonstrations.items() if len(rows)}
    for name, rows in per_task.items():
        tasks = list(rows.per_task())
        if tasks != [name]:
            raise InvalidInputError(f"rows of the task {name!r} were expected under that name, got rows of {tasks}")
    if not per_task:
        raise InvalidInputError("nothing to draw: there are no demonstrations")
    return per_task
