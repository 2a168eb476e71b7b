"""Tasks: a gait, the commands it is asked to follow, and what its reward weighs."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gaits import GAITS, Gait
from go1_mtl_gym.rewards import RewardWeights
from go1_mtl_gym.validation import finite_vector, one_of


@dataclass(frozen=True)
class Task:
    """What the robot is asked to do.

    Attributes:
        name: the task's name, which is also its gait's in the built-in tasks.
        gait: the contact plan.
        command_range: largest |vx|, |vy| [m/s] and |yaw rate| [rad/s] that are drawn at random.
        command_limit: largest |vx|, |vy|, |yaw rate| that the environment accepts.
        reward: weights of the reward terms.

    Raises:
        InvalidInputError: if the range exceeds the limit or a figure is negative.
    """

    name: str
    gait: Gait
    command_range: tuple[float, float, float]
    command_limit: tuple[float, float, float] = (2.0, 0.6, 2.0)
    reward: RewardWeights = field(default_factory=RewardWeights)

    def __post_init__(self) -> None:
        span = finite_vector(self.command_range, 3, f"command_range of task {self.name!r}")
        limit = finite_vector(self.command_limit, 3, f"command_limit of task {self.name!r}")
        if (span < 0).any() or (span > limit).any():
            raise InvalidInputError(
                f"command_range of task {self.name!r} must lie between 0 and command_limit {limit.tolist()}, "
                f"got {span.tolist()}"
            )

    def draw_command(self, rng: np.random.Generator) -> np.ndarray:
        """A uniform draw of (vx, vy, yaw rate) from the task's range, shape (3,)."""
        return rng.uniform(-1.0, 1.0, 3) * np.array(self.command_range)

    def check_command(self, command: object) -> np.ndarray:
        """Return a command as a vector (vx [m/s], vy [m/s], yaw rate [rad/s]).

        Raises:
            InvalidInputError: if it is not three finite numbers within `command_limit`.
        """
        vector = finite_vector(command, 3, "command (vx, vy, yaw rate)")
        limit = np.array(self.command_limit)
        if (np.abs(vector) > limit).any():
            raise InvalidInputError(
                f"command (vx, vy, yaw rate) for task {self.name!r} must lie within +-{limit.tolist()}, "
                f"got {vector.tolist()}"
            )
        return vector


TASKS = MappingProxyType(
    {
        task.name: task
        for task in (
            Task("trot", GAITS["trot"], command_range=(0.8, 0.3, 0.5)),
            Task("bound", GAITS["bound"], command_range=(0.5, 0.3, 0.5)),
            Task("jump", GAITS["jump"], command_range=(0.5, 0.3, 0.5)),
            Task("walk", GAITS["walk"], command_range=(0.5, 0.3, 0.5)),
        )
    }
)
"""The registered tasks by name; their order is the order of a policy's heads and of the one-hot task id."""


def check_task_names(names: object) -> tuple[str, ...]:
    """Return a sequence of different names of `TASKS` as a tuple.

    Raises:
        InvalidInputError: if it is something else.
    """
    if isinstance(names, str) or not isinstance(names, Sequence) or not names:
        raise InvalidInputError(f'tasks must be a sequence of task names such as ("trot",), got {names!r}')
    for name in names:
        one_of(name, tuple(TASKS), "task")
    if len(set(names)) != len(names):
        raise InvalidInputError(f"tasks must differ from each other, got {tuple(names)}")
    return tuple(names)
