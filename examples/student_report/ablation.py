"""What every choice in the main job is worth: students that differ from a reduced job's in one setting each."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import trainers
from student_report.lab import summary

DRAWN, CHANGED = "drawn", "changed world"
"""Parts: the model's world, and another one. The others are the gaits that are changed to."""
CHANGED_WORLD = {"friction": 0.7, "payload_kg": 1.5, "action_delay_s": 0.01, "joint_friction": 0.5}
"""Arguments of `Go1Env`: the middles of the ranges of the report's section on robustness, together."""


@dataclass(frozen=True)
class AblationConfig:
    """Drawn commands that change, in two worlds, and changes of gait.

    Attributes:
        episodes, changed_episodes: per gait, in the model's world and in the changed one.
        seconds: duration of each [s].
        command_interval: time between commands [s].
        trials: changes of gait per ordered pair.
        before_s, after_s: walking in the first gait and in the second [s].
    """

    episodes: int = 20
    changed_episodes: int = 5
    seconds: float = 20.0
    command_interval: float = 5.0
    trials: int = 3
    before_s: float = 2.0
    after_s: float = 6.0

    def parts(self, task: str, tasks: Sequence[str]) -> tuple[str, ...]:
        """The two worlds, and the gaits that are changed to from `task`."""
        return (DRAWN, CHANGED, *(name for name in tasks if name != task))


def ablation(who: Any, task: str, what: str, config: AblationConfig, seed: int, **env_kwargs: Any) -> dict[str, Any]:
    """See `student_lab.summary`; the same commands for everybody."""
    if what not in (DRAWN, CHANGED):
        spans = {"before_s": config.before_s, "after_s": config.after_s}
        return summary(trainers.evaluate_switch(who, task, what, config.trials, seed, **spans, **env_kwargs))
    result = trainers.evaluate(
        who,
        task,
        config.episodes if what == DRAWN else config.changed_episodes,
        config.seconds,
        seed,
        command_interval=config.command_interval,
        **(env_kwargs | (CHANGED_WORLD if what == CHANGED else {})),
    )
    return summary(result)
