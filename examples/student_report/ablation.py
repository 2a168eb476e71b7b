"""What every choice in the main job is worth: students that differ from a reduced job's in one setting each."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import trainers
from student_report.commanded import DRAWN
from student_report.lab import summary
from student_report.switching import SwitchingConfig, switching

CHANGED = "changed world"
"""A part beside `DRAWN` and the gaits that are changed to: drawn commands in another world than the model's."""
CHANGED_WORLD = {"friction": 0.7, "payload_kg": 1.5, "action_delay_s": 0.01, "joint_friction": 0.5}
"""Arguments of `Go1Env`: the middles of the ranges of the report's section on robustness, together."""


@dataclass(frozen=True)
class AblationConfig:
    """Drawn commands that change, in two worlds, and changes of gait.

    Attributes:
        episodes, changed_episodes: per gait, in the model's world and in the changed one.
        seconds: duration of each [s].
        command_interval: time between commands [s].
        switching: the changes of gait.
    """

    episodes: int = 20
    changed_episodes: int = 5
    seconds: float = 20.0
    command_interval: float = 5.0
    switching: SwitchingConfig = SwitchingConfig(trials=3)

    def parts(self, task: str, tasks: Sequence[str]) -> tuple[str, ...]:
        """The two worlds, and the gaits that are changed to from `task`."""
        return (DRAWN, CHANGED, *self.switching.parts(task, tasks))


def ablation(who: Any, task: str, what: str, config: AblationConfig, seed: int, **env_kwargs: Any) -> dict[str, Any]:
    """See `student_lab.summary`; the same commands for everybody."""
    if what not in (DRAWN, CHANGED):
        return switching(who, task, what, config.switching, seed, **env_kwargs)
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
