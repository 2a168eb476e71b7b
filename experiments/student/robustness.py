"""How far the world may differ from the model's: one quantity at a time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments import plots
from experiments.agents import EXPERT, Agent, tasks_of, with_expert
from experiments.results import Record, Results, distinct, group
from experiments.student.episodes import drawn
from experiments.study import EVALUATION_CODE, Cell, Metrics, Study, option
from experiments.tables import Column, share, table
from go1_mtl_gym.sensing.observation import SensorNoise
from go1_mtl_gym.sensing.state_noise import EstimatorNoise
from go1_mtl_gym.sim.domain_randomization import OF_SENSORS

TARGET = 0.95
"""Fraction of episodes that a policy is to survive."""
QUANTITIES: dict[str, tuple[str, tuple[float, ...]]] = {
    "friction": ("friction", (0.4, 0.55, 0.7, 0.85, 1.0)),
    "payload_kg": ("payload [kg]", (0.0, 0.75, 1.5, 2.25, 3.0)),
    "action_delay_s": ("action delay [s]", (0.0, 0.005, 0.01, 0.015, 0.02)),
    "motor_strength": ("motor strength", (0.9, 0.95, 1.0, 1.05, 1.1)),
    "joint_friction": ("joint friction [N m]", (0.0, 0.25, 0.5, 0.75, 1.0)),
    "rotor_inertia": ("rotor inertia [kg m²]", (0.0, 0.0025, 0.005, 0.0075, 0.01)),
    "joint_damping": ("joint damping [N m s/rad]", (0.0, 0.25, 0.5, 0.75, 1.0)),
    "contact_time_s": ("contact time [s]", (0.005, 0.02, 0.04, 0.08, 0.16)),
    "settle_s": ("settling before the clock [s]", (0.0, 0.25, 0.5, 0.75, 1.0)),
    "encoder_offset": ("encoder offset [rad]", (0.0, 0.015, 0.03, 0.045, 0.06)),
    "sensor_delay_s": ("sensor delay [s]", (0.0, 0.005, 0.01, 0.015, 0.02)),
    "noise": ("noise, in units of the default", (0.0, 0.5, 1.0, 1.5, 2.0)),
}
"""Name of a quantity -> what it is called, and its values from one end of the range to the other; see `world`."""


@dataclass(frozen=True)
class RobustnessOptions:
    """Drawn commands in a world that differs."""

    episodes: int = option(20, "per gait and value")
    seconds: float = option(10.0, "duration of each [s]")
    command_interval: float = option(5.0, "time between commands [s]")
    every: int = option(1, "1 for all values, 2 for the ends and the middle")
    quantities: tuple[str, ...] = option(tuple(QUANTITIES), "which of QUANTITIES")


class Robustness(Study):
    """Friction, payload, delay, motors, joints, contacts, sensors and noise, one at a time, of policies and expert."""

    name = "student_robustness"
    title = "Another world"
    note = (
        "In the middle of each range: survived and successful episodes with drawn commands that change; bold where "
        f"fewer than {TARGET:.0%}. The picture shows the whole ranges."
    )
    caption = "Survival over one quantity of the world at a time, of student and expert"
    full = RobustnessOptions()
    quick = RobustnessOptions(1, 2.5, 1.5, every=4)
    code = EVALUATION_CODE
    takes_policies = True

    def agents(self) -> list[Agent]:
        return with_expert(self.policies)

    def cells(self, agent: Agent) -> list[Cell]:
        # The expert's state has none of the sensors' faults.
        felt = [name for name in self.options.quantities if agent.name != EXPERT or name not in OF_SENSORS]
        return [Cell(task, quantity) for task in tasks_of(agent) for quantity in felt]

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        options, policy, levels = self.options, agent.load(), []
        for value in QUANTITIES[cell.condition][1][:: options.every]:
            kwargs = {**agent.env_kwargs, **world(cell.condition, value, agent.name == EXPERT)}
            levels.append({"value": value, **drawn(policy, cell.task, options.episodes, options, seed, **kwargs)})
        return levels

    def table(self, results: Results) -> str:
        policies = [record for record in results.records if record["agent"] != EXPERT]
        groups = {}
        for (agent, quantity), members in group(policies, ["agent", "condition"]).items():
            middle = _middle(members)
            groups[agent, QUANTITIES[quantity][0], f"{middle:g}"] = members.where(value=middle)
        gaits = {gait: _both(gait) for gait in distinct(results.records, "task")}
        return table(groups, ["", "quantity", "middle"], gaits)

    def figure(self, results: Results) -> Figure:
        shown = [name for name in QUANTITIES if name in distinct(results.records, "condition")]
        figure, axes = plots.grid(len(shown), 4, (2.9, 2.15), (0.4, 0.5), sharey=True)
        for ax, quantity in zip(axes.flat, shown):
            _survival(ax, results.of(condition=quantity))
            ax.set_xlabel(QUANTITIES[quantity][0], fontsize=9)
            ax.tick_params(labelsize=8)
        for ax in axes[:, 0]:
            ax.set_ylabel("survival", fontsize=9)
        plots.legend(figure, axes.flat[:1])
        return figure


def world(quantity: str, value: float, for_expert: bool) -> dict[str, Any]:
    """Arguments of `Go1Env` that make a quantity have a value for a policy or the expert.

    Noise is the policy's sensors' or the expert's estimator's; what is no fault of sensors is an argument itself.
    """
    if quantity in OF_SENSORS:
        return {"sensors": {OF_SENSORS[quantity]: value}}
    if quantity != "noise":
        return {quantity: value}
    return {"estimator_noise": EstimatorNoise().scaled(value)} if for_expert else {"noise": SensorNoise().scaled(value)}


def _both(gait: str) -> Column:
    """Survived and successful episodes of a gait."""
    cells = [share(key, TARGET, task=gait) for key in ("survived", "succeeded")]
    return lambda members: ", ".join(cell(members) for cell in cells) if members.where(task=gait) else "-"


def _middle(records: Sequence[Record]) -> float:
    values = distinct(records, "value")
    return values[len(values) // 2]


def _survival(ax: Axes, records: Sequence[Record]) -> None:
    styles = plots.agent_styles(distinct(records, "agent"), EXPERT)
    for agent, members in group(records, "agent").items():
        style, levels = styles[agent], group(members, "value")
        together = [level.rate("survived") for level in levels.values()]
        weakest = [
            min(of_gait.rate("survived").value for of_gait in group(level, "task").values())
            for level in levels.values()
        ]
        plots.band(ax, [*levels], together, style["color"], 0.15)
        ax.plot([*levels], [r.value for r in together], **style, linewidth=2.0, marker="o", markersize=3.5, label=agent)
        ax.plot([*levels], weakest, **style, linewidth=0.9, label=f"{agent}, weakest gait")
    ax.set_xticks([*levels], [f"{value:g}" for value in levels])
    ax.axhline(TARGET, color="0.7", linewidth=0.8, linestyle=":", zorder=0)
    plots.shares(ax)
