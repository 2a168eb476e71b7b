"""How well students of several training seeds follow commands that change, inside their ranges and in the corners."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import trainers
from student_report.lab import summary

DRAWN, CORNERS, CLOCKLESS = "drawn", "corners", "clockless"
"""Parts: commands from the inside of the range, from its corners, and from its inside for students without a clock."""


@dataclass(frozen=True)
class CommandedConfig:
    """Drawn commands, from a standing start.

    Attributes:
        episodes, corner_episodes, clockless_episodes: of each part, per gait and student.
        seconds: duration of each [s].
        command_interval: time between commands [s].
    """

    episodes: int = 100
    corner_episodes: int = 20
    clockless_episodes: int = 20
    seconds: float = 30.0
    command_interval: float = 5.0

    def parts(self, task: str, tasks: Sequence[str]) -> tuple[str, ...]:
        """The kinds of episodes."""
        return (DRAWN, CORNERS, CLOCKLESS)


def commanded(who: Any, task: str, what: str, config: CommandedConfig, seed: int, **env_kwargs: Any) -> dict[str, Any]:
    """See `student_lab.summary`; the same commands for everybody."""
    episodes = {DRAWN: config.episodes, CORNERS: config.corner_episodes, CLOCKLESS: config.clockless_episodes}
    result = trainers.evaluate(
        who,
        task,
        episodes[what],
        config.seconds,
        seed,
        command_interval=config.command_interval,
        corners=what == CORNERS,
        **env_kwargs,
    )
    return summary(result)
