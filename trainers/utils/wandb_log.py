"""The shared log in Weights & Biases, where its package is installed and it is asked for."""

import importlib.util
import io
import os
import uuid
from pathlib import Path
from typing import Any

import PIL.Image
from stable_baselines3.common.logger import Figure, HParam, Image, KVWriter, Video

from go1_mtl_gym.errors import InvalidInputError
from trainers.utils.gif import Gif

PROJECT = "go1-mtl-gym"
"""Of the runs, unless the environment variable WANDB_PROJECT names another."""
STEP = "step"
"""The axis that everything is drawn over: the log's own, which may go back when a run goes on after an interruption."""


def check_wandb() -> None:
    """Say what to install, before anything begins.

    Raises:
        InvalidInputError: if the package is not there.
    """
    if importlib.util.find_spec("wandb") is None:
        raise InvalidInputError(
            'the package wandb was expected, which logs to Weights & Biases, got none: pip install "wandb>=0.20", or '
            "the extra `tools`"
        )


class WeightsAndBiases(KVWriter):
    """Writes numbers, pictures, films and settings as one run of Weights & Biases, named after its folder.

    Where it goes is said as anywhere else with that service: ``wandb login``, or the environment variables WANDB_MODE
    ("offline" needs neither account nor network), WANDB_PROJECT, WANDB_ENTITY. A log that is opened again in the same
    folder goes on in the same run.

    Args:
        folder: of the run; what is not sent at once lies below it.

    Raises:
        InvalidInputError: if the package is not installed.
    """

    def __init__(self, folder: str) -> None:
        check_wandb()
        import wandb

        self._wandb = wandb
        self._run = wandb.init(
            project=os.environ.get("WANDB_PROJECT", PROJECT),
            name=Path(folder).resolve().name,
            id=_run_id(Path(folder)),
            dir=folder,
            resume="allow",
            reinit="create_new",  # beside a run that the caller may have
        )
        self._run.define_metric("*", step_metric=STEP)

    def write(self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0) -> None:
        """Write what was recorded since the last time.

        Args:
            key_values: tag -> value.
            key_excluded: tag -> formats that it is not for; what is not for TensorBoard is not for this either.
            step: on the log's axis.
        """
        drawn: dict[str, Any] = {}
        for tag, value in key_values.items():
            if {"wandb", "tensorboard"} & set(key_excluded.get(tag) or ()):
                continue
            if isinstance(value, HParam):
                self._run.config.update(value.hparam_dict, allow_val_change=True)
            elif isinstance(value, str):
                self._run.config.update({tag: value}, allow_val_change=True)
            else:
                drawn[tag] = self._form(value)
        if drawn:
            self._run.log(drawn | {STEP: step})

    def _form(self, value: Any) -> Any:
        """A value as Weights & Biases takes it."""
        if isinstance(value, Figure):
            drawn = io.BytesIO()  # drawn here: the package knows figures of pyplot's alone
            value.figure.savefig(drawn, format="png")
            return self._wandb.Image(PIL.Image.open(drawn))
        if isinstance(value, Image):
            return self._wandb.Image(value.image)
        if isinstance(value, Gif):
            return self._wandb.Video(io.BytesIO(value.content), format="gif")
        if isinstance(value, Video):
            return self._wandb.Video(value.frames[0].numpy(), fps=int(value.fps))
        return float(value)

    def close(self) -> None:
        """End the run; what is to be sent is sent."""
        self._run.finish()


def _run_id(folder: Path) -> str:
    """The run's name for the service, drawn once per folder."""
    path = folder / "wandb_run_id"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(uuid.uuid4().hex[:8], encoding="utf-8")
    return path.read_text(encoding="utf-8").strip()
