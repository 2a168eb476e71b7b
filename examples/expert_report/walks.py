"""Walking as it is meant to be: drawn commands, changes of command, changes of gait, and everything at once."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from expert_report.lab import Lab, generator, shared_range
from go1_mtl_gym import TASKS


@dataclass(frozen=True)
class SurvivalConfig:
    """Drawn commands from a standing start.

    Attributes:
        episodes: per gait.
        seconds: duration of each [s].
        change_s: time between commands in the variant with changing ones [s].
    """

    episodes: int = 20
    seconds: float = 30.0
    change_s: float = 5.0


@dataclass(frozen=True)
class TransitionConfig:
    """Changes of gait while walking.

    Attributes:
        trials: per ordered pair of gaits.
        before_s: walking in the first gait [s]; a random share of its period is added.
        after_s: walking in the second gait [s].
        tasks: the gaits that are changed to.
    """

    trials: int = 20
    before_s: float = 2.0
    after_s: float = 4.0
    tasks: tuple[str, ...] = tuple(TASKS)


@dataclass(frozen=True)
class SoakConfig:
    """A long walk in which everything changes.

    Attributes:
        steps: control steps per gait that it begins with.
        command_s: time between new commands [s].
        switch_s: mean time between changes of gait [s].
        kick_s: mean time between kicks [s].
        push: largest change of the base's velocity [m/s].
        tasks: the gaits that are changed to.
    """

    steps: int = 35_000
    command_s: float = 2.0
    switch_s: float = 5.0
    kick_s: float = 3.0
    push: float = 0.5
    tasks: tuple[str, ...] = tuple(TASKS)


def survival(lab: Lab, task: str, config: SurvivalConfig, seed: int) -> dict[str, Any]:
    """Record of every episode in "fixed", and, summed up, in "changing" those with a new command every few seconds."""
    fixed = lab.score(task, config.seconds, seed, config.episodes).as_dict()
    changing = lab.score(task, config.seconds, seed, config.episodes, command_interval=config.change_s).as_dict()
    return {"fixed": fixed, "changing": changing | {"episodes": config.episodes}}


def transitions(lab: Lab, task: str, config: TransitionConfig, seed: int) -> dict[str, Any]:
    """From `task` to each other gait: {gait: {"survived", "trials"}}; a fall before the change is not a trial."""
    results = {}
    for target in config.tasks:
        if target == task:
            continue
        survived = trials = 0
        for i in range(config.trials):
            rng = generator("transitions", task, target, seed, i)
            lab.begin(task, rng.uniform(-1, 1, 3) * shared_range(task, target), target, seed, i)
            if not lab.walk(config.before_s + rng.uniform() * TASKS[task].gait.period):
                continue
            lab.env.set_task(target)
            trials += 1
            survived += lab.walk(config.after_s)
        results[target] = {"survived": survived, "trials": trials}
    return results


def soak(lab: Lab, task: str, config: SoakConfig, seed: int) -> dict[str, Any]:
    """Random commands, changes of gait and kicks until the steps are used up; a fall begins a new episode."""
    rng, hz, steps, falls, switches, kicks = generator("soak", task, seed), lab.env.control_hz, 0, 0, 0, 0
    span = shared_range(*{task, *config.tasks})
    fallen = True
    while steps < config.steps:
        if fallen:
            lab.begin(task, rng.uniform(-1, 1, 3) * span, seed, steps)
            since = 0
        if since and since % round(config.command_s * hz) == 0:
            lab.env.set_command(rng.uniform(-1, 1, 3) * span)
        if rng.uniform() * config.switch_s * hz < 1:
            lab.env.set_task(str(rng.choice(config.tasks)))
            switches += 1
        if rng.uniform() * config.kick_s * hz < 1:
            size, angle = config.push * np.sqrt(rng.uniform()), rng.uniform(0, 2 * np.pi)
            lab.env.push((size * np.cos(angle), size * np.sin(angle), 0.0))
            kicks += 1
        fallen = lab.step()["fallen"]
        steps, since, falls = steps + 1, since + 1, falls + fallen
    return {"steps": steps, "falls": falls, "switches": switches, "kicks": kicks}
