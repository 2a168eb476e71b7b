"""What the main job draws: the policy at work in every gait."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from go1_mtl_gym import TASKS
from trainers.evaluation.video import record_frames, save_gif, tile
from trainers.utils.progress import tracked

PICTURE = {"width": 280, "height": 210, "fps": 25}
SPEED = 0.8
"""Forward speed as a fraction of the largest that is drawn."""


def save_videos(policy: Any, tasks: Sequence[str], seconds: float, folder: Path, progress: bool = False) -> None:
    """Write ``<task>.gif`` for every task, and all of them side by side as ``gaits.gif``.

    Args:
        policy: with `env_kwargs`.
        tasks: that it knows.
        seconds: length of each film [s].
        folder: where the files go.
        progress: show a bar.

    Raises:
        go1_mtl_gym.rendering.RenderingError: if no picture can be drawn on this machine.
    """
    films: dict[str, np.ndarray] = {}
    for task in tracked(tasks, "videos", len(tasks), "gait", progress):
        command = (SPEED * TASKS[task].command_range[0], 0.0, 0.0)
        films[task] = record_frames(policy, task, seconds, command, **PICTURE)
        save_gif(films[task], folder / f"{task}.gif")
    save_gif(_mosaic(films), folder / "gaits.gif", PICTURE["fps"] / 2)


def _mosaic(films: Mapping[str, np.ndarray]) -> np.ndarray:
    """Every second picture, to keep the file small."""
    return tile({task: film[::2] for task, film in films.items()})
