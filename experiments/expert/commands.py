"""Drawn commands from a standing start: kept for a whole episode, and changing."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.expert.lab import ExpertOptions, ExpertStudy, Lab
from experiments.results import Results
from experiments.study import option
from experiments.tables import mean, share

ONE, CHANGING = "one command", "new commands"


@dataclass(frozen=True)
class CommandOptions(ExpertOptions):
    """Drawn commands."""

    episodes: int = option(20, "per gait")
    seconds: float = option(30.0, "duration of each [s]")
    change_s: float = option(5.0, "time between changing commands [s]")


class Commands(ExpertStudy):
    """Drawn commands, kept and changing, as policies are measured."""

    name = "expert_commands"
    title = "Drawn commands"
    rows = {"task": "gait"}
    columns = {
        "success": share(),
        "survival": share("survived"),
        "velocity error [m/s]": mean("velocity_error", ".3f"),
        "yaw rate error [rad/s]": mean("yaw_rate_error", ".3f"),
        "steps/s": mean("step_rate", ".2f"),
    }
    full = CommandOptions()
    quick = CommandOptions(("trot", "jump"), episodes=1, seconds=3.0, change_s=2.0)

    def measure_in(self, lab: Lab, task: str, seed: int) -> list[dict[str, Any]]:
        options, records = self.options, []
        for condition, interval in ((ONE, None), (CHANGING, options.change_s)):
            result = lab.score(task, options.seconds, seed, options.episodes, command_interval=interval)
            records += [{"condition": condition, **episode(walked)} for walked in result.episodes]
        return records

    def table(self, results: Results) -> str:
        return self.table_of(results.of(condition=ONE))

    def paragraphs(self, results: Results) -> list[str]:
        changing = self.table_of(results.of(condition=CHANGING))
        return [self.table(results), "The same with commands that change:", changing]


def episode(record: Any) -> dict[str, Any]:
    """The metrics of an episode, see `trainers.EpisodeRecord`."""
    return {
        "trials": 1,
        "survived": int(not record.fallen),
        "succeeded": int(record.success),
        "velocity_error": record.velocity_error,
        "yaw_rate_error": record.yaw_rate_error,
        "step_rate": float(np.mean(record.step_rate)),
        "survival_s": record.survival_s,
        "episode_seed": record.seed,
        "command": record.commands[0],
        "step_rates": record.step_rate,
    }
