"""DAgger against cloning: policies that learned from equally many labels, asked for in different states."""

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

import trainers
from experiments import plots
from experiments.agents import Agent
from experiments.results import Group, Results, group
from experiments.stats import drops
from experiments.student.episodes import counts, evaluate_gaits
from experiments.study import ALL_GAITS, Cell, Metrics, Study, option
from experiments.tables import markdown, number, percent
from experiments.training_runs import QUICK_JOB, cloned, collect, kept_policy, rows_of
from go1_mtl_gym.errors import InvalidInputError
from trainers.pipeline.config import NOISE_RAD, ROUND_NOISE_RAD, JobConfig
from trainers.pipeline.demonstrations import shard_jobs
from trainers.pipeline.new_policy import new_policy


@dataclass(frozen=True)
class Method:
    """Where the expert is asked for labels.

    Attributes:
        perturbed: whether demonstrations are perturbed, and rounds as well.
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
COLORS = (plots.RED, plots.YELLOW, plots.PURPLE, plots.GREEN, plots.BLUE)


@dataclass(frozen=True)
class BudgetOptions:
    """What all methods share.

    Raises:
        InvalidInputError: if budgets do not double, or are no whole number of shards.
    """

    job: JobConfig = option(
        JobConfig(
            n_envs=1,
            randomized=0.0,
            operator=None,
            mirror=False,
            task_interval=None,
            clone_steps=2500,
            episodes=10,
            episode_s=15.0,
        ),
        "observation, network, clone_steps of every training, shards and evaluation; its seed is not used",
    )
    budgets_s: tuple[float, ...] = option(
        (15.0, 30.0, 60.0, 120.0, 240.0), "labels per gait [s]; each twice the one before"
    )
    seeds: tuple[int, ...] = option((0, 1), "of the trainings")
    noise_rad: float = option(
        NOISE_RAD, "largest action noise in perturbed demonstrations and in perturbed rounds [rad]"
    )
    round_noise_rad: float = option(
        ROUND_NOISE_RAD, "largest action noise in perturbed demonstrations and in perturbed rounds [rad]"
    )

    def __post_init__(self) -> None:
        doubled = all(b == 2 * a for a, b in zip(self.budgets_s, self.budgets_s[1:]))
        first = self.budgets_s[0] / self.job.shard_s if self.budgets_s else 0.0
        if not doubled or first < 1 or not first.is_integer():
            raise InvalidInputError(
                f"budgets_s must be whole shards of {self.job.shard_s} s and each twice the last, got {self.budgets_s}"
            )

    def demonstrations(self, seed: int, perturbed: bool, seconds: float) -> list[trainers.CollectJob]:
        """The first `seconds` per gait of a seed's demonstrations [s]."""
        job = replace(self.job, seed=seed)
        return shard_jobs(job, seconds, int(perturbed), job.perturbation(self.noise_rad) if perturbed else None)


class Budget(Study):
    """DAgger against cloning with equally many labels: five ways to ask for them."""

    name = "student_budget"
    title = "DAgger against cloning"
    note = (
        "Success, and in brackets survival, with equally many labels per gait; episodes of all gaits and training "
        "seeds together. Error, falls (of all gaits) and the learner's fraction of the steps while collecting belong "
        "to the last column of budgets. Success drops where it falls from one budget to the next by more than the 95 % "
        "interval of the difference."
    )
    caption = "Survival, success and falls over labels, of five ways to ask for them"
    full = BudgetOptions()
    quick = BudgetOptions(replace(BudgetOptions().job, **QUICK_JOB), budgets_s=(2.0, 4.0), seeds=(0,))
    code = (*Study.code, "experiments.training_runs")

    def agents(self) -> list[Agent]:
        return [Agent(name) for name in METHODS]

    def cells(self, agent: Agent) -> list[Cell]:
        return [Cell(ALL_GAITS, seed=seed) for seed in self.options.seeds]

    def prepare(self, n_jobs: int) -> None:
        options = self.options
        kinds = [(seed, perturbed) for seed in options.seeds for perturbed in (False, True)]
        jobs = [job for kind in kinds for job in options.demonstrations(*kind, options.budgets_s[-1])]
        collect(jobs, self.folder, n_jobs)

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        """Train by one method with one training seed, and evaluate at every budget.

        Returns:
            Counts per budget and gait, and of all gaits together; these with "falls" while collecting the labels, and
            the "learner_fraction" of the steps meanwhile that the learner drove.
        """
        records: list[dict[str, Any]] = []
        for labels_s, policy, collecting in Trainings(agent.name, self.options, cell.seed, self.folder):
            results = evaluate_gaits(policy, self.options.job, seed)
            together = counts(*results.values()) | collecting
            per_gait = [{"task": task, "labels_s": labels_s, **counts(result)} for task, result in results.items()]
            records += [{"labels_s": labels_s, **together}, *per_gait]
        return records

    def table(self, results: Results) -> str:
        methods = _methods(results)
        budgets = [f"{labels_s:g} s" for labels_s in next(iter(methods.values()))]
        rows = []
        for name, per_budget in methods.items():
            levels = list(per_budget.values())
            rates, last = [level.rate() for level in levels], levels[-1]
            cells = [f"{percent(level.rate())} ({percent(level.rate('survived'))})" for level in levels]
            counted = [f"{last.mean('falls'):.1f}", f"{last.mean('learner_fraction'):.0%}"]
            fell = [budgets[i] for i in range(1, len(rates)) if drops(rates[i - 1], rates[i])]
            error = number(last.mean("velocity_error"), ".3f")
            rows.append([name, *cells, error, *counted, ", ".join(fell) or "none"])
        more = ["velocity error [m/s]", "falls while collecting", "driven by the learner", "drops at"]
        return markdown(["", *budgets, *more], rows)

    def figure(self, results: Results) -> Figure:
        figure = plots.new_figure(9.6, 3.6)
        shares, falls = figure.subplots(1, 2)
        for color, (name, levels) in zip(COLORS, _methods(results).items()):
            plots.survival_and_success(shares, levels, color, name)
            falls.plot([*levels], [level.mean("falls") for level in levels.values()], "o-", color=color, markersize=3.5)
        for ax in (shares, falls):
            plots.log_ticks(ax, [*levels], "labels per gait [s]")
        falls.set_ylabel("falls while collecting, all gaits", fontsize=9)
        falls.set_ylim(bottom=0.0)
        plots.legend(figure, [shares])
        return figure


def _methods(results: Results) -> dict[str, dict[float, Group]]:
    """{method: {labels per gait [s]: the training seeds' records of all gaits together}}."""
    per_method = group(results.of(task=ALL_GAITS), "agent")
    return {name: group(members, "labels_s") for name, members in per_method.items()}


@dataclass(frozen=True)
class Trainings:
    """The policies of one method and seed, budget by budget, each trained from the same initial weights.

    Iterating gives (labels per gait [s], the policy, {"falls", "learner_fraction"} while collecting them). A policy may
    be trained anew when the next one is asked for.

    Attributes:
        name: of the method, one of `METHODS`.
        options: what all methods share.
        seed: of the training.
        folder: of demonstrations and policies.
    """

    name: str
    options: BudgetOptions
    seed: int
    folder: Path

    def __iter__(self) -> Iterator[tuple[float, Any, dict[str, float]]]:
        if self._method.rounds:
            yield from self._rounds()
        else:
            yield from (self._cloned(labels_s) for labels_s in self.options.budgets_s)

    @property
    def _job(self) -> JobConfig:
        return replace(self.options.job, seed=self.seed)

    @property
    def _method(self) -> Method:
        return METHODS[self.name]

    @property
    def _policies(self) -> Path:
        return self.folder / f"{self.name.replace(' ', '-')}-{self.seed}"

    def _cloned(self, labels_s: float) -> tuple[float, Any, dict[str, float]]:
        rows, falls = self._demonstrated(labels_s)
        policy = kept_policy(self._policies / f"cloned-{labels_s:g}.zip", lambda: cloned(self._job, rows))
        return labels_s, policy, {"falls": falls, "learner_fraction": 0.0}

    def _rounds(self) -> Iterator[tuple[float, Any, dict[str, float]]]:
        options, method, job = self.options, self._method, self._job
        labels_s, policy, collecting = self._cloned(options.budgets_s[0])
        yield labels_s, policy, collecting
        perturbation = job.perturbation(options.round_noise_rad) if method.perturbed else None
        dagger = trainers.DAggerConfig(labels_s, method.beta, takeover_rad=method.takeover_rad, seed=self.seed)
        base, falls = self._demonstrated(labels_s)
        initial = new_policy(job, job.env_kwargs).state_dict()
        with closing(trainers.make_venv(job.tasks, 1, job.env_kwargs, perturbation)) as venv:
            trainer = trainers.DAggerTrainer(venv, policy, base, dagger, job.bc, scratch_dir=self._policies)
            by_learner = 0.0
            for labels_s in options.budgets_s[1:]:
                collected = trainer.collect_round(labels_s / 2)
                policy.load_state_dict(initial)
                policy.fit_normalization(trainer.rows.obs, trainer.rows.acts)
                trainer.train_round()
                falls += collected.meta["falls"]
                by_learner += collected.meta["learner_fraction"] * labels_s / 2
                yield labels_s, policy, {"falls": falls, "learner_fraction": by_learner / labels_s}

    def _demonstrated(self, labels_s: float) -> tuple[trainers.Demonstrations, int]:
        """Demonstrations, and the expert's falls in them: shards are shorter than an episode."""
        jobs = self.options.demonstrations(self.seed, self._method.perturbed, labels_s)
        rows = rows_of(jobs, self.folder)
        return rows, int(rows.starts.sum()) - len(jobs)
