"""What is demonstrated of a new gait, and what all ways of learning it share."""

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

from main_job.config import NOISE_RAD, JobConfig
from main_job.demonstrations import shard_jobs

import trainers
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import number_in

SEEN = ("channels", "history", "control_hz", "kp", "kd")
"""Arguments of the trained policy's environment that a new gait is demonstrated with."""
CLEAN, DISTURBED, HELD_OUT = 0, 1, 2
"""Blocks of seeds of the main job's demonstrations."""


@dataclass(frozen=True)
class NewGaitsConfig:
    """What all methods share.

    Attributes:
        job: `clone_steps` of every training, shards, held-out seconds and evaluation;
            `clean_s` and `perturbed_s` say in which proportion demonstrations are disturbed. Its seed and tasks are not
            used; observation and network are the trained policy's.
        seconds: demonstrated of the new gait [s], rising; whole shards of the job.
        seeds: of demonstrations, heads and trainings.
        rehearsal_s: that the trained policy walks by itself per gait, for rehearsal [s].
        tuning_rate: peak learning rate where the whole network is tuned.
        old_episodes: per old gait, after tuning.

    Raises:
        InvalidInputError: if the seconds do not rise or are no whole shards, there is no seed, or a figure is not
            positive.
    """

    job: JobConfig = JobConfig(n_envs=1, clone_steps=3000, batch_size=512)
    seconds: tuple[float, ...] = (15.0, 30.0, 60.0, 120.0, 240.0)
    seeds: tuple[int, ...] = (0, 1, 2)
    rehearsal_s: float = 60.0
    tuning_rate: float = 1e-3
    old_episodes: int = 5
    alone: ClassVar[bool] = False
    """Whether nothing else may run meanwhile; no times are measured here."""

    def __post_init__(self) -> None:
        shards = [value / self.job.shard_s for value in self.seconds]
        rising = all(a < b for a, b in zip((0.0, *shards), shards))
        if not shards or not rising or not all(value.is_integer() for value in shards):
            raise InvalidInputError(f"seconds must rise in whole shards of {self.job.shard_s} s, got {self.seconds}")
        if not self.seeds or len(set(self.seeds)) != len(self.seeds):
            raise InvalidInputError(f"expected seeds that differ from each other, got {self.seeds}")
        number_in(self.rehearsal_s, 1.0, 1e5, "rehearsal_s [s]")
        number_in(self.tuning_rate, 1e-8, 1.0, "tuning_rate")
        number_in(self.old_episodes, 1, 10_000, "old_episodes")

    def job_of(self, policy: Any, tasks: tuple[str, ...], seed: int) -> JobConfig:
        """The job with the observation and the network of a trained policy, for some tasks and a training seed."""
        seen = {name: policy.env_kwargs[name] for name in SEEN if name in policy.env_kwargs}
        network = {"width": policy.width, "normalization": policy.normalization}
        return dataclasses.replace(self.job, tasks=tasks, seed=seed, **seen, **network)


QUICK = NewGaitsConfig(
    JobConfig(
        n_envs=1,
        clean_s=3.0,
        perturbed_s=3.0,
        shard_s=2.0,
        held_out_s=2.0,
        batch_size=256,
        clone_steps=60,
        episodes=1,
        episode_s=3.0,
    ),
    seconds=(2.0, 4.0),
    seeds=(0,),
    rehearsal_s=2.0,
    old_episodes=1,
)


def demonstrations(job: JobConfig, seconds: float) -> list[trainers.CollectJob]:
    """Clean and disturbed demonstrations of one gait from standing starts, in the proportion of `job`.

    Every shard of the job falls into a clean and a disturbed one, so that fewer seconds are the first of more.

    Args:
        job: of the gait and seed.
        seconds: of both together [s]; whole shards.
    """
    clean = job.clean_s / (job.clean_s + job.perturbed_s)
    found = []
    for share, block in ((clean, CLEAN), (1.0 - clean, DISTURBED)):
        if share > 0:
            disturbed, world = (job.disturbed(NOISE_RAD), job.world) if block == DISTURBED else (None, None)
            part = dataclasses.replace(job, shard_s=share * job.shard_s)
            found += shard_jobs(part, share * seconds, block, disturbed, world)
    return found


def held_out(job: JobConfig) -> list[trainers.CollectJob]:
    """Undisturbed demonstrations of the same gait that nobody learns from."""
    return shard_jobs(job, job.held_out_s, HELD_OUT)
