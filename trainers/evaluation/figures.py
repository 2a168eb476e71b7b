"""Pictures of what a policy learned."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from go1_mtl_gym.errors import InvalidInputError
from trainers.data.demonstrations import Demonstrations

if TYPE_CHECKING:
    from stable_baselines3.common.policies import BasePolicy

JOINTS = {"front-left hip": 0, "front-left thigh": 1, "front-left knee": 2}
"""Shown joints and their index in the action."""


def joint_target_figure(
    policy: "BasePolicy", demonstrations: Demonstrations | Mapping[str, Demonstrations], seconds: float = 2.0
) -> Figure:
    """Predicted against expert joint targets, a row per task and a column per joint of the front left leg.

    Args:
        policy: anything with ``predict(obs, deterministic=True)`` on batches.
        demonstrations: held-out rows, or task -> rows; of each task the last `seconds` of its first episode are shown.
        seconds: how much is shown [s].

    Returns:
        A figure on an Agg canvas: ``figure.savefig(path)`` works without a display, and pyplot is not involved.
    """
    per_task = demonstrations.per_task() if isinstance(demonstrations, Demonstrations) else dict(demonstrations)
    if not per_task:
        raise InvalidInputError("nothing to draw: there are no demonstrations")
    figure = Figure(figsize=(3.6 * len(JOINTS), 1.9 * len(per_task) + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(per_task), len(JOINTS), squeeze=False, sharex=True)
    for row, (task, rows) in enumerate(per_task.items()):
        episode = next(rows.episodes())
        shown = slice(max(episode.start, episode.stop - round(seconds * rows.control_hz)), episode.stop)
        time = np.arange(shown.stop - shown.start) / rows.control_hz
        predicted = rows.contract.to_radians(policy.predict(rows.obs[shown], deterministic=True)[0])
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
