"""How well policies of several training seeds follow commands that change, and an operator's hands."""

from dataclasses import dataclass, replace
from typing import Any

from matplotlib.figure import Figure

from experiments import plots
from experiments.agents import EXPERT, SHARED, STUDENT, Agent
from experiments.results import Group, Results, group
from experiments.stats import Rate
from experiments.student.episodes import drawn, operated
from experiments.study import EVALUATION_CODE, Cell, Metrics, Study, option
from experiments.tables import count, judged, markdown, number
from experiments.training_runs import TrainedPolicy, TrainingRun, changed
from trainers.pipeline.config import JobConfig

DRAWN, CORNERS, HANDS = "drawn", "corners", "in hands"
"""Commands from the inside of the range, from its corners, and an operator's hands."""
SEEDS = {"agent": STUDENT, "condition": DRAWN}
"""Values of the records of the main job's policies, one per training seed."""
TARGETS = {"success_rate": 0.95, "velocity_error": 0.05, "error_ratio": 2.0}
"""Smallest success rate, largest velocity error [m/s], and largest ratio of it to the expert's."""


@dataclass(frozen=True)
class CommandedOptions:
    """Drawn commands and hands, from a standing start."""

    seeds: tuple[int, ...] = option((0, 1, 2, 3, 4), "of the trainings")
    episodes: int = option(50, "with drawn commands, and as many in hands, per gait and policy")
    corner_episodes: int = option(20, "with commands from the corners, per gait and policy")
    seconds: float = option(30.0, "duration of each [s]")
    command_interval: float = option(5.0, "time between commands [s]")
    job: JobConfig = option(JobConfig(), "of the trainings; its seed is not used")


class Commanded(Study):
    """Commands that change, for the main job's policies of several training seeds and the expert."""

    name = "student_commanded"
    title = "Commands that change, over training seeds"
    note = (
        "Successful episodes with a new command every few seconds, of the main job's students for several training "
        "seeds together, then of the worst seed; mean velocity error, that of the worst seed, the expert's, and the "
        "largest ratio of a seed's to it; the same with commands from the corners of the ranges, and in the hands of "
        "an operator that keeps to the gait. Bold misses "
        f"a target: success {TARGETS['success_rate']:.0%}, velocity error {TARGETS['velocity_error']:g} m/s, "
        f"{TARGETS['error_ratio']:g} times the expert's."
    )
    caption = "Success per gait and training seed, and velocity errors beside the expert's"
    full = CommandedOptions()
    quick = CommandedOptions((0,), 1, 1, 3.0, 2.0, job=JobConfig.from_preset("smoke", tasks=("trot", "bound")))
    code = (*EVALUATION_CODE, "experiments.training_runs")

    def agents(self) -> list[Agent]:
        runs = [
            TrainingRun(replace(self.options.job, seed=seed), self.cache / "training") for seed in self.options.seeds
        ]
        policies = [TrainedPolicy(STUDENT, run.config.seed, path=run.policy, run=run) for run in runs]
        shared = {name: value for name, value in self.options.job.env_kwargs.items() if name in SHARED}
        return [*policies, Agent(EXPERT, env_kwargs=shared)]

    def cells(self, agent: Agent) -> list[Cell]:
        return [Cell(task, condition) for task in self.options.job.tasks for condition in (DRAWN, CORNERS, HANDS)]

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        options, policy, corners = self.options, agent.load(), cell.condition == CORNERS
        episodes = options.corner_episodes if corners else options.episodes
        if cell.condition == HANDS:
            return operated(policy, cell.task, episodes, options, seed, **agent.env_kwargs)
        return drawn(policy, cell.task, episodes, options, seed, corners=corners, **agent.env_kwargs)

    def more(self) -> dict[str, Any]:
        return {"targets": TARGETS, "training": changed(self.options.job)}

    def table(self, results: Results) -> str:
        rows = []
        for gait, members in group(results.records, "task").items():
            seeds, expert = members.where(**SEEDS), members.where(agent=EXPERT, condition=DRAWN)
            others = [(agent, condition) for condition in (CORNERS, HANDS) for agent in (STUDENT, EXPERT)]
            success = _success(seeds) if seeds else ["-"] * 3
            tracked = _tracked(seeds, expert.mean("velocity_error"))
            counted = [count(members.where(agent=agent, condition=condition).rate()) for agent, condition in others]
            rows.append([gait, *success, *tracked, *counted])
        header = ["gait", "success", "95 % interval", "worst seed", "velocity error [m/s]", "worst seed's", "expert's"]
        return markdown([*header, "worst ratio", "corners", "expert's", "in hands", "expert's"], rows)

    def figure(self, results: Results) -> Figure:
        success: dict[str, dict[str, Any]] = {"all seeds": {}, "worst seed": {}}
        errors: dict[str, dict[str, float | None]] = {"all seeds": {}, "worst seed": {}, EXPERT: {}}
        for gait, members in group(results.records, "task").items():
            seeds = members.where(**SEEDS)
            success["all seeds"][gait], success["worst seed"][gait] = seeds.rate(), _worst(seeds)
            errors["all seeds"][gait] = seeds.mean("velocity_error")
            errors["worst seed"][gait] = seeds.largest("velocity_error")
            errors[EXPERT][gait] = members.where(agent=EXPERT, condition=DRAWN).mean("velocity_error")
        return plots.dots({"success": success, "velocity error [m/s]": errors})


def _worst(seeds: Group) -> Rate | None:
    """Success of the training seed that has the smallest."""
    return min((of_seed.rate() for of_seed in group(seeds, "seed").values()), key=lambda rate: rate.value, default=None)


def _success(seeds: Group) -> list[str]:
    """Success of all training seeds together, its interval, and the worst seed's."""
    low, high = seeds.rate().interval
    worst = judged(_worst(seeds).value, TARGETS["success_rate"], "higher", ".0%")
    return [count(seeds.rate(), TARGETS["success_rate"]), f"{low:.1%} ... {high:.1%}", worst]


def _tracked(seeds: Group, expert: float | None) -> list[str]:
    """Mean velocity error, the worst training seed's, the expert's, and the ratio of the last two [m/s]."""
    mean, worst = seeds.mean("velocity_error"), seeds.largest("velocity_error")
    errors = [judged(error, TARGETS["velocity_error"], "lower", ".3f") for error in (mean, worst)]
    ratio = worst / expert if worst is not None and expert else None
    return [*errors, number(expert, ".3f"), judged(ratio, TARGETS["error_ratio"], "lower", ".2f")]
