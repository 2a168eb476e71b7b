"""Pace and gallop for a trained policy, by seconds of demonstrations and by the way of learning them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from matplotlib.figure import Figure

import trainers
from experiments import plots
from experiments.agents import EXPERT, Agent, PolicyFile
from experiments.new_gaits.learning import (
    METHODS,
    SCRATCH,
    TUNED,
    GaitTraining,
    NewGaitOptions,
    changes,
    demonstrations,
    held_out,
    rehearsal,
)
from experiments.results import Group, Results, group
from experiments.student.episodes import counts, evaluate_gaits
from experiments.study import ALL_GAITS, Cell, Metrics, Study
from experiments.tables import count, markdown, number, percent
from experiments.training_runs import QUICK_JOB, TrainedPolicy, TrainingRun, collect, rows_of
from go1_mtl_gym import TASKS
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import one_of

NEW, OLD, BEFORE = "new gait", "old gait", "policy, before"
COLORS = dict(zip(METHODS, (plots.BLUE, plots.PURPLE, plots.GREEN, plots.RED), strict=True))


@dataclass(frozen=True)
class Method(Agent):
    """Who is measured with a trained policy at hand.

    Attributes:
        base: the trained policy.
    """

    base: PolicyFile = field(kw_only=True)

    @property
    def identity(self) -> str:
        """The name, and the file of the trained policy."""
        return repr((self.name, self.base.sha256))

    @property
    def origin(self) -> Any:
        return self.base.origin

    def prepare(self) -> float:
        return self.base.prepare()


class NewGaits(Study):
    """A head on a frozen trunk, all of the policy tuned with rehearsal, or a network of its own."""

    name = "new_gaits"
    title = "A new head, tuning, or another network"
    note = (
        "Success (survival) and R2 on held-out rows by seconds of demonstrations, all training seeds together; the "
        "velocity error is that of the most. From `all survive from` on no episode ends in a fall. The last column "
        "says what became of the gaits that the policy had: of their actions, and of their success."
    )
    caption = "Survival and R2 of new gaits by seconds of demonstrations"
    full = NewGaitOptions()
    quick = NewGaitOptions(
        gaits=("pace",),
        base=replace(full.base, **QUICK_JOB, rounds=0),
        job=replace(full.job, **QUICK_JOB),
        demonstrations_s=(2.0, 4.0),
        seeds=(0,),
        rehearsal_s=2.0,
        old_episodes=1,
    )
    code = (*Study.code, "experiments.new_gaits.learning", "experiments.training_runs")
    takes_policies = True

    @property
    def base(self) -> PolicyFile:
        """The trained policy: the one that is given, or that of a main job in the paper's gaits.

        Raises:
            InvalidInputError: if several are given.
        """
        if len(self.policies) > 1:
            raise InvalidInputError(f"one policy was expected, got {[agent.name for agent in self.policies]}")
        run = TrainingRun(self.options.base, self.cache / "training")
        return self.policies[0] if self.policies else TrainedPolicy(BEFORE, path=run.policy, run=run)

    @property
    def shared_options(self) -> Any:
        return self.options, *(agent.identity for agent in self.policies)

    def agents(self) -> list[Agent]:
        """The methods, the expert, and the policy as it was.

        Raises:
            InvalidInputError: if the policy has no heads, sees several frames, or a gait is not new to it.
        """
        base = self.base
        known = _tasks_of_given(base) if self.policies else self.options.base.tasks
        for gait in self.options.gaits:
            one_of(gait, [name for name in TASKS if name not in known], "a gait that is new to the policy")
        return [Method(name, base=base) for name in (EXPERT, BEFORE, *METHODS)]

    def cells(self, agent: Agent) -> list[Cell]:
        options = self.options
        if agent.name == BEFORE:
            return [Cell(ALL_GAITS, OLD)]
        if agent.name == EXPERT:
            return [Cell(gait, NEW) for gait in options.gaits]
        budgets = [f"{seconds:g} s" for seconds in reversed(options.demonstrations_s)]
        return [Cell(gait, budget, seed) for budget in budgets for gait in options.gaits for seed in options.seeds]

    def prepare(self, n_jobs: int) -> None:
        options, base, jobs = self.options, self.base.load(), []
        for gait in options.gaits:
            seeds = [options.job_of(base, (gait,), seed) for seed in options.seeds]
            jobs += [job for each in seeds for job in demonstrations(each, options.demonstrations_s[-1])]
            jobs += held_out(base, gait, options)
        collect(jobs, self.folder, n_jobs)
        rehearsal(base, options, self.folder)

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        """Train and evaluate, or evaluate who others are compared with.

        Returns:
            Of a training: counts in the new gait with "survival_s" [s], "step_rate" [1/s], the one-step errors on
            held-out rows, and `changes` of the old gaits if the policy has them; and a record per old gait if they
            could have changed.
        """
        options, base = self.options, self.base.load()
        if agent.name == EXPERT:
            env_kwargs = options.job_of(base, (cell.task,), 0).env_kwargs
            return self._walk(EXPERT, (cell.task,), options.job.episodes, seed, **env_kwargs)
        if agent.name == BEFORE:
            walked = self._walk(base, base.tasks, options.old_episodes, seed)
            return [episodes | {"condition": OLD} for episodes in walked]
        demonstrations_s = float(cell.condition.split()[0])
        training = GaitTraining(base, cell.task, agent.name, demonstrations_s, cell.seed, options, self.folder)
        policy = training.policy()
        rows = rows_of(held_out(base, cell.task, options), self.folder).with_tasks(policy.tasks)
        record = {"condition": NEW, "demonstrations_s": demonstrations_s}
        record |= self._walk(policy, (cell.task,), options.job.episodes, seed)[0]
        record |= trainers.offline_metrics(policy, rows)[cell.task]
        if agent.name != SCRATCH:
            record |= changes(base, policy, rehearsal(base, options, self.folder))
        if agent.name != TUNED:
            return record
        about = {"condition": f"{OLD}, after {cell.task}", "demonstrations_s": demonstrations_s}
        return [record, *(walked | about for walked in self._walk(policy, base.tasks, options.old_episodes, seed))]

    def _walk(
        self, policy: Any, gaits: tuple[str, ...], episodes: int, seed: int, **env_kwargs: Any
    ) -> list[dict[str, Any]]:
        """A record per gait of episodes under commands that change."""
        walked = evaluate_gaits(policy, replace(self.options.job, tasks=gaits, episodes=episodes), seed, **env_kwargs)
        return [
            {"task": gait, **counts(result), "survival_s": result.survival_s, "step_rate": result.step_rate}
            for gait, result in walked.items()
        ]

    def table(self, results: Results) -> str:
        rows, budgets = [], []
        for gait, methods in _by_method(results).items():
            for method, levels in methods.items():
                budgets = [f"{seconds:g} s" for seconds in levels]
                cells = [
                    f"{percent(level.rate())} ({percent(level.rate('survived'))}) {level.mean('r2'):.4f}"
                    for level in levels.values()
                ]
                least, (seconds, last) = enough(levels), list(levels.items())[-1]
                after = results.of(agent=method, condition=f"{OLD}, after {gait}", demonstrations_s=seconds)
                members = Group(record for level in levels.values() for record in level)
                error = number(last.mean("velocity_error"), ".3f")
                all_survive = "-" if least is None else f"{least:g} s"
                rows.append([gait, method, *cells, all_survive, error, old_cell(members, after)])
        header = ["gait", "learned", *budgets, "all survive from", "velocity error [m/s]", "old gaits"]
        expert = [f"{count(Group([record]).rate())} of {record['task']}" for record in results.of(agent=EXPERT)]
        before = count(results.of(agent=BEFORE).rate())
        return "\n\n".join(
            [
                markdown(header, rows, text_columns=2),
                f"The expert succeeds in {', '.join(expert)}; the policy, before, in {before} of its own gaits.",
            ]
        )

    def figure(self, results: Results) -> Figure:
        gaits = _by_method(results)
        figure = plots.new_figure(9.6, 2.9 * len(gaits) + 0.3)
        axes = figure.subplots(len(gaits), 2, sharex=True, squeeze=False)
        for (shares, errors), (gait, methods) in zip(axes, gaits.items()):
            for method, levels in methods.items():
                plots.survival_and_success(shares, levels, COLORS[method], method)
                missing = [1 - level.mean("r2") for level in levels.values()]
                errors.plot([*levels], missing, "o-", color=COLORS[method], markersize=3.5)
            shares.set_title(gait, loc="left", fontsize=10)
            errors.set_ylabel("1 - R2, held out", fontsize=9)
            errors.set_yscale("log")
        for ax in axes[-1]:
            plots.log_ticks(ax, list(levels), "demonstrations of the new gait [s]")
        plots.legend(figure, axes[0, :1])
        return figure


def _tasks_of_given(base: PolicyFile) -> tuple[str, ...]:
    """The gaits of a policy that can learn another.

    Raises:
        InvalidInputError: if it has no heads.
    """
    policy = base.load()
    if not isinstance(policy, trainers.MultiHeadPolicy) or policy.pooled:
        raise InvalidInputError(f"expected a policy with a head per gait, got {base.path}")
    return policy.tasks


def _by_method(results: Results) -> dict[str, dict[str, dict[float, Group]]]:
    """{gait: {method: {seconds of demonstrations, rising: records of all seeds}}}."""
    members = Group(record for record in results.of(condition=NEW) if record["agent"] != EXPERT)
    return {
        gait: {
            method: dict(sorted(group(records, "demonstrations_s").items()))
            for method, records in group(of_gait, "agent").items()
        }
        for gait, of_gait in group(members, "task").items()
    }


def enough(levels: Mapping[float, Group]) -> float | None:
    """The fewest seconds from which on, at every budget, all episodes survive; None if there are none.

    Args:
        levels: records by seconds, rising.
    """
    least = None
    for seconds, level in reversed(levels.items()):
        if level.total("survived") < level.total("trials"):
            break
        least = seconds
    return least


def old_cell(members: Group, after: Group) -> str:
    """What became of the old gaits: of their actions in all budgets, and of their success, if it was measured."""
    if len(members.values("old_equal")) < len(members):
        return "-"
    if all(members.values("old_equal")):
        return "equal to the bit"
    changed = f"changed by up to {max(members.values('old_largest_rad')):.2g} rad"
    return f"{count(after.rate())}, {changed}" if after else changed
