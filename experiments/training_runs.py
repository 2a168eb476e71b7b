"""Policies that a study trains: the main job's, and those of demonstrations that its cells share."""

import contextlib
import dataclasses
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import trainers
from experiments.agents import PolicyFile
from experiments.study import TRAINING_CODE, code_digest, digest
from trainers.algorithms.optimizer import torch_threads
from trainers.pipeline.config import JobConfig
from trainers.pipeline.job import Job
from trainers.pipeline.new_policy import new_policy
from trainers.policies.checkpoint import versions
from trainers.utils.files import write_json

UNUSED = (
    *("preset", "n_envs", "device", "threads", "episodes", "round_video_s", "video_s", "wandb"),
    *("phase_free_s", "phase_free_history", "phase_free_steps"),
)
"""Settings of the main job that its policies do not depend on, run as here."""
HELD_OUT = "held_out.json"
"""File of the one-step errors on held-out rows, and of the time; the last that a run writes."""

QUICK_JOB = {
    "tasks": ("trot", "bound"),
    "width": 64,
    "batch_size": 256,
    "shard_s": 2.0,
    "clean_s": 2.0,
    "perturbed_s": 2.0,
    "hard_push_s": 0.0,
    "randomized_s": 0.0,
    "held_out_s": 2.0,
    "clone_steps": 60,
    "episodes": 1,
    "episode_s": 2.5,
}
"""Settings of the main job where a quick run of a study trains with some of its parts."""


@dataclass(frozen=True)
class TrainingRun:
    """The main job's policy with a clock, without evaluation and pictures, on one thread of one process.

    Its folder's name stands for its settings and the code: made again, it is read; interrupted, it goes on. Bars and
    messages go to ``progress.log``. A main job with equal settings on one thread gives an equal policy.

    Attributes:
        config: of the main job; `UNUSED` settings are ignored.
        root: of all runs' folders.
    """

    config: JobConfig
    root: Path

    @property
    def folder(self) -> Path:
        """Named by the seed, all settings but the `UNUSED`, the code and the versions."""
        used = {name: value for name, value in dataclasses.asdict(self.config).items() if name not in UNUSED}
        words = (repr(sorted(used.items())), code_digest(TRAINING_CODE), repr(versions()))
        return self.root / f"seed-{self.config.seed}-{digest(words)}"

    @property
    def policy(self) -> Path:
        """File of the policy."""
        return self.folder / "policy.zip"

    @property
    def held_out(self) -> dict[str, dict[str, float]]:
        """Gait -> one-step errors on held-out rows of a finished run, as `trainers.offline_metrics` gives them."""
        return self._finished()["tasks"]

    def make(self) -> float:
        """Train what is not trained yet; returns how long it took [s].

        Raises:
            InvalidInputError: if a setting cannot be.
        """
        if not (self.folder / HELD_OUT).is_file():
            self.folder.mkdir(parents=True, exist_ok=True)
            with (
                open(self.folder / "progress.log", "a", encoding="utf-8") as log,
                torch_threads(1),
                contextlib.redirect_stderr(log),
                contextlib.redirect_stdout(log),
            ):
                self._train()
        return self._finished()["seconds"]

    def _train(self) -> None:
        defaults = {each.name: each.default for each in dataclasses.fields(JobConfig) if each.name in UNUSED}
        here = {"n_envs": 1, "round_video_s": 0.0}
        job = Job(dataclasses.replace(self.config, **defaults | here), self.folder)
        train, held_out = job.demonstrations()
        policy = job.dagger(job.clone(train, held_out), train, held_out)
        errors = trainers.offline_metrics(policy, held_out)
        write_json(self.folder / HELD_OUT, {"tasks": errors, "seconds": round(sum(job.folder.seconds.values()), 1)})

    def _finished(self) -> dict[str, Any]:
        return json.loads((self.folder / HELD_OUT).read_text(encoding="utf-8"))


@dataclass(frozen=True)
class TrainedPolicy(PolicyFile):
    """A policy of a training run, which is made before anything is measured.

    Attributes:
        run: a `TrainingRun`, or what else has a method `make`; two agents may be of one.
    """

    run: Any = field(kw_only=True)

    @property
    def origin(self) -> Any:
        """The run."""
        return self.run

    def prepare(self) -> float:
        return self.run.make()


def changed(config: JobConfig) -> dict[str, Any]:
    """The settings that are not the main job's defaults and that its policies depend on."""
    default, given = JobConfig().as_dict(), config.as_dict()
    return {name: value for name, value in given.items() if name not in UNUSED and value != default[name]}


# -- What cells share --------------------------------------------------------------------------------------------------


def collect(jobs: Iterable[trainers.CollectJob], folder: Path, n_jobs: int) -> None:
    """Have everything demonstrated that the cells of a folder learn from."""
    trainers.collect_all(list(jobs), folder / "demonstrations", n_jobs, progress=True)


def rows_of(jobs: Sequence[trainers.CollectJob], folder: Path) -> trainers.Demonstrations:
    """The rows of some demonstrations; those that are not in the folder yet are made."""
    paths = trainers.collect_all(jobs, folder / "demonstrations")
    return trainers.Demonstrations.concatenate([trainers.Demonstrations.load(path) for path in paths])


def cloned(job: JobConfig, rows: trainers.Demonstrations) -> trainers.MultiHeadPolicy:
    """A new policy of a job that has learned from some rows by behavior cloning."""
    policy = new_policy(job, job.env_kwargs)
    trainers.train_bc(policy, rows, job.bc)
    return policy


def kept_policy(path: Path, train: Callable[[], Any]) -> Any:
    """A policy: read if it is there, else trained and written."""
    if not path.is_file():
        train().save(path)
    return trainers.load(path)
