"""One episode, but for who drives: everything that it depends on, and how it is played again."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np

from go1_mtl_gym import TASKS
from trainers.data.environments import EnvFactory, base_env, derive_seed
from trainers.data.operator import OperatorConfig
from trainers.data.operator_wrapper import OperatorWrapper
from trainers.evaluation.rollout import Rollout, opened
from trainers.evaluation.scoring import EpisodeRecord, Series, score

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
    """

    task: str
    seed: int
    seconds: float
    command: tuple[float, ...] | None = None
    command_interval: float | None = None
    corners: bool = False
    operator: OperatorConfig | None = None

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
        rng = np.random.default_rng(derive_seed("commands", self.seed))
        draw = TASKS[self.task].draw_corner if self.corners else TASKS[self.task].draw_command
        options: dict[str, Any] = {"task": self.task}
        if self.command is not None or self.corners:
            options["command"] = tuple(draw(rng).tolist()) if self.command is None else self.command
        with opened(make_env, self.task, {**env_kwargs, "episode_s": self.seconds}) as env:
            base = base_env(env)
            if self.operator is not None:
                env = OperatorWrapper(env, self.operator)
            rollout = Rollout(env, policy_or_expert, self.seed, options)
            given = [rollout.command]
            steps = round(self.seconds * base.control_hz)
            every = max(1, round(self.command_interval * base.control_hz)) if self.command_interval else steps

            def before_step(i: int) -> None:
                if watch is not None:
                    watch(env, i)
                if i and i % every == 0:
                    given.append(tuple(draw(rng).tolist()))
                    base.set_command(given[-1])

            series = rollout.walk(steps, before_step)
            if watch is not None:
                watch(env, len(series.measured))
        task = self.task if self.operator is None else None
        return score(series, rollout.fallen, self.seed, tuple(given), base.control_hz, task), series
