"""Ways to learn a new gait, and what each of them makes of the old ones."""

from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import trainers
from experiments.study import option
from experiments.training_runs import cloned, kept_policy, rows_of
from go1_mtl_gym import PAPER_TASKS
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import number_in
from trainers.data.environments import derive_seed
from trainers.pipeline.config import NOISE_RAD, ROUND_NOISE_RAD, JobConfig
from trainers.pipeline.demonstrations import held_out_jobs, shard_jobs

FROZEN, ASSISTED = "new head, frozen trunk", "new head, half by safe DAgger"
TUNED, SCRATCH = "fine-tuned with rehearsal", "from scratch"
METHODS = (FROZEN, ASSISTED, TUNED, SCRATCH)
"""Everything that is compared. All get labels for equally many seconds and take equally many gradient steps."""
TAKEOVER_RAD = 0.1
"""Of the DAgger round, see `trainers.DAggerConfig`."""
SINGLE_ROWS = 200
"""About so many observations of the old gaits are also given to the policies one at a time."""
SEEN = ("channels", "history", "control_hz", "kp", "kd")
"""Arguments of the trained policy's environment that a new gait is demonstrated with."""


@dataclass(frozen=True)
class NewGaitOptions:
    """What all methods share.

    Raises:
        InvalidInputError: if the seconds do not rise or are no whole shards, there is no seed, or a number is not
            positive.
    """

    gaits: tuple[str, ...] = option(("pace", "gallop"), "that the trained policy is to learn, each by itself")
    base: JobConfig = option(
        JobConfig(n_envs=1, tasks=PAPER_TASKS, phase_free_s=0.0),
        "the main job of the trained policy, if none is given",
    )
    job: JobConfig = option(
        JobConfig(n_envs=1, perturbed_s=300.0, clone_steps=3000, batch_size=512),
        "clone_steps of every training, shards, evaluation, and in clean_s and perturbed_s the proportion of both; "
        "tasks, observation and network are the trained policy's",
    )
    demonstrations_s: tuple[float, ...] = option(
        (15.0, 30.0, 60.0, 120.0, 240.0), "of the new gait [s], rising; whole shards of the job"
    )
    seeds: tuple[int, ...] = option((0, 1, 2), "of demonstrations, heads and trainings")
    rehearsal_s: float = option(60.0, "that the trained policy walks by itself per gait, for rehearsal [s]")
    tuning_rate: float = option(1e-3, "peak learning rate where the whole network is tuned")
    old_episodes: int = option(5, "per old gait, after tuning")

    def __post_init__(self) -> None:
        shards = [value / self.job.shard_s for value in self.demonstrations_s]
        rising = all(a < b for a, b in zip((0.0, *shards), shards))
        if not shards or not rising or not all(value.is_integer() for value in shards):
            shard_s, got = self.job.shard_s, self.demonstrations_s
            raise InvalidInputError(f"demonstrations_s must rise in whole shards of {shard_s} s, got {got}")
        if not self.seeds or len(set(self.seeds)) != len(self.seeds):
            raise InvalidInputError(f"expected seeds that differ from each other, got {self.seeds}")
        number_in(self.rehearsal_s, 1.0, 1e5, "rehearsal_s [s]")
        number_in(self.tuning_rate, 1e-8, 1.0, "tuning_rate")
        number_in(self.old_episodes, 1, 10_000, "old_episodes")

    def job_of(self, policy: trainers.MultiHeadPolicy, tasks: tuple[str, ...], seed: int) -> JobConfig:
        """The job with the observation and the network of a trained policy, for some tasks and a training seed."""
        seen = {name: value for name, value in policy.contract.env_kwargs.items() if name in SEEN}
        return replace(self.job, tasks=tasks, seed=seed, **seen, width=policy.width, normalization=policy.normalization)


def demonstrations(job: JobConfig, seconds: float) -> list[trainers.CollectJob]:
    """Clean and perturbed demonstrations of one gait from standing starts, in the proportion of `job`.

    Every shard of the job falls into a clean and a perturbed one, so that fewer seconds are the first of more.

    Args:
        job: of the gait and seed.
        seconds: of both together [s]; whole shards.
    """
    clean = job.clean_s / (job.clean_s + job.perturbed_s)
    jobs = []
    for block, fraction in enumerate((clean, 1.0 - clean)):
        if fraction > 0:
            world = job.randomization_kwargs(job.randomized)
            perturbed = (job.perturbation(NOISE_RAD), world) if block else (None, None)
            pieces = replace(job, shard_s=fraction * job.shard_s)
            jobs += shard_jobs(pieces, fraction * seconds, block, *perturbed)
    return jobs


@dataclass(frozen=True)
class GaitTraining:
    """One gait, learned by one method with one training seed from so many seconds of demonstrations.

    Attributes:
        base: the trained policy.
        gait: that is new to it.
        method: one of `METHODS`.
        seconds: of demonstrations [s].
        seed: of the training.
        options: what all methods share.
        folder: of demonstrations and policies.
    """

    base: trainers.MultiHeadPolicy
    gait: str
    method: str
    seconds: float
    seed: int
    options: NewGaitOptions
    folder: Path

    def policy(self) -> trainers.MultiHeadPolicy:
        """The policy: read if it is there, else trained."""
        words = (self.gait, self.method.replace(",", ""), f"{self.seconds:g}", str(self.seed))
        return kept_policy(self.folder / "policies" / f"{'-'.join(words).replace(' ', '_')}.zip", self._trained)

    def _trained(self) -> trainers.MultiHeadPolicy:
        job = self.options.job_of(self.base, (self.gait,), self.seed)
        shown, asked = halves(self.seconds, job.shard_s) if self.method == ASSISTED else (self.seconds, 0.0)
        rows = rows_of(demonstrations(job, shown), self.folder)
        if self.method == SCRATCH:
            return cloned(job, rows)
        if asked:
            rows = self._with_round(self._headed(rows, job.bc), rows, asked, job)
        if self.method != TUNED:
            return self._headed(rows, job.bc)
        tuning = replace(job.bc, learning_rate=self.options.tuning_rate)
        return self._headed(rows, tuning, rehearsal(self.base, self.options, self.folder))

    def _headed(
        self, rows: trainers.Demonstrations, bc: trainers.BCConfig, rehearsed: trainers.Demonstrations | None = None
    ) -> trainers.MultiHeadPolicy:
        """The trained policy with a head that began as the closest of its own and has learned."""
        policy = self.base.add_task(self.gait, self.seed, like=trainers.closest_task(self.base, rows))
        trainers.learn_task(policy, rows, bc, rehearsal=rehearsed)
        return policy

    def _with_round(
        self, policy: trainers.MultiHeadPolicy, rows: trainers.Demonstrations, seconds: float, job: JobConfig
    ) -> trainers.Demonstrations:
        """The rows, and those of a round in which the policy drives until the expert takes over [s]."""
        dagger = trainers.DAggerConfig(seconds, beta=0.0, takeover_rad=TAKEOVER_RAD, seed=self.seed)
        env_kwargs = job.env_kwargs | {"tasks": policy.tasks} | job.randomization_kwargs(job.randomized)
        rounds = self.folder / "rounds" / f"{self.gait}-{self.seconds:g}-{self.seed}"
        with closing(trainers.make_venv((self.gait,), 1, env_kwargs, job.perturbation(ROUND_NOISE_RAD))) as venv:
            base = rows.with_tasks(policy.tasks)
            trainer = trainers.DAggerTrainer(venv, policy, base, dagger, job.bc, scratch_dir=rounds)
            trainer.collect_round()
            return trainer.rows


def halves(seconds: float, shard_s: float) -> tuple[float, float]:
    """Seconds of demonstrations, in whole shards and one at least, and of the DAgger round after them [s]."""
    shown = max(1, round(seconds / shard_s) // 2) * shard_s
    return shown, seconds - shown


def held_out(base: trainers.MultiHeadPolicy, gait: str, options: NewGaitOptions) -> list[trainers.CollectJob]:
    """Unperturbed demonstrations of a gait that nobody learns from."""
    return held_out_jobs(options.job_of(base, (gait,), options.seeds[0]))


def rehearsal(base: trainers.MultiHeadPolicy, options: NewGaitOptions, folder: Path) -> trainers.Demonstrations:
    """The trained policy's own perturbed walks with changes of gait: what it does is what is rehearsed.

    No expert is asked, and nothing of the first training is needed (pseudo-rehearsal: Robins, 1995). Made once.

    Args:
        base: the trained policy.
        options: what all methods share.
        folder: where the rows are kept.
    """
    path = folder / "rehearsal.npz"
    if not path.is_file():
        job = options.job_of(base, base.tasks, 0)
        perturbation, world = job.perturbation(NOISE_RAD), job.randomization_kwargs(job.randomized)
        walks = [
            trainers.watch(base, task, derive_seed("rehearse", i), options.rehearsal_s, perturbation, **world)
            for i, task in enumerate(base.tasks)
        ]
        trainers.Demonstrations.concatenate(walks).save(path)
    return trainers.Demonstrations.load(path)


def changes(base: Any, policy: Any, rows: trainers.Demonstrations) -> dict[str, Any]:
    """How the actions in old gaits differ from the trained policy's, in batches and one observation at a time.

    Args:
        base: the trained policy.
        policy: what became of it; its task id is longer.
        rows: of old gaits.

    Returns:
        "old_rows", how many; "old_equal", whether all actions are equal to the bit; "old_largest_rad", the largest
        difference of a joint target [rad].
    """
    longer = rows.with_tasks(policy.tasks)

    def acts(agent: Any, obs: np.ndarray) -> np.ndarray:
        some = obs[:: max(1, len(obs) // SINGLE_ROWS)]
        single = np.stack([agent.predict(row, deterministic=True)[0] for row in some])
        return np.concatenate([agent.predict(obs, deterministic=True)[0], single])

    before, after = acts(base, rows.obs), acts(policy, longer.obs)
    largest = np.abs((after - before) * rows.half_range).max()
    equal = bool(np.array_equal(before, after))
    return {"old_rows": len(rows), "old_equal": equal, "old_largest_rad": float(largest)}
