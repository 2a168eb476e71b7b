"""An environment in somebody's hands."""

from typing import Any

import gymnasium
import numpy as np

from go1_mtl_gym import TASKS, Task
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.seeded_wrapper import SeededWrapper
from go1_mtl_gym.tasks import ANY_GAIT, any_gait_task
from trainers.data.operator import OperatorConfig
from trainers.data.operator_plan import NextGait, OperatorPlan, Push, draw_plan

LONGEST_S = 600.0
"""Plans are drawn for episodes of up to this length [s]; afterwards the stick stays where it is."""


class OperatorWrapper(SeededWrapper):
    """Moves the stick, changes the gait and pushes the robot as `draw_plan` says.

    A reset with a seed draws a plan that depends on that seed and the task alone, so that every policy meets the same
    hands. The command is the stick times the `command_range` of the task that was asked for last.

    ``info["operator_move"]`` names the move of the present instant, ``info["operator_events"]`` what came with the last
    step: "push", or the name of a task, "any_gait" for another gait where any can be.

    Args:
        env: a `Go1Env`, wrapped or not.
        config: how often hands do what; None is the default.
    """

    _STREAM = 0x5EED_0F

    def __init__(self, env: gymnasium.Env, config: OperatorConfig | None = None) -> None:
        super().__init__(env)
        self.operator = config or OperatorConfig()
        self._plan: OperatorPlan | None = None

    @property
    def plan(self) -> OperatorPlan | None:
        """What the hands do in this episode; None before the first reset."""
        return self._plan

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Reset the environment, and draw what the hands will do.

        Args:
            seed: of the environment and of the hands.
            options: ``task`` as of `Go1Env.reset`.

        Raises:
            InvalidInputError: as `Go1Env.reset`, and if there is a ``command`` among the options.
        """
        if options and options.get("command") is not None:
            raise InvalidInputError(
                f"the operator gives the commands; got the reset option command={options['command']!r}"
            )
        env = self._go1
        observation, info = super().reset(seed=seed, options=options)
        seconds = min(env.config.episode_s, LONGEST_S) + 1.0
        gaits = env.config.gaits if env.tasks == (ANY_GAIT,) else None
        self._plan = draw_plan(self.operator, env.task.name, env.tasks, seconds, self._rng, gaits)
        self._move_stick(self._plan, 0.0)
        self._time_s = 0.0
        told = {"command": env.command, "operator_move": self._plan.move(0.0), "operator_events": ()}
        return observation, info | told

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Step, with whatever the hands do at its beginning."""
        env, plan = self._go1, self._plan
        events: tuple[str, ...] = ()
        if plan is not None:
            before, self._time_s = self._time_s, self._time_s + env.control_s
            tasks, pushes = plan.changes_in(before, self._time_s), plan.pushes_in(before, self._time_s)
            for task in tasks if not plan.gaits else ():
                self._change_task(task)
            for gait in plan.gaits_in(before, self._time_s):
                self._change_gait(gait)
            for push in pushes:
                self._push(push)
            self._move_stick(plan, self._time_s)
            events = (*tasks, *("push" for _ in pushes))
        observation, reward, terminated, truncated, info = self.env.step(action)
        told = {"operator_move": plan.move(self._time_s) if plan else "", "operator_events": events}
        return observation, float(reward), terminated, truncated, info | told

    def _move_stick(self, plan: OperatorPlan, time_s: float) -> None:
        env = self._go1
        env.set_command(plan.stick(time_s) * self._reach(env.requested_task))

    def _reach(self, task: Task) -> np.ndarray:
        """What a full deflection asks of a task: |vx|, |vy| [m/s] and |yaw rate| [rad/s], shape (3,)."""
        return np.minimum(self.operator.deflection * np.array(task.command_range), task.command_limit)

    def _push(self, push: Push) -> None:
        env = self._go1
        size = push.size * env.task.largest_push(push.angle) if push.hard else push.size
        angle = push.angle + env.state.rpy[2]
        env.push([size * np.cos(angle), size * np.sin(angle), 0.0])

    def _change_gait(self, asked: NextGait) -> None:
        """Ask for a gait, as `_change_task` for a task."""
        env = self._go1
        reach = self._reach(any_gait_task(asked.gait))
        env.set_gait(asked.gait, asked.slew_s, np.clip(env.command, -reach, reach))

    def _change_task(self, task: str) -> None:
        """Press a button; a command beyond the new task's reach is brought to its border first."""
        env = self._go1
        reach = np.minimum(self._reach(TASKS[task]), env.requested_task.command_limit)
        env.set_task(task, command=np.clip(env.command, -reach, reach))
