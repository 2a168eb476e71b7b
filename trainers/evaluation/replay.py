"""An episode of a certificate once more, to be looked at."""

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import integer_in
from trainers.data.environments import EnvFactory, make_env
from trainers.evaluation.agents import opened
from trainers.evaluation.cells import Cell
from trainers.evaluation.certificate import Certificate
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.video import Film, save_gif, tile
from trainers.utils.validation import positive

AFTERMATH_S = 1.0
"""How long the picture of the failure stays, or the film goes on [s]."""


def replay(
    certificate: Certificate | Mapping[str, Any] | str | PathLike[str],
    episode: str,
    policy_or_expert: Any,
    *,
    seconds: float = 8.0,
    fps: int = 25,
    width: int = 320,
    height: int = 240,
    make_env: EnvFactory = make_env,
) -> np.ndarray:
    """Film an episode of a certificate: the same hands, in the same world, from the same seed.

    With the certificate's policy it is the same episode; another one shows what it does in its place.

    Args:
        certificate: or its JSON values, its file, or its folder.
        episode: "condition/task/number", as the page lists them: "operator/trot/17", "tour/all gaits/3".
        policy_or_expert: as in `trainers.certify`.
        seconds: how much of it [s]: of a failed episode the time before its failure, otherwise from the start.
        fps: pictures per second.
        width: of a picture [pixels].
        height: likewise.
        make_env: another environment factory.

    Returns:
        RGB, uint8, shape (n, height, width, 3), with the episode's name in the upper left corner.

    Raises:
        InvalidInputError: if the certificate has no such episode, or an argument is not as described.
        go1_mtl_gym.rendering.RenderingError: if no picture can be drawn on this machine.
    """
    if isinstance(certificate, Mapping):
        certificate = Certificate.from_dict(certificate)
    elif not isinstance(certificate, Certificate):
        certificate = Certificate.read(certificate)
    seconds, agent = positive(seconds, "seconds"), opened(policy_or_expert)
    cell, number, setup = certified_episode(certificate, episode)
    failed_s = {each.number: each.cause.time_s for each in cell.failures}.get(number, seconds)
    film = Film(width, height, fps, max(0.0, failed_s - seconds))
    kwargs = {**certificate.settings.arguments(agent, cell.condition), **film.env_kwargs}
    setup.play(agent, kwargs, make_env, film)
    return tile({episode: film.frames(max(1, round((min(failed_s, seconds) + AFTERMATH_S) * fps)))})


def certified_episode(certificate: Certificate, episode: str) -> tuple[Cell, int, EpisodeSetup]:
    """An episode of a certificate: its cell, its number, and all that it depends on besides who drives.

    Args:
        certificate: whose.
        episode: as in `replay`.

    Raises:
        InvalidInputError: if there is none.
    """
    condition, task, number = _parts(episode)
    cell = certificate.cell(condition, task)
    integer_in(number, 0, cell.trials - 1, f"number of an episode of {cell.name}")
    return cell, number, certificate.settings.setup(cell.condition, cell.task, number)


def film_failures(certificate: Certificate, policy_or_expert: Any, folder: Path, count: int, fps: int = 25) -> None:
    """Write GIFs of the first failed episodes, in turn of the cells that have some: ``condition-task-number.gif``.

    Args:
        certificate: whose.
        policy_or_expert: that it is of.
        folder: where they go.
        count: how many at most.
        fps: pictures per second.
    """
    ranked = [(place, cell.name, each.number) for cell in certificate.cells for place, each in enumerate(cell.failures)]
    for _, name, number in sorted(ranked, key=lambda entry: entry[0])[:count]:
        episode = f"{name}/{number}"
        frames = replay(certificate, episode, policy_or_expert, fps=fps)
        save_gif(frames, folder / f"{episode.replace('/', '-').replace(' ', '_')}.gif", fps)


def _parts(episode: str) -> tuple[str, str, int]:
    parts = episode.split("/") if isinstance(episode, str) else ()
    if len(parts) != 3 or not (parts[2].isascii() and parts[2].isdigit()):
        raise InvalidInputError(f'an episode is "condition/task/number", such as "operator/trot/17", got {episode!r}')
    return parts[0], parts[1], int(parts[2])
