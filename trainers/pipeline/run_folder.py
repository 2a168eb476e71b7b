"""The folder of one training run: where its files are, whose it is, and how long each stage took."""

import contextlib
import dataclasses
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from go1_mtl_gym.errors import InvalidInputError
from trainers.pipeline.config import JobConfig
from trainers.utils.files import read_object, write_json

NOT_SETTINGS = ("n_envs", "threads", "round_video_s", "wandb")
"""Fields of `JobConfig` that may change when an interrupted run goes on."""


@dataclasses.dataclass
class RunFolder:
    """Paths of a run's files; nothing is written before `claim`.

    Attributes:
        path: the folder.
        seconds: stage -> wall time [s], of earlier, interrupted runs too.
    """

    path: Path
    seconds: dict[str, float] = dataclasses.field(default_factory=dict)

    @property
    def parts(self) -> Path:
        """Intermediate results, from which an interrupted run goes on."""
        return self.path / "parts"

    @property
    def policy(self) -> Path:
        """The trained policy."""
        return self.path / "policy.zip"

    @property
    def phase_free(self) -> Path:
        """The same without a clock."""
        return self.path / "phase_free.zip"

    @property
    def cloned(self) -> Path:
        """The policy before the DAgger rounds."""
        return self.parts / "cloned.zip"

    @property
    def all_rows(self) -> Path:
        """All rows that the policy learned from, for the baselines."""
        return self.parts / "all_rows.npz"

    @property
    def metrics(self) -> Path:
        """Everything that was measured."""
        return self.path / "metrics.json"

    @property
    def tensorboard(self) -> Path:
        """The log, to be given to TensorBoard."""
        return self.path / "tensorboard"

    @property
    def log(self) -> Path:
        """The log's own folder, by whose name TensorBoard calls the run."""
        return self.tensorboard / self.path.resolve().name

    def closed_loop(self, agent: str, task: str, protocol: str) -> Path:
        """Scores of one agent in one task."""
        return self.parts / "closed_loop" / f"{agent}-{task}-{protocol}.json"

    # -- Housekeeping --------------------------------------------------------------------------------------------------

    def film(self, round_num: int) -> Path:
        """The small film of the policy after so many DAgger rounds."""
        return self.parts / f"round-{round_num}.gif"

    def claim(self, config: JobConfig) -> None:
        """Write the settings into the folder, or see that those in it are the same, and read the times so far.

        Raises:
            InvalidInputError: if it cannot be made, or holds a run with other settings.
        """
        settings = {name: value for name, value in config.as_dict().items() if name not in NOT_SETTINGS}
        known = _read_settings(self.path)
        if known is None:
            _write_settings(self.path, settings)
        elif known != settings:
            changed = ", ".join(sorted(name for name in settings if known.get(name) != settings[name]))
            raise InvalidInputError(f"{self.path} holds a run with other settings ({changed}); choose another --out")
        self.seconds = read_object(self._times, "list of times") if self._times.is_file() else {}

    @contextlib.contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the wall time of a stage to what earlier, interrupted runs took for it."""
        start = time.monotonic()
        try:
            yield
        finally:
            self.seconds[name] = round(self.seconds.get(name, 0.0) + time.monotonic() - start, 1)
            write_json(self._times, self.seconds)

    @property
    def _times(self) -> Path:
        return self.parts / "seconds.json"


def _read_settings(folder: Path) -> dict[str, Any] | None:
    path = folder / "config.json"
    if folder.exists() and not folder.is_dir():
        raise InvalidInputError(f"a folder of a training run or a new one was expected, got the file {folder}")
    return read_object(path, "file of settings of a training run") if path.exists() else None


def _write_settings(folder: Path, settings: dict[str, Any]) -> None:
    try:
        write_json(folder / "config.json", settings)
    except OSError as error:
        raise InvalidInputError(f"a folder that can be written to was expected, got {folder}: {error}") from error
