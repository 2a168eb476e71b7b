"""What people do with the stick: reach further and further, leave it alone, and let go of it at full speed."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

import trainers
from experiments import plots
from experiments.agents import EXPERT, Agent, tasks_of, with_expert
from experiments.results import Record, Results, distinct, group
from experiments.student.episodes import counts
from experiments.study import EVALUATION_CODE, Cell, Metrics, Study, option
from experiments.tables import mean, share, table
from go1_mtl_gym import TASKS
from trainers.data.operator import OperatorConfig
from trainers.evaluation.conditions import UNTOUCHED

OTHERS = STANDING, LETTING_GO = "standing", "letting go"
"""Conditions beside those of how far the stick reaches."""
BRAKING = (
    OperatorConfig(full_and_back=3.0, starts_released=1.0)
    .of_moves("straight", "full_and_back", "release")
    .of_one_gait()
)
"""Hands that let go about every five seconds, nine times out of ten from an end of the stick."""


@dataclass(frozen=True)
class HandsOptions:
    """Episodes in the hands of an operator who presses no button."""

    episodes: int = option(12, "of each kind, per gait")
    seconds: float = option(20.0, "duration of each [s]")
    standing_s: float = option(30.0, "duration of those that nobody touches the stick in [s]")
    deflections: tuple[float, ...] = option((0.25, 0.5, 0.75, 1.0, 1.2, 1.5), "of the stick, 1 for the declared range")


class Hands(Study):
    """How far the stick may reach, standing untouched, and letting go at full speed, of policies and the expert."""

    name = "student_hands"
    title = "What people do with the stick"
    note = (
        "Successful episodes in an operator's hands, by how far the stick reaches: 1 is the task's `command_range`, "
        "whose forward speed is the second column, and the policies' demonstrations reach to 1.2. Standing: nobody "
        "touches the stick and a push comes now and then; episodes without a fall. Letting go: the stick goes to one "
        "of its ends, to the other, or ahead, and is let go of every few seconds; successful episodes."
    )
    caption = "Success over the fastest forward command that the stick can give, of student and expert"
    full = HandsOptions()
    quick = HandsOptions(1, 3.0, 3.0, (0.5, 1.5))
    code = EVALUATION_CODE
    takes_policies = True

    def agents(self) -> list[Agent]:
        return with_expert(self.policies)

    def cells(self, agent: Agent) -> list[Cell]:
        return [Cell(task, condition) for task in tasks_of(agent) for condition in self.operators]

    @property
    def operators(self) -> dict[str, OperatorConfig]:
        """Condition -> whose hands they are."""
        reaching = {f"stick to {each:g}": reaching_to(each) for each in self.options.deflections}
        return {**reaching, STANDING: UNTOUCHED, LETTING_GO: BRAKING}

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        """Counts; where the stick's reach is the condition, also the `speeds`."""
        options, operator = self.options, self.operators[cell.condition]
        seconds = options.standing_s if cell.condition == STANDING else options.seconds
        hands = {"operator": operator, **agent.env_kwargs}
        counted = counts(trainers.evaluate(agent.load(), cell.task, options.episodes, seconds, seed, **hands))
        return counted if cell.condition in OTHERS else counted | speeds(cell.task, operator.deflection)

    def table(self, results: Results) -> str:
        counted = {
            condition: share("survived" if condition == STANDING else "succeeded", condition=condition)
            for condition in distinct(results.records, "condition")
        }
        columns = {"declared [m/s]": mean("declared", ".1f"), **counted}
        rows = {
            (gait, agent): members
            for gait, of_gait in group(results.records, "task").items()
            for agent, members in group(of_gait, "agent").items()
        }
        return table(rows, ["gait", ""], columns)

    def figure(self, results: Results) -> Figure:
        gaits = group((record for record in results.records if "fastest" in record), "task")
        figure, axes = plots.grid(len(gaits), 3, (2.9, 2.15), (0.4, 0.6), sharey=True)
        for ax, (gait, members) in zip(axes.flat, gaits.items()):
            _success(ax, members)
            ax.set_title(gait, fontsize=10)
        for ax in axes[:, 0]:
            ax.set_ylabel("success", fontsize=9)
        figure.supxlabel("fastest forward command [m/s]", fontsize=9)
        plots.legend(figure, axes.flat[:1])
        return figure


def reaching_to(deflection: float) -> OperatorConfig:
    """Hands whose stick reaches to a multiple of the task's `command_range`."""
    return OperatorConfig(deflection=deflection).of_one_gait()


def speeds(task: str, deflection: float) -> dict[str, float]:
    """The "fastest" forward command of a stick that reaches so far, and the "declared" one, of a reach of 1 [m/s]."""
    declared, limit = TASKS[task].command_range[0], TASKS[task].command_limit[0]
    return {"fastest": min(deflection * declared, limit), "declared": declared}


def _success(ax: Axes, records: Sequence[Record]) -> None:
    """Success of each agent over how fast the stick can ask it to go."""
    styles = plots.agent_styles(distinct(records, "agent"), EXPERT)
    for agent, members in group(records, "agent").items():
        levels = {speed: level.rate() for speed, level in group(members, "fastest").items()}
        plots.band(ax, [*levels], [*levels.values()], styles[agent]["color"], 0.15)
        line = {**styles[agent], "linewidth": 1.8, "marker": "o", "markersize": 3.5, "label": agent}
        ax.plot([*levels], [rate.value for rate in levels.values()], **line)
    ax.axvline(records[0]["declared"], color="0.5", linewidth=1.0, linestyle=":", label="declared range", zorder=0)
    ax.set_xlim(0.0, 1.05 * max(levels))
    ax.tick_params(labelsize=8)
    plots.shares(ax)
