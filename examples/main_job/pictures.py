"""What the main job draws: joint targets against the expert's, and the student at work in every gait."""

from pathlib import Path
from typing import Any

from tqdm.auto import tqdm

import trainers
from go1_mtl_gym import TASKS
from go1_mtl_gym.rendering import RenderingError
from main_job.config import JobConfig

PICTURE = {"width": 280, "height": 210, "fps": 25}


def draw(
    config: JobConfig, out: Path, policy: Any, held_out: trainers.Demonstrations, logger: Any, no_gl: str | None
) -> None:
    """Write ``joint_targets.png``, and a video of the student in every gait where OpenGL is to be had.

    Args:
        config: of the run.
        out: its folder.
        policy: the student.
        held_out: rows with the expert's joint targets.
        logger: of the run.
        no_gl: why there is no OpenGL, or None.
    """
    figure = trainers.joint_target_figure(policy, held_out)
    figure.savefig(out / "joint_targets.png", dpi=120)
    trainers.log_figure(logger, "joint_targets", figure)
    if no_gl:
        print(f"no videos: {no_gl}")
        return
    frames = {}
    try:
        for task in tqdm(config.tasks, "videos", unit="gait"):
            command = (0.8 * TASKS[task].command_range[0], 0.0, 0.0)
            frames[task] = trainers.record_frames(policy, task, config.video_s, command, **PICTURE)
            trainers.save_gif(frames[task], out / f"{task}.gif")
    except RenderingError as error:
        print(f"no videos: {error}")
        return
    mosaic = trainers.tile({task: film[::2] for task, film in frames.items()})
    trainers.save_gif(mosaic, out / "gaits.gif", PICTURE["fps"] / 2)
