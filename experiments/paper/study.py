"""The paper's tables as studies: which networks are trained, and how they stand beside the published ones."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, NamedTuple

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

import trainers
from experiments import plots
from experiments.agents import EXPERT, Agent
from experiments.paper import settings
from experiments.paper.differences import differences
from experiments.paper.networks import Network, account, held_out
from experiments.paper.published import KINDS, METRICS, MULTI_HEAD, PER_GAIT, POOLED, PUBLISHED, TARGETS
from experiments.paper.settings import NAMED, TRAIN, UNSEEN, PaperOptions, Table, shard_jobs
from experiments.results import Group, Record, Results, group
from experiments.stats import estimate
from experiments.study import ALL_GAITS, Cell, Metrics, Study
from experiments.tables import estimated, markdown, number
from experiments.training_runs import collect

SHOWN = {"mse": "MSE [rad^2]", "mae": "MAE [rad]", "r2": "R2", "r2_joint_mean": "R2, mean of joints"}
DIGITS = {"mse": ".6f", "mae": ".5f", "r2": ".5f", "r2_joint_mean": ".5f"}
USES = {NAMED: "the authors' held-out command", UNSEEN: "other held-out commands"}
PAPERS_KINDS = {MULTI_HEAD: "multi-task", POOLED: "single-task"}
TRAINING, CURVE = "training", "curve"


class Learner(NamedTuple):
    """Networks that differ in their seed alone; sorted, narrow ones come first, in the order of `KINDS`."""

    width: int
    steps: int
    precision: str
    rank: int

    @property
    def kind(self) -> str:
        """One of `KINDS`."""
        return [*KINDS][self.rank]


class PaperStudy(Study):
    """One of the paper's tables, with data of this project's expert."""

    table_of: ClassVar[Table]
    caption = "Held-out loss per gait over the gradient steps; a line per training seed"
    more_captions: ClassVar[dict[str, str]] = {
        "_targets": "Joint targets of the front left leg, of student and expert, on held-out rows"
    }
    full = PaperOptions()
    quick = settings.QUICK
    keys = (*Study.keys, "width", "steps", "precision")
    code = (*Study.code, "experiments.paper.networks", "experiments.paper.settings", "experiments.training_runs")

    @property
    def cell_options(self) -> PaperOptions:
        """All but which networks there are."""
        return replace(self.options, widths=(1,), seeds=(0,), kinds=(MULTI_HEAD,))

    @property
    def shared_options(self) -> PaperOptions:
        """What the data depends on, and how networks are trained, but for what their files' names say."""
        return replace(self.cell_options, steps=1, precision="float32", device="cpu", threads=1)

    def agents(self) -> list[Agent]:
        return [Agent(EXPERT), *map(Agent, self.options.kinds)]

    def cells(self, agent: Agent) -> list[Cell]:
        if agent.name == EXPERT:
            return [Cell(ALL_GAITS, "data")]
        tasks = self.table_of.gaits if agent.name == PER_GAIT else (ALL_GAITS,)
        options = self.options
        return [
            Cell(task, f"{width} wide", seed) for width in options.widths for seed in options.seeds for task in tasks
        ]

    def prepare(self, n_jobs: int) -> None:
        collect([job for jobs in shard_jobs(self.table_of, self.options).values() for job in jobs], self.folder, n_jobs)

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        if agent.name == EXPERT:
            return account(self.table_of, self.options, self.folder)
        return self.network(agent.name, int(cell.condition.split()[0]), cell.seed, cell.task).train()

    def network(self, kind: str, width: int, seed: int, task: str = ALL_GAITS) -> Network:
        """One of the networks."""
        gait = None if task == ALL_GAITS else task
        return Network(self.table_of, self.options, self.folder, kind, width, seed, gait)

    def more(self) -> dict[str, Any]:
        jobs = shard_jobs(self.table_of, self.options)[TRAIN]
        largest = {gait: self.options.largest(gait) for gait in self.table_of.gaits}
        return {"env_kwargs": jobs[0].as_dict()["env_kwargs"], "largest": largest}

    # -- Shown ---------------------------------------------------------------------------------------------------------

    def table(self, results: Results) -> str:
        return score_table(self.table_of.published, results, uses(results)[0], paper=True)

    def paragraphs(self, results: Results) -> list[str]:
        name, parts = self.table_of.published, []
        for i, use in enumerate(uses(results)):
            parts += [f"With {USES[use]}:", score_table(name, results, use, paper=i == 0)]
        return [
            *parts,
            "Means over training seeds with the 95 % interval of Student's t where there are several. R2 is flattened "
            "over the joints, each about its own mean; how the paper averages its R2 is not stated.",
            "### Targets",
            verdict_table(name, results),
            "### What differs",
            differences(name, results),
            "### Data and training",
            data_table(results),
            training_table(results),
        ]

    def figure(self, results: Results) -> Figure:
        colors, styles = {MULTI_HEAD: plots.BLUE, POOLED: plots.RED}, ("-", "--", ":", "-.")
        curves = [record for record in results.of(condition=CURVE) if record["agent"] in colors]
        widths = sorted({record["width"] for record in curves}, reverse=True)
        per_gait = group(curves, "task")
        figure, axes = plots.grid(len(per_gait), len(per_gait), (3.3, 3.2), (0.4, 0.0), sharey=True)
        for ax, (gait, members) in zip(axes.flat, per_gait.items()):
            for record in members:
                style = styles[min(widths.index(record["width"]), len(styles) - 1)]
                label = f"{KINDS[record['agent']]}, {record['width']} wide"
                ax.plot(record["at_step"], record["curve_mse"], style, color=colors[record["agent"]], label=label)
            ax.set_yscale("log")
            ax.xaxis.set_major_locator(MaxNLocator(4))
            ax.set_title(gait, fontsize=10)
            ax.set_xlabel("gradient steps", fontsize=9)
            ax.tick_params(labelsize=8)
        axes[0, 0].set_ylabel("held-out MSE [rad²]", fontsize=9)
        plots.legend(figure, axes.flat)
        return figure

    def more_figures(self) -> dict[str, Figure]:
        """Joint targets of the widest multi-head network on held-out rows."""
        widest = self.network(MULTI_HEAD, max(self.options.widths), self.options.seeds[0]).file
        if not widest.is_file():
            return {}
        rows = next(iter(held_out(self.table_of, self.options, self.folder).values()))
        return {"_targets": trainers.joint_target_figure(trainers.load(widest), rows)}


class Simulation(PaperStudy):
    """Trot, jump and bound at 1 kHz: the paper's table of simulation."""

    name = "paper_simulation"
    title = "Simulation"
    table_of = settings.SIMULATION


class Hardware(PaperStudy):
    """Trot and walk at the rates and with the noise of a robot: the paper's table of hardware."""

    name = "paper_hardware"
    title = "Hardware, and data like a robot's"
    table_of = settings.HARDWARE


class HalfNoise(PaperStudy):
    """The paper's table of hardware with half the noise on the expert's estimate."""

    name = "paper_hardware_half_noise"
    title = "Hardware, and data like a robot's with half the noise"
    table_of = settings.HALF_NOISE


class Estimator(PaperStudy):
    """The paper's table of hardware with an expert that has to estimate its state."""

    name = "paper_hardware_estimator"
    title = "Hardware, and data like a robot's with a state estimator"
    table_of = settings.ESTIMATOR


# -- Tables ------------------------------------------------------------------------------------------------------------


def learners(records: Sequence[Record]) -> dict[Learner, Group]:
    """The records of every learner, sorted."""
    groups = group(records, ["width", "steps", "precision", "agent"])
    ranked = {Learner(*key[:3], [*KINDS].index(key[3])): members for key, members in groups.items()}
    return dict(sorted(ranked.items()))


def scores(results: Results, gait: str, use: str) -> dict[Learner, Group]:
    """One-step errors in one gait on some held-out rows, of the learners that know it."""
    return learners(results.of(task=gait, condition=use))


def uses(results: Results) -> list[str]:
    """Kinds of held-out rows that networks were measured on."""
    return [use for use in USES if results.of(condition=use)]


def score_table(name: str, results: Results, use: str, paper: bool) -> str:
    """One row per gait and learner, with the rows of the paper's table of that name before ours if wanted."""
    rows = []
    for gait, published in PUBLISHED[name].items():
        for kind, metrics in published.items() if paper else ():
            cells = [number(metrics.get(key), DIGITS[key]) for key in SHOWN]
            rows.append([gait, f"paper, {PAPERS_KINDS[kind]}", "-", "2560", "-", "-", *cells])
        for learner, members in scores(results, gait, use).items():
            cells = [estimated(estimate(members.values(key)), DIGITS[key]) for key in SHOWN]
            about = [learner.precision, str(learner.width), str(learner.steps), str(len(members))]
            rows.append([gait, KINDS[learner.kind], *about, *cells])
    header = ["gait", "learner", "trained in", "width", "steps", "seeds", *SHOWN.values()]
    return markdown(header, rows, text_columns=3)


def worse_than_pooled(members: Group, pooled: Group) -> list[str]:
    """Those of `METRICS` in which a learner's mean is not better than the pooled one's."""
    sign = {name: 1.0 if name == "r2" else -1.0 for name in METRICS}
    return [name for name in METRICS if not sign[name] * (members.mean(name) - pooled.mean(name)) > 0.0]


def verdict_table(name: str, results: Results) -> str:
    """One row per gait, held-out rows and multi-head learner; bold misses its target."""
    rows = []
    for gait, target in TARGETS[name].items():
        for use in uses(results):
            metrics = scores(results, gait, use)
            for learner in (each for each in metrics if each.kind == MULTI_HEAD):
                pooled = metrics.get(learner._replace(rank=[*KINDS].index(POOLED)))
                better = "-" if pooled is None else _better(worse_than_pooled(metrics[learner], pooled))
                r2 = metrics[learner].mean("r2")
                reached = number(r2, ".5f") if r2 > target else f"**{number(r2, '.5f')}**"
                about = [str(learner.width), str(learner.steps), f"> {target:g}"]
                rows.append([gait, USES[use], learner.precision, *about, reached, better])
    header = ["gait", "held out", "trained in", "width", "steps", "target, R2", "multi-head, R2"]
    return markdown([*header, "better than pooled in"], rows, text_columns=3)


def _better(worse: Sequence[str]) -> str:
    if not worse:
        return f"all {len(METRICS)}"
    return f"**all but {', '.join(SHOWN[name] for name in worse)}**" if len(worse) < len(METRICS) else "**none**"


def data_table(results: Results) -> str:
    """One row per gait: seconds of rows, and falls of the expert, by use."""
    data = [record for record in results.of(agent=EXPERT) if record["condition"].startswith("data: ")]
    held = [use for use in USES if any(record["condition"] == f"data: {use}" for record in data)]
    rows = []
    for gait, members in group(data, "task").items():
        seconds = {record["condition"]: f"{record['data_s']:g}" for record in members}
        by_use = [seconds[f"data: {use}"] for use in (TRAIN, *held)]
        rows.append([gait, *by_use, str(members.total("falls"))])
    header = ["gait", "training [s]", *(f"{USES[use]} [s]" for use in held), "falls of the expert"]
    return markdown(header, rows)


def training_table(results: Results) -> str:
    """One row per learner: number of networks, time and rows per second of all its trainings."""
    rows = []
    for learner, members in learners(results.of(condition=TRAINING)).items():
        devices = sorted({f"{record['device']}, {record['threads']} thread(s)" for record in members})
        where = [KINDS[learner.kind], "; ".join(devices), learner.precision]
        about = [str(learner.width), str(learner.steps), str(len(members)), f"{members.total('seconds') / 60:.1f}"]
        rows.append([*where, *about, f"{members.mean('samples_per_s'):,.0f}"])
    times = ["training, all [min]", "rows per second, mean"]
    header = ["learner", "on", "trained in", "width", "steps", "networks", *times]
    return markdown(header, rows, text_columns=3)


def summary(measured: Mapping[str, Results]) -> list[str]:
    """R2 alone, of every table: one row per gait and way of training, the paper's beside ours."""
    rows = []
    for name, results in measured.items():
        data = name.removeprefix("paper_")
        for gait, published in PUBLISHED[settings.TABLES[data].published].items():
            theirs = [number(published.get(kind, {}).get("r2"), ".4f") for kind in (MULTI_HEAD, POOLED)]
            metrics = scores(results, gait, uses(results)[0])
            for way in dict.fromkeys(learner[:3] for learner in metrics):
                ranked = [metrics.get(Learner(*way, rank)) for rank in range(len(KINDS))]
                ours = [estimated(estimate(members.values("r2")), ".4f") if members else "-" for members in ranked]
                rows.append([data.replace("_", " "), gait, *theirs, ", ".join(map(str, way)), *ours])
    theirs = [f"{PAPERS_KINDS[kind]}, paper" for kind in (MULTI_HEAD, POOLED)]
    header = ["data", "gait", *theirs, "width, steps, trained in", *(f"{kind}, here" for kind in KINDS.values())]
    return ["## R2 at a glance", markdown(header, rows, text_columns=2)]
