"""How far the expert goes in the space of gaits."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments import plots
from experiments.agents import EXPERT, Agent
from experiments.any_gait.episodes import block_of, blocks, episode, figures, held_out_gaits, record
from experiments.results import Record, Results
from experiments.stats import Rate
from experiments.study import EVALUATION_CODE, Cell, Study, option
from experiments.tables import count, markdown, number
from go1_mtl_gym import GaitSpace
from trainers.data.operator import OperatorConfig

INSIDE, AROUND = "declared space", "around it"
SPACES = {INSIDE: GaitSpace(), AROUND: replace(GaitSpace(), period=(0.2, 0.9), duty=(0.3, 0.9))}
"""What gaits are drawn from: the space that the package declares, and one that reaches beyond it in period and duty."""
BINS = {"period [s]": (0.2, 0.3, 0.4, 0.5, 0.65, 0.9), "swing [s]": (0.0, 0.08, 0.12, 0.16, 0.24, 0.4, 0.7)}


@dataclass(frozen=True)
class MapOptions:
    """Gaits, each in one episode in an operator's hands."""

    gaits: int = option(500, "in each of the two spaces")
    seconds: float = option(30.0, "of an episode")
    block: int = option(20, "gaits that are measured in one go")


class ExpertMap(Study):
    """Where in the space of gaits the expert walks, in an operator's hands, and where it ends."""

    name = "any_gait_expert"
    title = "The expert in the space of gaits"
    note = (
        "One episode per gait that was drawn, in the hands of an operator who keeps the gait, pushes of up to 0.3 m/s "
        "included. Swing is the shortest time that a leg has in the air per cycle."
    )
    caption = "Episodes of the expert by period and duty: success, survival without success, fall"
    full = MapOptions()
    quick = MapOptions(2, 3.0, 2)
    keys = ("agent", "task", "condition", "seed", "number")
    code = (*EVALUATION_CODE, "experiments.any_gait.episodes")

    def agents(self) -> list[Agent]:
        return [Agent(EXPERT)]

    def cells(self, agent: Agent) -> list[Cell]:
        return blocks(dict.fromkeys(SPACES, self.options.gaits), self.options.block)

    def measure(self, agent: Agent, cell: Cell, seed: int) -> list[dict[str, Any]]:
        name, begin = block_of(cell)
        many = min(self.options.block, self.options.gaits - begin)
        hands = OperatorConfig().of_one_gait()
        found = []
        for gait_number, gait in held_out_gaits(SPACES[name], begin, many, seed):
            done = episode(agent.load(), gait, self.options.seconds, name, seed, gait_number, operator=hands)
            found.append(record(done, condition=name, number=gait_number, **figures(gait)))
        return found

    def table(self, results: Results) -> str:
        rows = []
        for name in SPACES:
            records = results.of(condition=name)
            if not records:
                continue
            rows.append([name, "all", *_scores(records)])
            for title, edges in BINS.items():
                values = np.array([_figure(each, title) for each in records])
                for low, high in zip(edges, edges[1:]):
                    chosen = [each for each, value in zip(records, values) if low <= value < high]
                    if chosen:
                        rows.append([name, f"{title.replace(' [s]', '')} {low:g} to {high:g} s", *_scores(chosen)])
        return markdown(["space", "gaits", "survived", "succeeded", "velocity error [m/s]"], rows, text_columns=2)

    def figure(self, results: Results) -> Figure | None:
        figure = plots.new_figure(5.5, 4.0)
        ax = figure.subplots()
        kinds = {
            "success": (plots.GREEN, [each for each in results.records if each["succeeded"]]),
            "survival": (plots.YELLOW, [each for each in results.records if each["survived"] > each["succeeded"]]),
            "fall": (plots.RED, [each for each in results.records if not each["survived"]]),
        }
        for label, (color, records) in kinds.items():
            points = np.array([(each["gait"][0], np.mean(each["gait"][1:5])) for each in records]).reshape(-1, 2)
            ax.scatter(*points.T, s=9, color=color, label=f"{label} ({len(records)})", linewidths=0)
        inside = SPACES[INSIDE]
        (left, right), (low, high) = inside.period, inside.duty
        ax.plot([left, right, right, left, left], [low, low, high, high, low], color="0.35", linewidth=1)
        ax.set_xlabel("period [s]")
        ax.set_ylabel("duty, mean of the legs")
        plots.legend(figure, [ax])
        return figure


def _scores(records: Sequence[Record]) -> list[str]:
    errors = [each["velocity_error"] for each in records if each["velocity_error"] is not None]
    rates = [Rate(sum(each[key] for each in records), len(records)) for key in ("survived", "succeeded")]
    return [*map(count, rates), number(float(np.median(errors)) if errors else None, ".3f")]


def _figure(of: Record, title: str) -> float:
    """Period, or the shortest swing, of a record's gait [s]."""
    period, duties = of["gait"][0], of["gait"][1:5]
    return period if title.startswith("period") else period * (1.0 - max(duties))
