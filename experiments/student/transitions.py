"""Changes of gait while walking."""

from dataclasses import dataclass

from matplotlib.figure import Figure

import trainers
from experiments import plots
from experiments.agents import Agent, tasks_of, with_expert
from experiments.results import Results, distinct, group
from experiments.stats import Rate
from experiments.student.episodes import counts, other_gaits
from experiments.study import EVALUATION_CODE, Cell, Metrics, Study, option
from experiments.tables import share, table


@dataclass(frozen=True)
class TransitionOptions:
    """Changes of gait."""

    trials: int = option(20, "per ordered pair of gaits")
    before_s: float = option(2.0, "walking in the first gait and in the second [s]")
    after_s: float = option(6.0, "walking in the first gait and in the second [s]")


class Transitions(Study):
    """Changes of gait between every ordered pair, of policies and the expert."""

    name = "student_transitions"
    title = "Gait transitions"
    note = (
        "Successful changes while walking at a drawn command: no fall, and the second gait's commands and steps are "
        "followed as success asks. Last column: without a fall, to all gaits together."
    )
    caption = "Successful gait transitions, of student and expert"
    full = TransitionOptions()
    quick = TransitionOptions(1, 0.5, 3.0)
    code = EVALUATION_CODE
    takes_policies = True

    def agents(self) -> list[Agent]:
        return with_expert(self.policies)

    def cells(self, agent: Agent) -> list[Cell]:
        tasks = tasks_of(agent)
        return [Cell(first, f"to {second}") for first in tasks for second in other_gaits(first, tasks)]

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        return transition(agent, cell, self.options, seed)

    def table(self, results: Results) -> str:
        targets = [name.removeprefix("to ") for name in distinct(results.records, "condition")]
        gaits = dict.fromkeys([*distinct(results.records, "task"), *targets])
        columns = {f"to {gait}": share(condition=f"to {gait}") for gait in gaits} | {"survived": share("survived")}
        return table(group(results.records, ["agent", "task"]), ["", "from"], columns)

    def figure(self, results: Results) -> Figure:
        return plots.transition_figure(transition_rates(results), "successful gait transitions")


def transition(agent: Agent, cell: Cell, options: TransitionOptions, seed: int) -> Metrics:
    """Counts of one change of gait, from the cell's task to the one in its condition."""
    second = cell.condition.removeprefix("to ")
    times = {"before_s": options.before_s, "after_s": options.after_s}
    policy, kwargs = agent.load(), agent.env_kwargs
    return counts(trainers.evaluate_transition(policy, cell.task, second, options.trials, seed, **times, **kwargs))


def transition_rates(results: Results, key: str = "succeeded") -> dict[str, dict[tuple[str, str], Rate]]:
    """{agent: {(from, to): successes}}."""
    rates: dict[str, dict[tuple[str, str], Rate]] = {}
    for (agent, first, condition), members in group(results.records, ["agent", "task", "condition"]).items():
        if condition.startswith("to "):
            rates.setdefault(agent, {})[first, condition.removeprefix("to ")] = members.rate(key)
    return rates
