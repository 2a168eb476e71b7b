"""The students of a table: trained once, measured on what was held out, and kept on disk."""

import dataclasses
import json
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import torch
from main_job.config import JobConfig
from main_job.students import new_policy
from report_parts import digest
from tqdm.auto import tqdm

import trainers
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import number_in, one_of
from paper_report.config import PRECISIONS, PaperConfig, Table
from paper_report.data import TRAIN, PaperData
from paper_report.published import KINDS, PER_GAIT, POOLED
from paper_report.sums import learner_of
from trainers.algorithms.optimizer import torch_threads
from trainers.policies.checkpoint import versions
from trainers.utils.files import write_json

UNUSED = ("steps", "seed", "log_interval", "matmul_precision", "autocast")
"""Settings of the cloning that a folder of students is not named by: files are, or they change no student."""


@dataclasses.dataclass(frozen=True)
class Student:
    """One network.

    Attributes:
        kind: one of `KINDS`.
        width: units of every hidden layer.
        seed: of its initial weights and of the order of the rows.
        precision: of its training, one of `PRECISIONS`.
        gait: the one that it learns, if its kind has a network for every gait.

    Raises:
        InvalidInputError: if there is no such kind or precision, or it is given a gait too many or too few.
    """

    kind: str
    width: int
    seed: int
    precision: str
    gait: str | None = None

    def __post_init__(self) -> None:
        one_of(self.kind, tuple(KINDS), "kind of student")
        one_of(self.precision, tuple(PRECISIONS), "precision")
        number_in(self.width, 1, 1e5, "width")
        number_in(self.seed, 0, 2**31 - 1, "training seed")
        if (self.gait is None) == (self.kind == PER_GAIT):
            raise InvalidInputError(f"a gait is expected for {PER_GAIT}, and for no other kind, got {self}")

    @property
    def name(self) -> str:
        """Of its files, up to the number of steps."""
        gait = [self.gait] if self.gait else []
        return "-".join([self.kind, *gait, str(self.width), self.precision, f"seed{self.seed}"])


def students(table: Table, kinds: Sequence[str], config: PaperConfig) -> list[Student]:
    """All students of some kinds, with the widths, seeds and precision of the settings."""
    gaits_of = {kind: table.gaits if kind == PER_GAIT else (None,) for kind in kinds}
    return [
        Student(kind, width, seed, config.precision, gait)
        for width in config.widths
        for seed in config.seeds
        for kind in kinds
        for gait in gaits_of[kind]
    ]


@dataclasses.dataclass(frozen=True)
class School:
    """Where and how the students of a table are taught.

    Attributes:
        table: which.
        config: how.
        data: their demonstrations.
        device: "cpu" or "cuda".
        threads: of a training on a CPU; their number can change the last digits.
        command: that the students are made by, written beside what is known of them.
    """

    table: Table
    config: PaperConfig
    data: PaperData
    device: str = "cpu"
    threads: int = 1
    command: str = ""

    @property
    def folder(self) -> Path:
        """Of the students' files; its name changes with how they are taught, but for `UNUSED`."""
        settings = dataclasses.asdict(self.config.bc(0, 1.0))
        used = {name: value for name, value in settings.items() if name not in UNUSED}
        return self.data.folder / f"students-{digest([repr(sorted(used.items())), self.config.normalization])}"

    def file(self, student: Student, steps: int | None = None) -> Path:
        """What is known of a student after so many gradient steps (None: `config.steps`).

        Its policy is beside it, with the suffix ``.zip``.
        """
        return self.folder / f"{student.name}-{steps or self.config.steps}steps.json"

    def new(self, student: Student) -> trainers.MultiHeadPolicy:
        """An untrained student.

        Raises:
            InvalidInputError: if the device is not there.
        """
        job = JobConfig(
            tasks=self.table.gaits,
            width=student.width,
            normalization=self.config.normalization,
            seed=student.seed,
            device=self.device,
        )
        return new_policy(job, self.table.student_kwargs, pooled=student.kind in (POOLED, PER_GAIT))

    def teach(self, student: Student, progress: bool = False) -> None:
        """Train, measure and write a student, unless it is there."""
        if not self.file(student).is_file():
            with torch_threads(self.threads):
                write_json(self.file(student), self._lesson(student, progress))

    def _lesson(self, student: Student, progress: bool) -> dict[str, Any]:
        share = 1.0 / len(self.table.gaits) if student.gait else 1.0
        config = dataclasses.replace(self.config, precision=student.precision).bc(student.seed, share)
        tests = {use: _of(student, self.data.rows(use)) for use in self.data.tests}
        shown = thinned(trainers.Demonstrations.concatenate([*tests.values()]), self.config.curve_rows)
        policy, rows = self.new(student), _of(student, self.data.rows(TRAIN))
        start = time.monotonic()
        history = trainers.train_bc(policy, rows, config, validation=shown, progress=progress)
        seconds = time.monotonic() - start
        policy.save(self.file(student).with_suffix(".zip"))
        return {
            **dataclasses.asdict(student),
            "steps": config.steps,
            "scores": {use: trainers.offline_metrics(policy, own) for use, own in tests.items()},
            "curve": {"steps": history.steps, "mse": curve(history.r2, shown)},
            "seconds": round(seconds, 1),
            "samples_per_s": round(config.steps * config.batch_size / seconds),
            "device": torch.cuda.get_device_name() if policy.device.type == "cuda" else "cpu",
            "threads": self.threads,
            "command": self.command,
            "versions": versions(),
        }

    def finished(self, kinds: Sequence[str]) -> list[dict[str, Any]]:
        """All students of some kinds that are there, of whatever width, precision, seed and steps, in a fixed order."""
        found = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(self.folder.glob("*.json"))]
        kept = [own for own in found if own["kind"] in kinds]
        return sorted(kept, key=lambda own: (learner_of(own), own["seed"]))

    def widest(self, kind: str) -> trainers.MultiHeadPolicy | None:
        """The finished student of a kind with most units, then steps, then the first seed; None if there is none."""
        found = self.finished([kind])
        if not found:
            return None
        own = max(found, key=lambda own: (own["width"], own["steps"], -own["seed"]))
        student = Student(**{each.name: own[each.name] for each in dataclasses.fields(Student)})
        return trainers.load(self.file(student, own["steps"]).with_suffix(".zip"))


def teach_all(school: School, wanted: Sequence[Student], n_jobs: int) -> None:
    """Make the students that are not there yet, in processes side by side."""
    left = [student for student in wanted if not school.file(student).is_file()]
    with tqdm(total=len(wanted), initial=len(wanted) - len(left), desc="students", unit="student") as bar:
        for _ in _taught(school, left, n_jobs):
            bar.update()


def _taught(school: School, left: Sequence[Student], n_jobs: int) -> Iterator[None]:
    if n_jobs == 1:
        yield from (school.teach(student, progress=True) for student in left)
    else:
        parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator_unordered")
        yield from parallel(joblib.delayed(school.teach)(student) for student in left)


def thinned(rows: trainers.Demonstrations, per_gait: int) -> trainers.Demonstrations:
    """At most so many rows of every gait, drawn at random: evenly spaced ones would meet few phases of a cycle."""
    rng = np.random.default_rng(per_gait)
    parts = [
        own.take(np.sort(rng.choice(len(own), min(per_gait, len(own)), replace=False)))
        for own in rows.per_task().values()
    ]
    return trainers.Demonstrations.concatenate(parts)


def curve(r2: dict[str, list[float]], rows: trainers.Demonstrations) -> dict[str, list[float]]:
    """Mean squared error behind every R2, mse = (1 - R2) times the variance of the joints about their own means.

    Args:
        r2: gait -> R2 on these rows, over the steps; see `trainers.evaluation.metrics.regression_metrics`.
        rows: that they were measured on.

    Returns:
        gait -> mean squared error of the joint targets [rad^2].
    """
    variance = {gait: float((own.half_range * own.acts).var(axis=0).mean()) for gait, own in rows.per_task().items()}
    return {gait: [(1.0 - value) * variance[gait] for value in values] for gait, values in r2.items()}


def _of(student: Student, rows: trainers.Demonstrations) -> trainers.Demonstrations:
    """The rows of the gaits that a student learns."""
    return rows.per_task()[student.gait] if student.gait else rows
