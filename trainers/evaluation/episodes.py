"""One episode, but for who drives: everything that it depends on, and how it is played again."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, cast

import gymnasium
import numpy as np

from go1_mtl_gym import TASKS, Gait, Go1Env, Task
from go1_mtl_gym.tasks import ANY_GAIT, any_gait_task, check_gait
from go1_mtl_gym.validation import one_of
from trainers.data.environments import EnvFactory, base_env, derive_seed
from trainers.data.operator import OperatorConfig
from trainers.data.operator_wrapper import OperatorWrapper
from trainers.evaluation.rollout import Rollout, opened
from trainers.evaluation.scoring import EpisodeRecord, Series, score
from trainers.utils.validation import checked_seed, positive

Watch = Callable[[gymnasium.Env, int], None]
"""Called with the environment and the number of steps that were made, before each of them and once at the end."""


@dataclasses.dataclass(frozen=True)
class EpisodeSetup:
    """All that an episode depends on, besides the environment's arguments and who drives.

    Attributes:
        task: that it begins in.
        seed: of the reset, the commands and the hands.
        seconds: its duration [s].
        command: (vx [m/s], vy [m/s], yaw rate [rad/s]) that it begins with; None draws it.
        command_interval: a new command is drawn every so many seconds; None keeps the first.
        corners: whether commands are drawn from the corners of the task's range.
        operator: whose hands drive instead, or None.
        gait: of the task "any_gait"; None lets the environment draw it.

    Raises:
        InvalidInputError: if gait, task, seed or duration cannot be.
    """

    task: str
    seed: int
    seconds: float
    command: tuple[float, ...] | None = None
    command_interval: float | None = None
    corners: bool = False
    operator: OperatorConfig | None = None
    gait: Gait | None = None

    def __post_init__(self) -> None:
        one_of(self.task, tuple(TASKS), "task")
        if self.gait is not None:
            check_gait(self.gait, self.task)
        checked_seed(self.seed)
        positive(self.seconds, "seconds")

    def play(
        self,
        policy_or_expert: Any,
        env_kwargs: Mapping[str, Any],
        make_env: EnvFactory,
        watch: Watch | None = None,
    ) -> tuple[EpisodeRecord, Series]:
        """Let somebody drive; the same in every process.

        Args:
            policy_or_expert: as in `trainers.evaluate`.
            env_kwargs: of the environment, without ``episode_s``.
            make_env: the environment factory.
            watch: looks on.

        Returns:
            The scores, and what was measured.
        """
        commands = DrawnCommands(self)
        with opened(make_env, self.task, {**env_kwargs, "episode_s": self.seconds}) as env:
            base, env = base_env(env), self.in_hands(env)
            rollout = Rollout(env, policy_or_expert, self.seed, commands.options)

            def before_step(i: int) -> None:
                if watch is not None:
                    watch(env, i)
                commands.drive(env, i)

            series = rollout.walk(round(self.seconds * base.control_hz), before_step)
            if watch is not None:
                watch(env, len(series.measured))
        task, given = self.task if self.operator is None else None, (rollout.command, *commands.given)
        return score(series, rollout.fallen, self.seed, given, base.control_hz, task), series

    def in_hands(self, env: gymnasium.Env) -> gymnasium.Env:
        """The environment, in the operator's hands if there is one."""
        return env if self.operator is None else OperatorWrapper(env, self.operator)


class DrawnCommands:
    """The commands of an episode that nobody's hands give; the same in every process.

    Args:
        setup: of the episode.

    Attributes:
        options: of the reset that the episode begins with.
        given: commands (vx [m/s], vy [m/s], yaw rate [rad/s]) that were given since, in order.
    """

    def __init__(self, setup: EpisodeSetup) -> None:
        self._task = TASKS[setup.task] if setup.gait is None else any_gait_task(setup.gait)
        self._rng = np.random.default_rng(derive_seed("commands", setup.seed))
        self._corners, self._interval_s = setup.corners, setup.command_interval
        self.given: list[tuple[float, float, float]] = []
        self.options: dict[str, Any] = {"task": setup.task}
        if setup.gait is not None:
            self.options["gait"] = setup.gait
        if setup.command is not None or setup.corners:
            self.options["command"] = self._drawn(self._task) if setup.command is None else setup.command

    def drive(self, env: gymnasium.Env, step: int) -> None:
        """Give a command if one is due; a `Watch`."""
        base = base_env(env)
        if self._interval_s and step and step % max(1, round(self._interval_s * base.control_hz)) == 0:
            chosen_there = self._task.name == ANY_GAIT and "gait" not in self.options
            task = cast(Go1Env, base).requested_task if chosen_there else self._task
            self.given.append(self._drawn(task))
            base.set_command(self.given[-1])

    def _drawn(self, task: Task) -> tuple[float, float, float]:
        """A command of a task's range, or of its corners."""
        draw = task.draw_corner if self._corners else task.draw_command
        forward, sideways, yaw_rate = draw(self._rng).tolist()
        return forward, sideways, yaw_rate
