"""How fast does a policy learn, next to a bare loop of PyTorch, to `imitation` and to numpy?"""

from collections.abc import Callable, Iterator, Mapping

from experiments.agents import Agent
from experiments.benchmarks import rows, steps
from experiments.benchmarks.turns import RATE, Heat, TrainingOptions, run
from experiments.results import Group, Results, group
from experiments.study import Cell, Metrics, Study
from experiments.tables import markdown, spans

SECTIONS: Mapping[str, tuple[str, Callable[[TrainingOptions], Iterator[Heat]]]] = {
    "step": ("gradient steps", steps.step),
    "heads": ("gradient steps by number of heads", steps.heads),
    "precision": ("gradient steps by precision", steps.precision),
    "reading": ("demonstrations from disk", rows.reading),
    "shuffling": ("shuffled batches", rows.shuffling),
    "collection": ("collecting demonstrations", rows.collection),
}
"""Name -> what is measured, and how."""


class TrainingBenchmark(Study):
    """Gradient steps, heads, precision, reading, shuffling and collecting, in turns with others."""

    name = "benchmark_training"
    title = "Training against others"
    note = (
        "Everybody has a turn in every round, in one order and then in the other; ratios are taken within a round: "
        "their median and quartiles. Bare loop: the same network, loss, AdamW, clipping and one-cycle schedule in "
        "twenty lines of PyTorch. imitation: its behavior cloning as it comes, on stable-baselines3's policy with "
        "three hidden layers of the same width, and on our network. bfloat16 rounds what the network computes, weights "
        "and loss stay float32; medium allows PyTorch to round inside of matrix products. Demonstrations are made up."
    )
    full = TrainingOptions()
    quick = TrainingOptions(
        rounds=2,
        rows=4000,
        batch_size=256,
        widths=(32,),
        threads=(1,),
        steps=3,
        learning_steps=10,
        heads=(1, 4),
        stored_rows=8000,
        collect_s=0.2,
    )
    alone = True

    def agents(self) -> list[Agent]:
        return [Agent("all")]

    def cells(self, agent: Agent) -> list[Cell]:
        return [Cell(name) for name in self.options.sections]

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        _, heats = SECTIONS[cell.task]
        return [record for heat in heats(self.options) for record in run(heat, self.options.rounds)]

    def table(self, results: Results) -> str:
        sections = group(results.records, "task").items()
        return "\n\n".join(f"**{SECTIONS[name][0]}**\n\n{_table(members)}" for name, members in sections)


def _table(members: Group) -> str:
    references = list(dict.fromkeys(name for record in members for name in record["over"]))
    others = [name for name in ("loss",) if members.values(name)]
    rows = []
    for record in members:
        ratios = [spans(record["over"].get(name, {}).get(RATE)) for name in references]
        metrics = [spans(record.get(name), ".2e") for name in others]
        rows.append([record["condition"], record["agent"], f"{record[RATE][1]:.0f}", *ratios, *metrics])
    header = ["setting", "agent", "samples/s", *(f"x {name}" for name in references), *others]
    return markdown(header, rows, text_columns=2)
