"""A film of a policy in somebody's hands, with captions."""

from os import PathLike
from typing import Any

import gymnasium
import numpy as np

from go1_mtl_gym import BUILT_IN_TASKS
from go1_mtl_gym.validation import one_of, parameters_of
from trainers.data.environments import base_env, make_env
from trainers.evaluation.captions import draw_captions, reading
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.rollout import checked_agent
from trainers.evaluation.script import Script
from trainers.evaluation.video import Film, save_webp
from trainers.utils.validation import refuse_overridden

DEFAULT_TOUR = Script(
    moves=(  # type: ignore[arg-type]  # fields of moves
        (0.0, "trot", (0.0, 0.0, 0.0)),
        (0.8, "trot", (0.5, 0.0, 0.0)),
        (1.4, "trot", (0.9, 0.0, 0.0)),
        (2.0, "trot", (1.3, 0.0, 0.0)),
        (3.8, "trot", (0.8, 0.0, -1.2)),
        (5.2, "trot", (0.0, 0.0, 0.0)),
        (6.2, "pace", (0.9, 0.0, 0.0)),
        (7.8, "pace", (0.3, 0.4, 0.0)),
        (9.0, "bound", (0.6, 0.0, 0.0)),
        (9.8, "bound", (1.2, 0.0, 0.0)),
        (11.4, "gallop", (0.6, 0.0, 0.8)),
        (12.4, "gallop", (1.2, 0.0, 0.0)),
        (13.6, "jump", (0.4, 0.0, 0.0)),
        (14.4, "jump", (0.7, 0.0, 0.6)),
        (15.6, "walk", (0.3, 0.0, 0.0)),
        (16.4, "walk", (0.5, 0.0, 0.0)),
        (17.2, "walk", (0.2, 0.25, 0.0)),
        (18.2, "trot", (0.0, 0.0, 0.0)),
    ),
    seconds=19.4,
)
"""All six gaits, each with forward motion and most with a turn or steps to the side; from a stand to a stand."""


def film_tour(
    policy_or_expert: Any,
    script: Script = DEFAULT_TOUR,
    *,
    fps: int = 25,
    width: int = 640,
    height: int = 360,
    seed: int = 1,
    **env_kwargs: Any,
) -> np.ndarray:
    """Film what a script makes of a policy, with gait, velocities and foot contacts written into the pictures.

    Args:
        policy_or_expert: as in `trainers.evaluate`.
        script: or the dictionary of its fields, as JSON has it.
        fps: pictures per second, at most the control rate.
        width: of a picture [pixels].
        height: likewise; 16:9 leaves the middle to the robot.
        seed: of the reset.
        env_kwargs: of the environment; on top of the policy's own ``env_kwargs``. It must know all gaits of the script;
            unless told otherwise, it knows all that are registered.

    Returns:
        RGB, uint8, shape (n, height, width, 3), with n = the script's seconds times fps; after a fall the last picture
        stays.

    Raises:
        InvalidInputError: if an argument is not as described.
        go1_mtl_gym.rendering.RenderingError: if no picture can be drawn on this machine.
    """
    script = parameters_of(script, Script, "script")
    agent = checked_agent(policy_or_expert)
    refuse_overridden(env_kwargs, episode_s="script", render_mode="film_tour", task="script")
    film = Film(width, height, fps)
    kwargs = {"tasks": BUILT_IN_TASKS, **getattr(agent, "env_kwargs", {}), **env_kwargs, **film.env_kwargs}
    for task in script.task_names:
        one_of(task, tuple(kwargs["tasks"]), "task of the script")
    control_hz = 0.0

    def watch(env: gymnasium.Env, step: int) -> None:
        nonlocal control_hz
        control_hz = base_env(env).control_hz
        script.drive(env, step)
        film(env, step)

    first = script.moves[0]
    setup = EpisodeSetup(first.task, seed, script.seconds, command=first.command)
    _, series = setup.play(agent, kwargs, make_env, watch)
    frames = film.frames(round(script.seconds * fps))
    for i, frame in enumerate(frames):
        said = reading(series, round(i / fps * control_hz), script.task_names, control_hz)
        frames[i] = draw_captions(frame, said)
    return frames


def save_tour(
    policy_or_expert: Any,
    path: str | PathLike[str],
    script: Script = DEFAULT_TOUR,
    *,
    fps: int = 25,
    quality: int = 18,
    **options: Any,
) -> None:
    """Write the film of a script as an animated WebP.

    Args:
        policy_or_expert: as in `trainers.evaluate`.
        path: of the file.
        script: what is done with stick and buttons.
        fps: pictures per second.
        quality: of the pictures, 0 ... 100; the default makes 20 s of 640 x 360 pixels about 2.5 MB.
        options: of `film_tour`.

    Raises:
        InvalidInputError: if an argument is not as described.
        go1_mtl_gym.rendering.RenderingError: if no picture can be drawn on this machine.
    """
    save_webp(film_tour(policy_or_expert, script, fps=fps, **options), path, fps, quality)
