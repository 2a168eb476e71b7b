"""Changes of gait while walking, and a long walk in which everything changes at once."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments import plots
from experiments.expert.lab import ExpertOptions, ExpertStudy, Lab, generator, shared_range
from experiments.results import Results
from experiments.student.transitions import transition_rates
from experiments.study import option
from experiments.tables import mean, share
from go1_mtl_gym import TASKS


@dataclass(frozen=True)
class TransitionOptions(ExpertOptions):
    """Changes of gait while walking."""

    trials: int = option(20, "per ordered pair of gaits")
    before_s: float = option(2.0, "walking in the first gait [s]; a random part of its period is added")
    after_s: float = option(4.0, "walking in the second gait [s]")


class Transitions(ExpertStudy):
    """Changes of gait between every ordered pair that the expert survives."""

    name = "expert_transitions"
    title = "Gait transitions"
    note = "Survived changes of gait, from this gait to all others."
    caption = "Survived gait transitions"
    rows = {"task": "from"}
    columns = {"survived": share("survived")}
    full = TransitionOptions()
    quick = TransitionOptions(("trot", "jump"), trials=1, after_s=1.0)

    def measure_in(self, lab: Lab, task: str, seed: int) -> list[dict[str, Any]]:
        options, records = self.options, []
        for target in (name for name in options.tasks if name != task):
            survived = trials = 0
            for i in range(options.trials):
                rng = generator("transitions", task, target, seed, i)
                lab.begin(task, rng.uniform(-1, 1, 3) * shared_range(task, target), target, seed, i)
                if not lab.walk(options.before_s + rng.uniform() * TASKS[task].gait.period):
                    continue
                lab.env.set_task(target)
                trials += 1
                survived += lab.walk(options.after_s)
            records.append({"condition": f"to {target}", "trials": trials, "survived": survived})
        return records

    def figure(self, results: Results) -> Figure:
        return plots.transition_figure(transition_rates(results, "survived"), "survived gait transitions")


@dataclass(frozen=True)
class LongWalkOptions(ExpertOptions):
    """A long walk in which everything changes."""

    steps: int = option(35_000, "control steps per gait that it begins with")
    command_s: float = option(2.0, "time between new commands [s]")
    transition_s: float = option(5.0, "mean time between changes of gait [s]")
    push_s: float = option(3.0, "mean time between pushes [s]")
    push: float = option(0.5, "largest change of the base's velocity [m/s]")


class LongWalk(ExpertStudy):
    """Random commands, changes of gait and pushes at once, for hundreds of thousands of steps."""

    name = "expert_long_walk"
    title = "The long walk"
    note = "Random commands, gait transitions and pushes at once."
    rows = {"task": "begun in"}
    columns = {
        "control steps": mean("steps", ".0f"),
        "gait transitions": mean("transitions", ".0f"),
        "pushes": mean("pushes", ".0f"),
        "falls": mean("falls", ".0f"),
    }
    full = LongWalkOptions()
    quick = LongWalkOptions(("trot", "jump"), steps=100)

    def measure_in(self, lab: Lab, task: str, seed: int) -> list[dict[str, Any]]:
        options, hz, rng = self.options, lab.env.control_hz, generator("soak", task, seed)
        span, steps, falls, transitions, pushes, fallen = shared_range(*options.tasks), 0, 0, 0, 0, True
        while steps < options.steps:
            if fallen:
                lab.begin(task, rng.uniform(-1, 1, 3) * span, seed, steps)
                since = 0
            if since and since % round(options.command_s * hz) == 0:
                lab.env.set_command(rng.uniform(-1, 1, 3) * span)
            if rng.uniform() * options.transition_s * hz < 1:
                lab.env.set_task(str(rng.choice(options.tasks)))
                transitions += 1
            if rng.uniform() * options.push_s * hz < 1:
                size, angle = options.push * np.sqrt(rng.uniform()), rng.uniform(0, 2 * np.pi)
                lab.env.push((size * np.cos(angle), size * np.sin(angle), 0.0))
                pushes += 1
            fallen = lab.step()["fallen"]
            steps, since, falls = steps + 1, since + 1, falls + fallen
        return [{"steps": steps, "transitions": transitions, "pushes": pushes, "falls": falls}]

    def table(self, results: Results) -> str:
        return self.table_of([record for record in results.records if "steps" in record])
