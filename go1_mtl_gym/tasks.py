"""Tasks: a gait, the commands it is asked to follow, and what its reward weighs."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gait_space import NAMED
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
        command_limit: largest |vx|, |vy|, |yaw rate| that the environment accepts; of the built-in tasks, the largest
            along each axis that the expert survived in 20 of 20 episodes (docs/results/expert_limits.json).
        reward: weights of the reward terms.
        push_limit: largest push forward, backward and sideways, a change of the trunk's velocity [m/s]; of the built-in
            tasks, what the expert survives at every phase while it walks at 0.3 m/s (docs/results/expert_pushes.json).

    Raises:
        InvalidInputError: if the gait is none, the range exceeds the limit, or a figure is negative.
    """

    name: str
    gait: Gait
    command_range: tuple[float, float, float]
    command_limit: tuple[float, float, float] = (2.0, 0.6, 2.0)
    reward: RewardWeights = field(default_factory=RewardWeights)
    push_limit: tuple[float, float, float] = (0.5, 0.5, 0.5)

    def __post_init__(self) -> None:
        """Check everything, and make tuples of what came."""
        if not isinstance(self.gait, Gait):
            raise InvalidInputError(f"gait of task {self.name!r} must be a Gait, got {self.gait!r}")
        span = finite_vector(self.command_range, 3, f"command_range of task {self.name!r}")
        limit = finite_vector(self.command_limit, 3, f"command_limit of task {self.name!r}")
        if (span < 0).any() or (span > limit).any():
            raise InvalidInputError(
                f"command_range of task {self.name!r} must lie between 0 and command_limit {limit.tolist()}, "
                f"got {span.tolist()}"
            )
        pushes = finite_vector(self.push_limit, 3, f"push_limit of task {self.name!r}")
        if (pushes < 0).any():
            raise InvalidInputError(f"push_limit of task {self.name!r} must not be negative, got {pushes.tolist()}")
        object.__setattr__(self, "push_limit", tuple(pushes.tolist()))
        object.__setattr__(self, "command_range", tuple(span.tolist()))  # tasks can be compared
        object.__setattr__(self, "command_limit", tuple(limit.tolist()))

    def draw_command(self, rng: np.random.Generator) -> np.ndarray:
        """A uniform draw of (vx, vy, yaw rate) from the task's range, shape (3,)."""
        return rng.uniform(-1.0, 1.0, 3) * np.array(self.command_range)

    def draw_corner(self, rng: np.random.Generator) -> np.ndarray:
        """A uniform draw among the corners of the task's range: each of (vx, vy, yaw rate) at + or - its largest."""
        return rng.choice((-1.0, 1.0), 3) * np.array(self.command_range)

    def largest_push(self, angle: float) -> float:
        """The largest push in a direction [m/s]: of an ellipse in each quadrant, with `push_limit` as its axes.

        Args:
            angle: from forward to the left, in the heading frame [rad].
        """
        forward, backward, sideways = self.push_limit
        x, y = np.cos(angle), np.sin(angle)
        axes = np.array([forward if x >= 0 else backward, sideways])
        if not axes.all():
            return 0.0
        return float(1.0 / np.hypot(x / axes[0], y / axes[1]))

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


_REGISTRY = {
    task.name: task
    for task in (
        Task(
            "trot",
            GAITS["trot"],
            command_range=(1.3, 0.6, 1.3),
            command_limit=(2.0, 1.0, 3.0),
            push_limit=(2.0, 1.8, 2.1),
        ),
        Task(
            "bound",
            GAITS["bound"],
            command_range=(1.4, 0.6, 1.3),
            command_limit=(2.1, 1.0, 3.0),
            push_limit=(2.0, 0.9, 2.1),
        ),
        Task(
            "jump",
            GAITS["jump"],
            command_range=(0.9, 0.35, 1.0),
            command_limit=(1.7, 0.7, 3.0),
            push_limit=(2.2, 1.8, 1.1),
        ),
        Task(
            "walk",
            GAITS["walk"],
            command_range=(0.6, 0.4, 1.0),
            command_limit=(1.1, 0.9, 2.0),
            push_limit=(1.4, 2.0, 1.3),
        ),
        Task(
            "pace",
            GAITS["pace"],
            command_range=(1.3, 0.5, 1.0),
            command_limit=(2.5, 1.0, 3.0),
            push_limit=(2.3, 2.6, 1.2),
        ),
        Task(
            "gallop",
            GAITS["gallop"],
            command_range=(1.3, 0.5, 1.0),
            command_limit=(2.5, 1.0, 3.0),
            push_limit=(1.9, 1.3, 2.3),
        ),
    )
}
TASKS = MappingProxyType(_REGISTRY)
"""The registered tasks by name, live and read-only; `go1_mtl_gym.register_task` adds to them.

Their order is the order of a policy's heads and of the one-hot task id.
"""
BUILT_IN_TASKS = tuple(_REGISTRY)
"""The tasks that come with the package, in head order: what the main job teaches unless told otherwise."""
PAPER_TASKS = ("trot", "bound", "jump", "walk")
"""The gaits of arXiv 2505.08574, in head order."""
ANY_GAIT = "any_gait"
"""The task whose gait is drawn from a `GaitSpace` in every episode, and can be changed to any other."""
STRIDE = 0.28
"""How far a foot goes back under the body in its stance at the largest speed that is drawn for a gait [m]."""


def any_gait_task(gait: Gait) -> Task:
    """The task `ANY_GAIT` with a gait.

    A leg can reach only so far, so the speed that is asked for follows from how long the feet stay on the ground.
    """
    forward = float(np.clip(STRIDE / gait.stance_s.max(), 0.3, 1.2))
    return Task(
        ANY_GAIT,
        gait,
        command_range=(forward, 0.4 * forward, 0.8),
        command_limit=(2.0, 1.0, 2.0),
        push_limit=(1.0, 1.0, 0.8),
    )


_REGISTRY[ANY_GAIT] = any_gait_task(NAMED["trot"])
_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z][a-z0-9]*)*")


def add_task(task: Task) -> bool:
    """Put a task at the end of `TASKS`; whether it was new. `go1_mtl_gym.register_task` also registers its id.

    Raises:
        InvalidInputError: if it is no `Task`, its name is no word like "amble" or "fast_trot", or another task has it.
    """
    if not isinstance(task, Task):
        raise InvalidInputError(f"a Task was expected, got {task!r}")
    if not isinstance(task.name, str) or not _NAME.fullmatch(task.name) or task.name == "multi_gait":
        raise InvalidInputError(
            "a registered task's name must be lower-case words joined by underscores, such as 'amble' or 'fast_trot', "
            f"and not 'multi_gait', got {task.name!r}"
        )
    known = _REGISTRY.get(task.name)
    if known is not None and known != task:
        raise InvalidInputError(f"the name {task.name!r} is taken by another task, {known}; got {task}")
    _REGISTRY.setdefault(task.name, task)
    return known is None


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


def check_reset_options(
    options: object, tasks: tuple[str, ...], default_task: str | None
) -> tuple[str | None, np.ndarray | None, Gait | None]:
    """Return task's name, command and gait that an episode was asked to have; None: draw one.

    Args:
        options: what an environment's `reset` was given.
        tasks: names that the environment knows.
        default_task: the environment's own, or None.

    Raises:
        InvalidInputError: for an unknown option, task or impossible command, or a gait for a task that has its own.
    """
    if not (options is None or isinstance(options, Mapping)):
        raise InvalidInputError(f'reset options must be a dictionary such as {{"task": "trot"}}, got {options!r}')
    given = dict(options or {})
    for name in given:
        one_of(name, ("command", "gait", "task"), "reset option")
    task, command, gait = given.get("task"), given.get("command"), given.get("gait")
    task = default_task if task is None else one_of(task, tasks, "task")
    if gait is not None:
        check_gait(gait, task)
    if command is not None:
        for name in tasks if task is None else (task,):  # whichever is drawn must allow it
            command = TASKS[name].check_command(command)
    return task, command, gait


def gait_can_change(tasks: tuple[str, ...]) -> bool:
    """Whether an environment of these tasks has more than one gait."""
    return len(tasks) > 1 or tasks == (ANY_GAIT,)


def check_gait(gait: object, task: str | None) -> Gait:
    """Return a gait that a task may be given.

    Args:
        gait: that was asked for.
        task: name of the task; None if one is to be drawn.

    Raises:
        InvalidInputError: if it is no gait, or the task has its own.
    """
    if not isinstance(gait, Gait):
        raise InvalidInputError(f"a Gait was expected, got {gait!r}")
    if task != ANY_GAIT:
        raise InvalidInputError(f"a gait can be chosen where the task is {ANY_GAIT!r}; here it is {task!r}")
    return gait
