"""Students as the main job makes them, one process and one thread each; whatever is finished is kept."""

import contextlib
import dataclasses
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import joblib
from main_job.config import JobConfig
from report_parts import digest
from tqdm.auto import tqdm

import trainers
from trainers.algorithms.optimizer import torch_threads
from trainers.utils.files import write_json

UNUSED = ("preset", "n_envs", "device", "threads", "episodes", "video_s")
"""Settings of the main job that a lesson does not use; the others tell one student from another."""


@dataclass(frozen=True)
class Student:
    """A student on disk.

    Attributes:
        folder: of the lesson, as the main job's ``--out``.
        policy: file of the student.
        phase_free: file of the same without a clock; None if the settings ask for none.
        held_out: gait -> one-step errors on the held-out rows, as `trainers.offline_metrics` gives them.
        seconds: that the lesson took [s].
    """

    folder: Path
    policy: Path
    phase_free: Path | None
    held_out: dict[str, dict[str, float]]
    seconds: float


def teach(config: JobConfig, root: Path) -> Student:
    """Make the student that the main job would make, without its baselines, evaluation and pictures.

    It is made on one thread of this process, and a folder's name stands for its settings: called again, this reads what
    is there, and after an interruption it goes on. Bars and messages go to ``progress.log`` in the folder. An equal
    main job on one thread gives an equal student.

    Args:
        config: of the main job; `UNUSED` settings are ignored.
        root: of all lessons' folders.

    Raises:
        InvalidInputError: if a setting cannot be.
    """
    folder = root / lesson_name(config)
    done = folder / "lesson.json"
    if not done.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        with open(folder / "progress.log", "a", encoding="utf-8") as log, _alone(log):
            write_json(done, _lesson(config, folder))
    phase_free = folder / "phase_free.zip"
    found = json.loads(done.read_text(encoding="utf-8"))
    return Student(folder, folder / "policy.zip", phase_free if phase_free.is_file() else None, **found)


def teach_all(lessons: Mapping[str, JobConfig], root: Path, n_jobs: int) -> dict[str, Student]:
    """Several students, in processes side by side.

    Args:
        lessons: name -> settings; equal settings are one lesson.
        root: of all lessons' folders.
        n_jobs: processes.
    """
    different = {lesson_name(config): config for config in lessons.values()}
    parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator")
    calls = (joblib.delayed(teach)(config, root) for config in different.values())
    taught = list(tqdm(parallel(calls), "students", len(different), unit="student"))
    students = dict(zip(different, taught, strict=True))
    return {name: students[lesson_name(config)] for name, config in lessons.items()}


def lesson_name(config: JobConfig) -> str:
    """Name of a lesson's folder: the seed, and a digest of all settings but the `UNUSED`."""
    settings = dataclasses.asdict(config)
    used = {name: value for name, value in settings.items() if name not in UNUSED}
    return f"seed-{config.seed}-{digest([repr(sorted(used.items()))])}"


def _lesson(config: JobConfig, folder: Path) -> dict[str, Any]:
    """Make the students; returns the attributes of `Student` that are no files."""
    from dagger import Job  # tries out OpenGL, for which nobody should wait who makes no student

    defaults = {each.name: each.default for each in dataclasses.fields(JobConfig) if each.name in UNUSED}
    job = Job(dataclasses.replace(config, **defaults | {"n_envs": 1}), folder)
    train, held_out = job.demonstrations()
    student = job.student(train, held_out)
    job.phase_free(student)
    return {"held_out": trainers.offline_metrics(student, held_out), "seconds": round(sum(job.seconds.values()), 1)}


@contextlib.contextmanager
def _alone(log: TextIO) -> Iterator[None]:
    """On one thread, and without a word but in `log`."""
    with torch_threads(1), contextlib.redirect_stderr(log), contextlib.redirect_stdout(log):
        yield
