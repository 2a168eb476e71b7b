"""Demonstrations of a table: which commands, which shards, and the rows in them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from report_parts import digest

import trainers
from go1_mtl_gym.errors import InvalidInputError
from paper_report.config import MOST_COMMANDS, Command, PaperConfig, Table
from trainers.data.environments import derive_seed

TRAIN, NAMED, UNSEEN = "train", "named", "unseen"
"""What a shard is for: training, or testing with the authors' held-out command, or with others that are held out."""
TRIES = 10_000


def draw_apart(
    rng: np.random.Generator, count: int, largest: np.ndarray, others: Sequence[Command], gap: float
) -> list[Command]:
    """Uniform draws of commands that keep away from some others.

    Args:
        rng: that is drawn from.
        count: how many.
        largest: of each component's absolute value, shape (3,).
        others: what a draw must be at least `gap` away from in (vx, vy).
        gap: [m/s].

    Raises:
        InvalidInputError: if no such command is found in 10,000 draws.
    """
    taken = np.array(others, dtype=float).reshape(-1, 3)[:, :2]
    found: list[Command] = []
    for _ in range(TRIES):
        if len(found) == count:
            return found
        command = rng.uniform(-1.0, 1.0, 3) * largest
        if (np.linalg.norm(taken - command[:2], axis=1) >= gap).all():
            found.append(tuple((command + 0.0).tolist()))
    raise InvalidInputError(f"expected room for {count} commands {gap} m/s from {len(taken)} others, got {len(found)}")


def commands(table: Table, gait: str, config: PaperConfig) -> dict[str, list[Command]]:
    """The commands of a gait by what they are for; those held out are `config.gap` from all that are trained on."""
    largest, named = config.largest(gait), [table.named[gait]] if table.named else []
    rngs = [np.random.default_rng(derive_seed(table.name, gait, use, config.seed)) for use in (TRAIN, UNSEEN)]
    train = draw_apart(rngs[0], config.train_commands, largest, named, config.gap)
    unseen = draw_apart(rngs[1], config.unseen_commands, largest, [*train, *named], config.gap)
    return {TRAIN: train, NAMED: named, UNSEEN: unseen}


def shard_jobs(table: Table, config: PaperConfig) -> dict[str, list[trainers.CollectJob]]:
    """Descriptions of the shards, one per gait and command, by what they are for."""
    jobs: dict[str, list[trainers.CollectJob]] = {TRAIN: [], NAMED: [], UNSEEN: []}
    for gait in table.gaits:
        for block, (use, own) in enumerate(commands(table, gait, config).items()):
            first = (config.seed * len(jobs) + block) * MOST_COMMANDS
            jobs[use] += [
                trainers.CollectJob(gait, first + i, config.seconds, command, None, table.env_kwargs)
                for i, command in enumerate(own)
            ]
    return jobs


@dataclass(frozen=True)
class PaperData:
    """The shards of a table on disk.

    Attributes:
        folder: of these settings; a change of table, commands, duration or seed leads to another one.
        paths: use -> files.
    """

    folder: Path
    paths: Mapping[str, tuple[Path, ...]]

    def rows(self, use: str) -> trainers.Demonstrations:
        """All rows of one use."""
        return trainers.Demonstrations.concatenate([trainers.Demonstrations.load(path) for path in self.paths[use]])

    @property
    def tests(self) -> tuple[str, ...]:
        """Uses that rows are held out for."""
        return tuple(use for use in (NAMED, UNSEEN) if self.paths[use])

    def account(self) -> dict[str, dict[str, dict[str, float]]]:
        """{use: {gait: {"seconds": of the rows, "falls": of the expert}}}.

        A shard holds one episode, and one more for every fall of the expert; the end before a fall is not kept.
        """
        found: dict[str, dict[str, dict[str, float]]] = {}
        for use, paths in self.paths.items():
            for path in paths:
                shard = trainers.Demonstrations.load(path)
                gait = shard.meta["job"]["task"]
                own = found.setdefault(use, {}).setdefault(gait, {"seconds": 0.0, "falls": 0})
                own["seconds"] += shard.seconds
                own["falls"] += int(shard.starts.sum()) - 1
        return found


def collect(table: Table, config: PaperConfig, root: Path, n_jobs: int, progress: bool = True) -> PaperData:
    """Let the expert walk with every command; what is there already is kept.

    Args:
        table: which.
        config: how much.
        root: of all tables' folders.
        n_jobs: processes.
        progress: show a bar.
    """
    jobs = shard_jobs(table, config)
    flat = [job for own in jobs.values() for job in own]
    folder = root / f"{table.name}-{digest(repr(sorted(job.as_dict().items())) for job in flat)}"
    made = iter(trainers.collect_all(flat, folder / "demonstrations", n_jobs, progress))
    return PaperData(folder, {use: tuple(next(made) for _ in own) for use, own in jobs.items()})
