"""The shared log: gradient steps, DAgger rounds, figures and the configuration, in TensorBoard's format."""

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from imitation.util.logger import HierarchicalLogger, make_output_format
from stable_baselines3.common.logger import Figure, Logger

from trainers.utils.files import json_ready

if TYPE_CHECKING:
    import matplotlib.figure


NOT_TEXT = ("stdout", "log", "json", "csv")
ROUND_FIGURES = ("success_rate", "survival_rate", "survival_s", "velocity_error", "yaw_rate_error", "step_rate")


def make_logger(
    folder: str | PathLike[str] | None = None, formats: Sequence[str] = ("tensorboard",)
) -> HierarchicalLogger:
    """A log that `imitation` and the trainers here share.

    Args:
        folder: where the files go; None logs nothing.
        formats: any of "tensorboard", "csv", "json", "log", "stdout".
    """
    outputs = [] if folder is None else [make_output_format(name, str(folder)) for name in formats]
    where = None if folder is None else str(folder)
    return HierarchicalLogger(Logger(where, outputs), () if folder is None else tuple(formats))


def log_round(
    logger: HierarchicalLogger,
    step: int,
    closed_loop: Mapping[str, Mapping[str, Any]] | None = None,
    offline: Mapping[str, Mapping[str, float]] | None = None,
) -> None:
    """Write the scores of one DAgger round.

    Args:
        logger: from `make_logger`.
        step: the round; 0 after cloning.
        closed_loop: task -> ``as_dict()`` of what `trainers.evaluate` returned; tags ``closed_loop/<figure>/<task>``. A
            figure that is None, because every episode fell too early, is left out.
        offline: task -> result of `trainers.offline_metrics`; tags ``offline/<figure>/<task>``.
    """
    for task, result in (closed_loop or {}).items():
        for name in ROUND_FIGURES:
            if result[name] is not None:
                logger.record(f"closed_loop/{name}/{task}", result[name])
    for task, scores in (offline or {}).items():
        for name, value in scores.items():
            logger.record(f"offline/{name}/{task}", value)
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
