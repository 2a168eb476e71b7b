"""What the main job draws: the policy at work in every gait."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from go1_mtl_gym import TASKS
from trainers.evaluation.video import record_frames, save_gif, tile
from trainers.utils.progress import tracked

PICTURE = {"width": 280, "height": 210, "fps": 25}
SMALL_PICTURE: dict[str, int] = {"width": 160, "height": 120, "fps": 10}
"""Of the film of a round."""
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
        films[task] = _film(policy, task, seconds, PICTURE)
        save_gif(films[task], folder / f"{task}.gif")
    save_gif(_mosaic(films), folder / "gaits.gif", PICTURE["fps"] / 2)


def save_small_video(policy: Any, tasks: Sequence[str], seconds: float, path: Path) -> None:
    """Write a small film of all tasks side by side.

    Args:
        policy: with `env_kwargs`.
        tasks: that it knows.
        seconds: its length [s].
        path: of the GIF.

    Raises:
        go1_mtl_gym.rendering.RenderingError: if no picture can be drawn on this machine.
    """
    films = {task: _film(policy, task, seconds, SMALL_PICTURE) for task in tasks}
    save_gif(tile(films), path, SMALL_PICTURE["fps"])


def _film(policy: Any, task: str, seconds: float, how: Mapping[str, int]) -> np.ndarray:
    """A task at `SPEED` from a standing start."""
    return record_frames(policy, task, seconds, (SPEED * TASKS[task].command_range[0], 0.0, 0.0), **how)


def _mosaic(films: Mapping[str, np.ndarray]) -> np.ndarray:
    """Every second picture, to keep the file small."""
    return tile({task: film[::2] for task, film in films.items()})
