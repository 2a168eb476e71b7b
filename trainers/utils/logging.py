"""The shared log of gradient steps, DAgger rounds, figures and the configuration, for TensorBoard and others."""

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from imitation.util.logger import HierarchicalLogger, make_output_format
from stable_baselines3.common.logger import Figure, HParam, KVWriter, Logger
from tensorboard.compat.proto.summary_pb2 import Summary

from trainers.utils.files import json_ready
from trainers.utils.gif import Gif
from trainers.utils.wandb_log import WeightsAndBiases

if TYPE_CHECKING:
    import matplotlib.figure


NOT_TEXT = ("stdout", "log", "json", "csv")
ROUND_FIGURES = ("success_rate", "survival_rate", "velocity_error", "yaw_rate_error", "step_rate")


class TensorBoard(KVWriter):
    """Writes for TensorBoard, which draws a card per tag and a line per run: the gaits of a figure share its card.

    What is recorded as ``group/figure/task`` becomes the tag ``group/figure`` of the run ``<folder>/<task>``.

    Args:
        folder: of the run.
    """

    def __init__(self, folder: str) -> None:
        self._folder = folder
        self._writers: dict[str, Any] = {"": make_output_format("tensorboard", folder)}

    def write(self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0) -> None:
        """Write what was recorded since the last time.

        Args:
            key_values: tag -> value.
            key_excluded: tag -> formats that it is not for.
            step: on the log's axis.
        """
        runs: dict[str, dict[str, str]] = {}
        for key in key_values:
            group, _, task = key.rpartition("/") if key.count("/") == 2 else (key, "", "")
            runs.setdefault(task, {})[key] = group
        for task, tags in runs.items():
            if task not in self._writers:
                self._writers[task] = make_output_format("tensorboard", str(Path(self._folder) / task))
            writer = self._writers[task]
            values = {tag: key_values[key] for key, tag in tags.items()}
            films = {tag: values.pop(tag) for tag, value in list(values.items()) if isinstance(value, Gif)}
            writer.write(values, {tag: key_excluded.get(key, ()) for key, tag in tags.items() if tag in values}, step)
            for tag, film in films.items():  # stable-baselines3's own films need moviepy, to become just such a file
                image = Summary.Image(height=film.height, width=film.width, encoded_image_string=film.content)
                summary = Summary(value=[Summary.Value(tag=tag, image=image)])
                writer.writer.file_writer.add_summary(summary, step)
                writer.writer.flush()

    def close(self) -> None:
        """Close all files."""
        for writer in self._writers.values():
            writer.close()


def make_logger(
    folder: str | PathLike[str] | None = None, formats: Sequence[str] = ("tensorboard",)
) -> HierarchicalLogger:
    """A log that `imitation` and the trainers here share.

    Args:
        folder: where the files go; None logs nothing.
        formats: any of "tensorboard", "wandb", "csv", "json", "log", "stdout"; "wandb" is Weights & Biases, see
            `trainers.utils.wandb_log.WeightsAndBiases`.

    Raises:
        InvalidInputError: for "wandb" if its package is not installed.
    """
    outputs = [] if folder is None else [_output(name, str(folder)) for name in formats]
    where = None if folder is None else str(folder)
    return HierarchicalLogger(Logger(where, outputs), () if folder is None else tuple(formats))


def _output(name: str, folder: str) -> KVWriter:
    own = {"tensorboard": TensorBoard, "wandb": WeightsAndBiases}
    return own[name](folder) if name in own else make_output_format(name, folder)


def log_round(
    logger: HierarchicalLogger,
    step: int,
    closed_loop: Mapping[str, Mapping[str, Any]] | None = None,
    offline: Mapping[str, Mapping[str, float]] | None = None,
    certified: Mapping[str, float] | None = None,
) -> None:
    """Write the scores of one DAgger round.

    Args:
        logger: from `make_logger`.
        step: on the log's axis; gradient steps, in the main job.
        closed_loop: task -> ``as_dict()`` of what `trainers.evaluate` returned; recorded as
            ``closed_loop/<figure>/<task>``. A figure that is None, because every episode fell too early, is left out.
        offline: task -> result of `trainers.offline_metrics`; tags ``offline/<figure>/<task>``.
        certified: figures of all gaits together; tags ``certificate/<figure>``.
    """
    for task, result in (closed_loop or {}).items():
        for name in ROUND_FIGURES:
            if result[name] is not None:
                logger.record(f"closed_loop/{name}/{task}", result[name])
    for task, scores in (offline or {}).items():
        for name, value in scores.items():
            logger.record(f"offline/{name}/{task}", value)
    for name, value in (certified or {}).items():
        logger.record(f"certificate/{name}", value)
    logger.dump(step)


def log_text(logger: HierarchicalLogger, tag: str, value: Any, step: int = 0) -> None:
    """Write text; anything but a string is shown as indented JSON (the configuration, for one)."""
    text = value if isinstance(value, str) else "```\n" + json.dumps(json_ready(value), indent=2, default=str) + "\n```"
    logger.record(tag, text, exclude=NOT_TEXT)
    logger.dump(step)


def log_figure(logger: HierarchicalLogger, tag: str, figure: "matplotlib.figure.Figure", step: int = 0) -> None:
    """Write a matplotlib figure."""
    logger.record(tag, Figure(figure, close=False), exclude=NOT_TEXT)
    logger.dump(step)


def log_film(logger: HierarchicalLogger, tag: str, film: Gif, step: int = 0) -> None:
    """Write a moving picture, which TensorBoard plays among its images."""
    logger.record(tag, film, exclude=NOT_TEXT)
    logger.dump(step)


def log_settings(
    logger: HierarchicalLogger, settings: Mapping[str, Any], results: Mapping[str, float], step: int = 0
) -> None:
    """Write what runs are compared by, for TensorBoard's page "HParams".

    Args:
        logger: from `make_logger`.
        settings: JSON values; those of nested ones go by "outer.inner".
        results: tag -> value, which are scalars of the log too.
        step: on the log's axis.
    """
    for tag, value in results.items():
        logger.record(tag, value)
    logger.record("hparams", HParam(_flat(settings), dict(results)), exclude=NOT_TEXT)
    logger.dump(step)


def _flat(settings: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Numbers, booleans and text; sequences as text, None left out."""
    flat: dict[str, Any] = {}
    for name, value in settings.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{name}.")
        elif value is not None:
            flat[f"{prefix}{name}"] = value if isinstance(value, (bool, int, float, str)) else json.dumps(value)
    return flat
