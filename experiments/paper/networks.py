"""The policies of a table: trained once, measured on what was held out, and kept on disk."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

import trainers
from experiments.paper.published import POOLED
from experiments.paper.settings import NAMED, TRAIN, UNSEEN, PaperOptions, Table, shard_jobs
from experiments.training_runs import rows_of
from trainers.algorithms.optimizer import torch_threads
from trainers.pipeline.config import JobConfig
from trainers.pipeline.new_policy import new_policy


@dataclass(frozen=True)
class Network:
    """One policy of a table, and its data.

    Attributes:
        table: which.
        options: how it is trained.
        folder: of demonstrations and policies.
        kind: one of `published.KINDS`.
        width: units of every hidden layer.
        seed: of its initial weights and of the order of the rows.
        gait: the one that it learns, if its kind has a network for every gait.
    """

    table: Table
    options: PaperOptions
    folder: Path
    kind: str
    width: int
    seed: int
    gait: str | None = None

    @property
    def file(self) -> Path:
        """Of the trained policy."""
        words = [self.kind, self.gait, self.width, self.options.precision, f"seed{self.seed}", self.options.steps]
        return self.folder / "policies" / f"{'-'.join(str(word) for word in words if word)}.zip"

    def new(self) -> trainers.MultiHeadPolicy:
        """The untrained policy."""
        options = self.options
        network = {"width": self.width, "normalization": options.normalization}
        job = JobConfig(tasks=self.table.gaits, seed=self.seed, device=options.device, **network)
        pooled = self.kind == POOLED or self.gait is not None
        return new_policy(job, self.table.policy_kwargs, pooled=pooled)

    def train(self) -> list[dict[str, Any]]:
        """Train, keep and measure.

        Returns:
            Records of the one-step errors by held-out rows and gait; of the training; and of the held-out loss over its
            steps by gait.
        """
        options = self.options
        bc = options.bc(self.seed, 1.0 / len(self.table.gaits) if self.gait else 1.0)
        tests = {use: self._known(rows) for use, rows in held_out(self.table, options, self.folder).items()}
        shown = thinned(trainers.Demonstrations.concatenate([*tests.values()]), options.curve_rows)
        policy, rows = self.new(), self._known(rows_of(shard_jobs(self.table, options)[TRAIN], self.folder))
        start = time.monotonic()
        with torch_threads(options.threads):
            history = trainers.train_bc(policy, rows, bc, validation=shown)
        seconds = time.monotonic() - start
        policy.save(self.file)
        errors = {use: trainers.offline_metrics(policy, rows) for use, rows in tests.items()}
        about = {"width": self.width, "steps": bc.steps, "precision": options.precision}
        training = {
            "seconds": round(seconds, 1),
            "samples_per_s": round(bc.steps * bc.batch_size / seconds),
            "device": torch.cuda.get_device_name() if policy.device.type == "cuda" else "cpu",
            "threads": options.threads,
        }
        curves = curve(history.r2, shown)
        return [
            *(
                {"task": gait, "condition": use, **about, **metrics}
                for use, gaits in errors.items()
                for gait, metrics in gaits.items()
            ),
            {"condition": "training", **about, **training},
            *(
                {"task": gait, "condition": "curve", **about, "at_step": history.steps, "curve_mse": mse}
                for gait, mse in curves.items()
            ),
        ]

    def _known(self, rows: trainers.Demonstrations) -> trainers.Demonstrations:
        """The rows of the gaits that it learns."""
        return rows.per_task()[self.gait] if self.gait else rows


def held_out(table: Table, options: PaperOptions, folder: Path) -> dict[str, trainers.Demonstrations]:
    """Use -> the rows that nobody is trained on."""
    jobs = shard_jobs(table, options)
    return {use: rows_of(jobs[use], folder) for use in (NAMED, UNSEEN) if jobs[use]}


def account(table: Table, options: PaperOptions, folder: Path) -> list[dict[str, Any]]:
    """Records of the seconds of rows and of the expert's falls, by use and gait.

    A shard holds one episode, and one more for every fall of the expert; the end before a fall is not kept.
    """
    records = []
    for use, jobs in shard_jobs(table, options).items():
        for gait in table.gaits:
            shards = [rows_of([job], folder) for job in jobs if job.task == gait]
            if shards:
                falls = sum(int(shard.starts.sum()) - 1 for shard in shards)
                data_s = sum(shard.seconds for shard in shards)
                records.append({"task": gait, "condition": f"data: {use}", "data_s": data_s, "falls": falls})
    return records


def thinned(rows: trainers.Demonstrations, per_gait: int) -> trainers.Demonstrations:
    """At most so many rows of every gait, drawn at random: evenly spaced ones would meet few phases of a cycle."""
    rng = np.random.default_rng(per_gait)
    parts = [
        part.take(np.sort(rng.choice(len(part), min(per_gait, len(part)), replace=False)))
        for part in rows.per_task().values()
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
    variance = {gait: float((part.half_range * part.acts).var(axis=0).mean()) for gait, part in rows.per_task().items()}
    return {gait: [(1.0 - value) * variance[gait] for value in values] for gait, values in r2.items()}
