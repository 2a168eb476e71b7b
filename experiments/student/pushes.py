"""How hard a policy may be pushed: the largest push, per gait and direction, that nearly all trials survive."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments import plots
from experiments.agents import Agent, tasks_of, with_expert
from experiments.pushing import CRUISE, DIRECTIONS, PAIRS, push_w, weaker
from experiments.results import Group, Results
from experiments.searches import climb
from experiments.study import EVALUATION_CODE, Cell, Metrics, Study, option
from experiments.tables import Column
from go1_mtl_gym import TASKS
from trainers.data.environments import derive_seed, make_env
from trainers.evaluation.rollout import Rollout

STREAM = "kick"
"""Word that the seeds are drawn with; the published results were."""


def _largest(direction: str) -> Column:
    """The largest push in a direction, which may be more where the search ended."""

    def cell(members: Group) -> str:
        pushed = members.where(condition=direction)
        return f"{'>= ' * pushed[0]['at_cap']}{pushed[0]['largest']:.1f}" if pushed else "-"

    return cell


@dataclass(frozen=True)
class PushOptions:
    """The search for the largest push, from the smallest upward."""

    trials: int = option(20, "per size")
    fraction: float = option(0.9, "of the trials that must survive")
    step: float = option(0.2, "of the grid of sizes, and the smallest of them [m/s]")
    grid: int = option(25, "largest number of sizes")
    before_s: float = option(1.5, "walking before the push [s]; a random part of the gait's period is added")
    after_s: float = option(3.0, "without a fall after it [s]")
    directions: tuple[str, ...] = option(tuple(DIRECTIONS), "which of DIRECTIONS")


class Pushes(Study):
    """The largest push that policies and the expert survive, per gait and direction."""

    name = "student_pushes"
    title = "Pushes"
    note = (
        "Largest change of the base's velocity that at least 90 % of the trials survive at a random phase of the "
        "cycle, walking at 0.3 m/s."
    )
    caption = "Largest push survived, of student and expert"
    rows = {"task": "gait", "agent": ""}
    columns = {f"{name} [m/s]": _largest(name) for name in DIRECTIONS}
    full = PushOptions()
    quick = PushOptions(1, grid=1, before_s=0.5, after_s=0.5)
    code = (*EVALUATION_CODE, "experiments.pushing", "experiments.searches")
    takes_policies = True

    def agents(self) -> list[Agent]:
        return with_expert(self.policies)

    def cells(self, agent: Agent) -> list[Cell]:
        return [Cell(task, direction) for task in tasks_of(agent) for direction in self.options.directions]

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        """Search in one direction.

        Returns:
            "largest" [m/s]; "at_cap": whether the search ended for lack of larger pushes; "tried": [size, survived,
            trials] of all sizes that were. A fall before the push counts as one after it.
        """
        options, policy = self.options, agent.load()
        kwargs = {**getattr(policy, "env_kwargs", {}), **agent.env_kwargs}
        period = TASKS[cell.task].gait.period
        env = make_env(cell.task, None, **kwargs, episode_s=options.before_s + period + options.after_s + 1.0)
        tried: list[list[Any]] = []

        def passes(size: float) -> bool:
            trials = range(options.trials)
            survived = sum(survives(env, policy, cell, size, options, (seed, i)) for i in trials)
            tried.append([size, survived, options.trials])
            return survived >= options.fraction * options.trials - 1e-9

        try:
            largest = climb(options.step, options.step, options.grid - 1, passes)
        finally:
            env.close()
        return {"largest": largest, "at_cap": largest == tried[-1][0], "tried": tried}

    def figure(self, results: Results) -> Figure:
        return plots.dots(
            {
                f"largest push survived, {name} [m/s]": plots.panel(
                    results.records, "agent", "task", partial(weaker, pair=pair)
                )
                for name, pair in PAIRS.items()
            }
        )


def survives(env: Any, policy: Any, cell: Cell, size: float, options: PushOptions, trial: tuple[int, int]) -> bool:
    """Whether one push [m/s] is survived; a trial (seed, number) is the same walk for every size."""
    keys = (STREAM, cell.task, cell.condition, *trial)
    base, hz = env.unwrapped, env.unwrapped.control_hz
    before_s = options.before_s + np.random.default_rng(derive_seed(*keys)).uniform() * TASKS[cell.task].gait.period
    rollout = Rollout(env, policy, derive_seed(*keys), {"task": cell.task, "command": CRUISE})
    rollout.walk(round(before_s * hz))
    if not rollout.fallen:
        base.push(push_w(cell.condition, size, base.state.rpy[2]))
        rollout.walk(round(options.after_s * hz))
    return not rollout.fallen
