"""How well students of several training seeds follow commands that change, inside their ranges and in the corners."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import trainers
from student_report.lab import summary
from student_report.phase import with_correction

DRAWN, CORNERS, PHASE_FREE, CORRECTED = "drawn", "corners", "phase_free", "clock with correction"
"""Parts: commands from the inside of the range, from its corners, and from its inside for students that are told no
clock: those without any, and those that keep one of their own and correct it."""


@dataclass(frozen=True)
class CommandedConfig:
    """Drawn commands, from a standing start.

    Attributes:
        episodes, corner_episodes, phase_free_episodes: of each part, per gait and student.
        seconds: duration of each [s].
        command_interval: time between commands [s].
        correction: of the clocks that are corrected, see `trainers.PhaseFreePolicy`.
    """

    episodes: int = 100
    corner_episodes: int = 20
    phase_free_episodes: int = 20
    seconds: float = 30.0
    command_interval: float = 5.0
    correction: float = 0.5

    def parts(self, task: str, tasks: Sequence[str]) -> tuple[str, ...]:
        """The kinds of episodes."""
        return (DRAWN, CORNERS, PHASE_FREE, CORRECTED)


def commanded(who: Any, task: str, what: str, config: CommandedConfig, seed: int, **env_kwargs: Any) -> dict[str, Any]:
    """See `student_lab.summary`; the same commands for everybody."""
    episodes = {DRAWN: config.episodes, CORNERS: config.corner_episodes}
    result = trainers.evaluate(
        with_correction(who, config.correction) if what == CORRECTED else who,
        task,
        episodes.get(what, config.phase_free_episodes),
        config.seconds,
        seed,
        command_interval=config.command_interval,
        corners=what == CORNERS,
        **env_kwargs,
    )
    return summary(result)
