"""Changes of gait while walking: of the student, every ordered pair of its gaits."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import trainers
from student_report.lab import summary


@dataclass(frozen=True)
class SwitchingConfig:
    """Changes of gait.

    Attributes:
        trials: per ordered pair of gaits.
        before_s, after_s: walking in the first gait and in the second [s].
    """

    trials: int = 20
    before_s: float = 2.0
    after_s: float = 6.0

    def parts(self, task: str, tasks: Sequence[str]) -> tuple[str, ...]:
        """The gaits that are changed to from `task`."""
        return tuple(name for name in tasks if name != task)


def switching(who: Any, first: str, second: str, config: SwitchingConfig, seed: int, **env_kwargs: Any) -> dict:
    """From the first gait to the second: see `student_lab.summary`."""
    spans = {"before_s": config.before_s, "after_s": config.after_s}
    return summary(trainers.evaluate_transition(who, first, second, config.trials, seed, **spans, **env_kwargs))
