"""Ways to learn a new gait, and what each of them makes of the old ones."""

import dataclasses
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from main_job.config import NOISE_RAD, ROUND_NOISE_RAD, JobConfig
from main_job.students import new_policy
from student_report.lab import EXPERT, Walker, summary
from student_report.lessons import kept_policy, rows_of

import trainers
from gait_report.config import NewGaitsConfig, demonstrations, held_out
from trainers.algorithms.add_task import tasks_of
from trainers.data.environments import derive_seed

FROZEN, ASSISTED = "new head, frozen trunk", "new head, half by safe DAgger"
TUNED, SCRATCH = "fine-tuned with rehearsal", "from scratch"
METHODS = (FROZEN, ASSISTED, TUNED, SCRATCH)
"""Everything that is compared. All get labels for equally many seconds and take equally many gradient steps."""
TAKEOVER_RAD = 0.1
"""Of the DAgger round, see `trainers.DAggerConfig`."""
BEFORE = "before"
"""The trained policy in its own gaits, which are compared with what tuning makes of them."""
SINGLE_ROWS = 200
"""About so many observations of the old gaits are also given to the policies one at a time."""


@dataclass(frozen=True)
class Lesson:
    """One gait, taught by one method with one training seed and so many seconds of demonstrations.

    Attributes:
        base: the trained policy.
        gait: that is new to it.
        method: one of `METHODS`.
        seconds: of demonstrations [s].
        seed: of the training.
        config: what all methods share.
        folder: of demonstrations and students.
    """

    base: Walker
    gait: str
    method: str
    seconds: float
    seed: int
    config: NewGaitsConfig
    folder: Path

    def measure(self, seed: int) -> dict[str, Any]:
        """Teach and evaluate.

        Args:
            seed: of the evaluation.

        Returns:
            `student_lab.summary` of the new gait's episodes with "survival_s" [s] and "step_rate" [1/s]; the one-step
            errors on held-out rows, see `trainers.offline_metrics`; `changes` of the old gaits in "changes", if the
            policy has them; and their episodes in "old", {gait: `student_lab.summary`}, if they could have changed.
        """
        base, policy = self.base.load(), self.policy()
        tests = rows_of(held_out(self._job(self.config.seeds[0])), self.folder).with_tasks(tasks_of(policy))
        figures = walk(policy, self.gait, self.config.job.episodes, self.config.job, seed)
        figures |= trainers.offline_metrics(policy, tests)[self.gait]
        if self.method != SCRATCH:
            figures["changes"] = changes(base, policy, rehearsal(base, self.config, self.folder))
        if self.method == TUNED:
            figures["old"] = old_gaits(policy, tasks_of(base), self.config, seed)
        return figures

    def policy(self) -> trainers.MultiHeadPolicy:
        """The student: read if it is there, else taught."""
        words = (self.gait, self.method.replace(",", ""), f"{self.seconds:g}", str(self.seed))
        return kept_policy(self.folder / "students" / f"{'-'.join(words).replace(' ', '_')}.zip", self._taught)

    def _taught(self) -> trainers.MultiHeadPolicy:
        job = self._job(self.seed)
        shown, asked = halves(self.seconds, job.shard_s) if self.method == ASSISTED else (self.seconds, 0.0)
        rows = rows_of(demonstrations(job, shown), self.folder)
        if self.method == SCRATCH:
            policy = new_policy(job, job.env_kwargs)
            trainers.train_bc(policy, rows, job.bc)
            return policy
        base = self.base.load()
        if asked:
            rows = self._with_round(self._headed(base, rows, job.bc), rows, asked)
        if self.method != TUNED:
            return self._headed(base, rows, job.bc)
        tuning = dataclasses.replace(job.bc, learning_rate=self.config.tuning_rate)
        return self._headed(base, rows, tuning, rehearsal(base, self.config, self.folder))

    def _headed(
        self,
        base: trainers.MultiHeadPolicy,
        rows: trainers.Demonstrations,
        bc: trainers.BCConfig,
        rehearsed: trainers.Demonstrations | None = None,
    ) -> trainers.MultiHeadPolicy:
        """The trained policy with a head that began as the closest of its own and has learned."""
        policy = base.add_task(self.gait, self.seed, like=trainers.closest_task(base, rows))
        trainers.learn_task(policy, rows, bc, rehearsal=rehearsed)
        return policy

    def _with_round(
        self, policy: trainers.MultiHeadPolicy, rows: trainers.Demonstrations, seconds: float
    ) -> trainers.Demonstrations:
        """The rows, and those of a round in which the policy drives until the expert takes over [s]."""
        job, tasks = self._job(self.seed), tasks_of(policy)
        asked = trainers.DAggerConfig(seconds, beta=0.0, takeover_rad=TAKEOVER_RAD, seed=self.seed)
        env_kwargs = job.env_kwargs | {"tasks": tasks} | job.world
        venv = trainers.make_venv((self.gait,), 1, env_kwargs, job.disturbed(ROUND_NOISE_RAD))
        with closing(venv):
            rounds = self.folder / "rounds" / f"{self.gait}-{self.seconds:g}-{self.seed}"
            trainer = trainers.DAggerTrainer(venv, policy, rows.with_tasks(tasks), asked, job.bc, scratch_dir=rounds)
            trainer.collect_round()
            return trainer.rows

    def _job(self, seed: int) -> JobConfig:
        return self.config.job_of(self.base.load(), (self.gait,), seed)


def halves(seconds: float, shard_s: float) -> tuple[float, float]:
    """Seconds of demonstrations, in whole shards and one at least, and of the DAgger round after them [s]."""
    shown = max(1, round(seconds / shard_s) // 2) * shard_s
    return shown, seconds - shown


def rehearsal(base: Any, config: NewGaitsConfig, folder: Path) -> trainers.Demonstrations:
    """The trained policy's own disturbed walks with changes of gait: what it does is what is rehearsed.

    No expert is asked, and nothing of the first training is needed (pseudo-rehearsal: Robins, 1995). Made once.

    Args:
        base: the trained policy.
        config: what all methods share.
        folder: where the rows are kept.
    """
    path = folder / "rehearsal.npz"
    if not path.is_file():
        tasks = tasks_of(base)
        job = config.job_of(base, tasks, 0)
        disturbed = job.disturbed(NOISE_RAD)
        walks = [
            trainers.watch(base, task, derive_seed("rehearse", i), config.rehearsal_s, disturbed, **job.world)[0]
            for i, task in enumerate(tasks)
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
        "rows", how many; "equal", whether all actions are equal to the bit; "largest_rad", the largest difference of a
        joint target [rad].
    """
    longer = rows.with_tasks(tasks_of(policy))

    def acts(who: Any, obs: np.ndarray) -> np.ndarray:
        single = np.stack([who.predict(row, deterministic=True)[0] for row in obs[:: max(1, len(obs) // SINGLE_ROWS)]])
        return np.concatenate([who.predict(obs, deterministic=True)[0], single])

    before, after = acts(base, rows.obs), acts(policy, longer.obs)
    largest = np.abs((after - before) * rows.half_range).max()
    return {"rows": len(rows), "equal": bool(np.array_equal(before, after)), "largest_rad": float(largest)}


def walk(who: Any, gait: str, episodes: int, job: JobConfig, seed: int, **env_kwargs: Any) -> dict[str, Any]:
    """Closed loop of a policy or the expert under commands that change; see `student_lab.summary`."""
    result = trainers.evaluate(
        who, gait, episodes, job.episode_s, seed, command_interval=job.command_interval, **env_kwargs
    )
    return summary(result) | {"survival_s": result.survival_s, "step_rate": result.step_rate}


def old_gaits(policy: Any, tasks: tuple[str, ...], config: NewGaitsConfig, seed: int) -> dict[str, Any]:
    """{gait: `walk`} of the gaits that were there before."""
    return {task: walk(policy, task, config.old_episodes, config.job, seed) for task in tasks}


def before(base: Walker, _gait: str, config: NewGaitsConfig, seed: int) -> dict[str, Any]:
    """The trained policy in its own gaits."""
    policy = base.load()
    return old_gaits(policy, tasks_of(policy), config, seed)


def expert(base: Walker, gait: str, config: NewGaitsConfig, seed: int) -> dict[str, Any]:
    """The expert in the new gait, under the commands that the students get."""
    env_kwargs = config.job_of(base.load(), (gait,), 0).env_kwargs
    return walk(EXPERT, gait, config.job.episodes, config.job, seed, **env_kwargs)


REFERENCES: dict[str, Callable[..., dict[str, Any]]] = {EXPERT: expert, BEFORE: before}
"""Who else is measured: name -> (base, gait, config, seed) -> figures."""
