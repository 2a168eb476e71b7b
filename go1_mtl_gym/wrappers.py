"""What makes demonstrations worth learning from: noise on actions, pushes, and commands and tasks that change."""

from typing import Any

import gymnasium
import numpy as np

from go1_mtl_gym.deprecation import renamed_arguments
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.seeded_wrapper import SeededWrapper
from go1_mtl_gym.tasks import ANY_GAIT, TASKS, Task, any_gait_task, gait_can_change
from go1_mtl_gym.validation import finite_vector, interval_s, number_in

NOISE_CORRELATION_S = 0.1
"""Correlation time of the action noise [s]."""
GAIT_SLEW_S = (0.0, 1.0)
"""For which a gait is on its way to the next one where any gait can be [s]."""


@renamed_arguments(kick="push", kick_interval="push_interval", corner_share="corner_fraction")
class PerturbationWrapper(SeededWrapper):
    """Disturbs a Go1 so that its expert is seen recovering.

    Four disturbances, each drawn from this wrapper's own generator (seeded by ``reset(seed=...)``):
    first-order autoregressive noise on the executed action, its standard deviation drawn per episode from
    U(0, `noise_rad`); horizontal pushes of the trunk's velocity, uniform in a disc of radius `push`, at exponentially
    distributed times; commands redrawn from the task's range; and changes to another of the environment's tasks, which
    begin as `Go1Env.set_task` says, or to another gait where any can be.
    `expert_action` is untouched: it answers for the true state, so the labels are clean.

    Args:
        env: a `Go1Env`, wrapped or not.
        noise_rad: largest standard deviation of the noise [rad].
        push: largest change of velocity [m/s].
        push_interval: mean time between pushes [s].
        command_interval: shortest and longest time between commands [s], or None to leave the command alone.
        corner_fraction: probability with which a redrawn command is a corner of the task's range, every component at
            plus or minus its largest; the others are uniform. The command of a reset is the environment's own.
        task_interval: shortest and longest time between changes of task [s], or None to leave the task alone. A command
            beyond the new task's range is brought to its border.

    Raises:
        InvalidInputError: if a figure is negative or not finite, or tasks are to change where there is only one.
    """

    _STREAM = 0x9E3779B9

    def __init__(
        self,
        env: gymnasium.Env,
        noise_rad: float = 0.06,
        push: float = 0.2,
        push_interval: float = 1.5,
        command_interval: tuple[float, float] | None = (1.5, 4.0),
        corner_fraction: float = 0.0,
        task_interval: tuple[float, float] | None = None,
    ) -> None:
        """Wrap an environment; see the class."""
        super().__init__(env)
        self._noise_rad = number_in(noise_rad, 0.0, 1.0, "noise_rad [rad]")
        self._push_speed = number_in(push, 0.0, 5.0, "push [m/s]")
        self._push_interval = number_in(push_interval, 0.01, 1e6, "push_interval [s]")
        self._command_interval = interval_s(command_interval, "command_interval")
        self._corner_fraction = number_in(corner_fraction, 0.0, 1.0, "corner_fraction")
        self._task_interval = interval_s(task_interval, "task_interval")
        if task_interval is not None and not gait_can_change(self._go1.tasks):
            raise InvalidInputError(f"task_interval must be None for an environment of one task, got {task_interval}")

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Reset the environment; a seed also seeds the disturbances. ``info["executed_action"]`` is 0 yet."""
        observation, info = super().reset(seed=seed, options=options)
        self._sigma = self._rng.uniform(0.0, self._noise_rad) / self._go1.action_map.half_range
        self._noise = self._sigma * self._rng.standard_normal(12)
        self._next_push = self._rng.exponential(self._push_interval)
        self._next_command = self._draw_time(self._command_interval)
        self._next_task = self._draw_time(self._task_interval)
        self._time = 0.0
        return observation, info | {"executed_action": np.zeros(12, dtype=np.float32)}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Disturb, then step; ``info["executed_action"]`` is the action with its noise.

        Raises:
            InvalidInputError: if the action is not 12 finite numbers; nothing is disturbed or stepped.
        """
        env = self._go1
        action = finite_vector(action, 12, "action")
        keep = np.exp(-env.control_s / NOISE_CORRELATION_S)
        self._noise = keep * self._noise + np.sqrt(1 - keep**2) * self._sigma * self._rng.standard_normal(12)
        self._time += env.control_s
        if self._time >= self._next_push:
            self._next_push = self._time + self._rng.exponential(self._push_interval)
            size, angle = self._push_speed * np.sqrt(self._rng.uniform()), self._rng.uniform(0.0, 2 * np.pi)
            env.push([size * np.cos(angle), size * np.sin(angle), 0.0])
        if self._time >= self._next_task:
            self._next_task = self._time + self._draw_time(self._task_interval)
            self._change_task()
        if self._time >= self._next_command:
            self._next_command = self._time + self._draw_time(self._command_interval)
            env.set_command(self._draw_command(env.requested_task))
        executed = np.clip(action + self._noise, -1.0, 1.0).astype(np.float32)
        observation, reward, terminated, truncated, info = self.env.step(executed)
        return observation, float(reward), terminated, truncated, info | {"executed_action": executed}

    def _change_task(self) -> None:
        """Ask for another task than the one that was asked for last; where any gait can be, for another gait."""
        env = self._go1
        if env.tasks == (ANY_GAIT,):
            self._change_gait()
            return
        name = str(self._rng.choice([name for name in env.tasks if name != env.requested_task.name]))
        span = np.array(TASKS[name].command_range)
        env.set_command(np.clip(env.command, -span, span))
        env.set_task(name)

    def _change_gait(self) -> None:
        """Ask for another gait, at once or bit by bit."""
        env, gaits = self._go1, self._go1.config.gaits
        assert gaits is not None  # wherever the task is known
        gait, slew_s = gaits.draw(self._rng), float(self._rng.uniform(*GAIT_SLEW_S))
        span = np.array(any_gait_task(gait).command_range)
        env.set_gait(gait, slew_s, np.clip(env.command, -span, span))

    def _draw_command(self, task: Task) -> np.ndarray:
        if self._corner_fraction > 0 and self._rng.uniform() < self._corner_fraction:
            return task.draw_corner(self._rng)
        return task.draw_command(self._rng)

    def _draw_time(self, interval: tuple[float, float] | None) -> float:
        return np.inf if interval is None else self._rng.uniform(*interval)
