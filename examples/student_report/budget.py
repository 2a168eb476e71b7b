"""DAgger against cloning: students that learned from equally many labels, asked for in different states."""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from main_job.config import NOISE_RAD, ROUND_NOISE_RAD, JobConfig
from main_job.demonstrations import shard_jobs
from main_job.students import new_policy

import trainers
from go1_mtl_gym.errors import InvalidInputError
from student_report.lab import Walker, summary
from student_report.lessons import Pupil, kept_policy, pooled, rows_of


@dataclass(frozen=True)
class Method:
    """Where the expert is asked for labels.

    Attributes:
        perturbed: whether demonstrations are disturbed, and rounds as well.
        rounds: whether the first budget alone is demonstrated, and rounds of DAgger double the labels from then on.
        beta: probability of an expert's block in a round.
        takeover_rad: of the rounds, see `trainers.DAggerConfig`.
    """

    perturbed: bool = False
    rounds: bool = False
    beta: float = 0.0
    takeover_rad: float | None = None


METHODS = {
    "clean BC": Method(),
    "perturbed BC": Method(perturbed=True),
    "DAgger": Method(rounds=True),
    "safe DAgger": Method(rounds=True, takeover_rad=0.1),
    "perturbed safe DAgger": Method(perturbed=True, rounds=True, beta=0.5, takeover_rad=0.1),
}
"""Everything that is compared, by name."""


@dataclass(frozen=True)
class BudgetConfig:
    """What all methods share.

    Attributes:
        job: observation, network, `clone_steps` of every training, shards and evaluation; its seed is not used.
        budgets_s: labels per gait [s]; each twice the one before.
        seeds: of the trainings.
        noise_rad, round_noise_rad: largest action noise in disturbed demonstrations and in disturbed rounds [rad].

    Raises:
        InvalidInputError: if budgets do not double, or are no whole number of shards.
    """

    job: JobConfig = JobConfig(
        n_envs=1, randomized=0.0, task_interval=None, clone_steps=2500, episodes=10, episode_s=15.0
    )
    budgets_s: tuple[float, ...] = (15.0, 30.0, 60.0, 120.0, 240.0)
    seeds: tuple[int, ...] = (0, 1)
    noise_rad: float = NOISE_RAD
    round_noise_rad: float = ROUND_NOISE_RAD

    def __post_init__(self) -> None:
        doubled = all(b == 2 * a for a, b in zip(self.budgets_s, self.budgets_s[1:]))
        first = self.budgets_s[0] / self.job.shard_s if self.budgets_s else 0.0
        if not doubled or first < 1 or not first.is_integer():
            raise InvalidInputError(
                f"budgets_s must be whole shards of {self.job.shard_s} s and each twice the last, got {self.budgets_s}"
            )

    def walkers(self, _given: Sequence[Walker]) -> list[Walker]:
        """A student of every method."""
        return [Pupil(name) for name in METHODS]

    def parts(self, _task: str, _tasks: Sequence[str]) -> tuple[str, ...]:
        """One part per training seed."""
        return tuple(f"seed {seed}" for seed in self.seeds)

    def seeded(self, seed: int) -> JobConfig:
        """The job of one training seed."""
        return dataclasses.replace(self.job, seed=seed)

    def demonstrations(self, seed: int, perturbed: bool, seconds: float) -> list[trainers.CollectJob]:
        """The first `seconds` per gait of a seed's demonstrations [s]."""
        job = self.seeded(seed)
        return shard_jobs(job, seconds, int(perturbed), job.disturbed(self.noise_rad) if perturbed else None)


QUICK = BudgetConfig(
    dataclasses.replace(
        BudgetConfig().job, width=64, batch_size=256, shard_s=2.0, clone_steps=100, episodes=1, episode_s=3.0
    ),
    budgets_s=(2.0, 4.0),
    seeds=(0,),
)


def prepare(config: BudgetConfig, folder: Path, n_jobs: int) -> None:
    """Have everything demonstrated that the parts share."""
    jobs = [
        job
        for seed in config.seeds
        for perturbed in (False, True)
        for job in config.demonstrations(seed, perturbed, config.budgets_s[-1])
    ]
    trainers.collect_all(jobs, folder / "demonstrations", n_jobs, progress=True)


def budget(name: str, _task: str, what: str, config: BudgetConfig, seed: int, folder: Path) -> dict[str, Any]:
    """Teach by one method with one training seed, and evaluate at every budget.

    Args:
        name: of the method.
        what: "seed N".
        config: what all methods share.
        seed: of the evaluation.
        folder: of demonstrations and students.

    Returns:
        "levels", one per budget: "seconds" of labels per gait, "falls" while collecting them, "learner_fraction" of the
        steps while collecting them that the learner drove, `student_lab.summary` "pooled" and per gait in "tasks"; and
        "drops" of the success, see `drops`.
    """
    levels = []
    taught = Lessons(METHODS[name], config, int(what.removeprefix("seed ")), folder, name)
    for seconds, policy, counts in taught:
        results = {
            task: trainers.evaluate(
                policy,
                task,
                config.job.episodes,
                config.job.episode_s,
                seed,
                command_interval=config.job.command_interval,
            )
            for task in config.job.tasks
        }
        tasks = {task: summary(result) for task, result in results.items()}
        levels.append({"seconds": seconds, **counts, "pooled": pooled(results), "tasks": tasks})
    return {"levels": levels, "drops": drops([level["pooled"] for level in levels])}


@dataclass(frozen=True)
class Lessons:
    """The students of one method and seed, budget by budget, each taught from the same initial weights.

    Iterating gives (seconds of labels per gait, the student, {"falls", "learner_fraction"} while collecting them). A
    student may be taught anew when the next one is asked for.

    Attributes:
        method: where the expert is asked.
        config: what all methods share.
        seed: of the training.
        folder: of demonstrations and students.
        name: of the method.
    """

    method: Method
    config: BudgetConfig
    seed: int
    folder: Path
    name: str

    def __iter__(self) -> Iterator[tuple[float, Any, dict[str, float]]]:
        if self.method.rounds:
            yield from self._rounds()
        else:
            for seconds in self.config.budgets_s:
                yield self._cloned(seconds)

    @property
    def _own(self) -> Path:
        return self.folder / f"{self.name.replace(' ', '-')}-{self.seed}"

    def _cloned(self, seconds: float) -> tuple[float, Any, dict[str, float]]:
        rows, falls = self._demonstrated(seconds)

        def teach() -> Any:
            policy = self._new_policy()
            trainers.train_bc(policy, rows, self._job.bc)
            return policy

        policy = kept_policy(self._own / f"cloned-{seconds:g}.zip", teach)
        return seconds, policy, {"falls": falls, "learner_fraction": 0.0}

    def _rounds(self) -> Iterator[tuple[float, Any, dict[str, float]]]:
        config, method = self.config, self.method
        seconds, policy, counts = self._cloned(config.budgets_s[0])
        yield seconds, policy, counts
        disturbed = self._job.disturbed(config.round_noise_rad) if method.perturbed else None
        asked = trainers.DAggerConfig(seconds, method.beta, takeover_rad=method.takeover_rad, seed=self.seed)
        base, falls = self._demonstrated(seconds)
        initial = self._new_policy().state_dict()
        with closing(trainers.make_venv(self._job.tasks, 1, self._job.env_kwargs, disturbed)) as venv:
            trainer = trainers.DAggerTrainer(venv, policy, base, asked, self._job.bc, scratch_dir=self._own)
            by_learner = 0.0
            for seconds in config.budgets_s[1:]:
                found = trainer.collect_round(seconds / 2)
                policy.load_state_dict(initial)
                policy.fit_normalization(trainer.rows.obs, trainer.rows.acts)
                trainer.train_round()
                falls += found.meta["falls"]
                by_learner += found.meta["learner_fraction"] * seconds / 2
                yield seconds, policy, {"falls": falls, "learner_fraction": by_learner / seconds}

    @property
    def _job(self) -> JobConfig:
        return self.config.seeded(self.seed)

    def _new_policy(self) -> trainers.MultiHeadPolicy:
        return new_policy(self._job, self._job.env_kwargs)

    def _demonstrated(self, seconds: float) -> tuple[trainers.Demonstrations, int]:
        """Demonstrations, and the expert's falls in them: shards are shorter than an episode."""
        jobs = self.config.demonstrations(self.seed, self.method.perturbed, seconds)
        rows = rows_of(jobs, self.folder)
        return rows, int(rows.starts.sum()) - len(jobs)


def drops(levels: Sequence[Mapping[str, Any]]) -> list[int]:
    """Indices of the levels whose success is below the last level's by more than chance explains.

    That is by more than the 95 % interval of a difference of two shares, d - sqrt((p - l)^2 + (u - q)^2) > 0, with p
    and Wilson's lower bound l before, q and Wilson's upper bound u after (Newcombe, 1998, method 10).

    Args:
        levels: `student_lab.summary` of each budget, in rising order.
    """
    found = []
    for i, (before, after) in enumerate(zip(levels, levels[1:]), 1):
        p, q = before["success_rate"], after["success_rate"]
        if p - q > math.hypot(p - before["success_interval"][0], after["success_interval"][1] - q) + 1e-9:
            found.append(i)
    return found
