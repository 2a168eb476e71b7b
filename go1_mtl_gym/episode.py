"""What an episode carries from step to step, apart from the physics."""

from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from go1_mtl_gym.clock import next_phase, passes
from go1_mtl_gym.rewards import reward_terms
from go1_mtl_gym.sensing.observation import SensorNoise
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.sensing.state_estimator import StateEstimator
from go1_mtl_gym.sensing.state_noise import EstimatorError
from go1_mtl_gym.tasks import Task

COMMAND_FILTER_S = 0.2
"""Time constant of the low-pass between a command and what expert and student see of it [s]."""
COMMAND_SLEW = (4.0, 4.0, 8.0)
"""Largest change of the filtered command per second: vx, vy [m/s^2], yaw rate [rad/s^2]."""


def filtered(command: np.ndarray, before: np.ndarray, seconds: float) -> np.ndarray:
    """The filtered command after some time: first-order low-pass, then a limit on its slope.

    c' = c + clip((1 - exp(-t / 0.2 s)) (command - c), -COMMAND_SLEW t, COMMAND_SLEW t), each component by itself.

    Args:
        command: as asked for (vx [m/s], vy [m/s], yaw rate [rad/s]), shape (3,).
        before: c, the filtered command so far, shape (3,).
        seconds: t [s].
    """
    limit = np.array(COMMAND_SLEW) * seconds
    share = 1.0 - np.exp(-seconds / COMMAND_FILTER_S)
    return before + np.clip(share * (command - before), -limit, limit)


@dataclass
class Episode:
    """Task, command, gait clock and memory of the observation.

    Attributes:
        task: what is asked for.
        command: (vx [m/s], vy [m/s], yaw rate [rad/s]) as asked for, shape (3,).
        last_action: the action applied during the last step, in [-1, 1], shape (12,).
        older_frames: the proprioceptive frames before the present one, newest first; its `maxlen` is their number.
        filtered_command: what expert and student see of the command, shape (3,).
        phase: the gait clock [cycles], in [0, 1).
        steps: control periods since the reset.
        time_s: since the reset [s].
        next_task: what will be asked for as soon as the present gait can be left, or None.
        sensor_noise: what is added to the sensors' readings, or None.
        estimator_error: what the expert's state estimator gets wrong, or None.
        state_estimator: the expert's, fed by the observation, or None; without either the expert sees the true state.
    """

    task: Task
    command: np.ndarray
    last_action: np.ndarray
    older_frames: deque[np.ndarray]
    filtered_command: np.ndarray = field(default_factory=lambda: np.zeros(3))
    phase: float = 0.0
    steps: int = 0
    time_s: float = 0.0
    next_task: Task | None = None
    sensor_noise: SensorNoise | None = None
    estimator_error: EstimatorError | None = None
    state_estimator: StateEstimator | None = None

    @property
    def requested_task(self) -> Task:
        """What was asked for last: the present task, or the one that waits until the present gait can be left."""
        return self.next_task or self.task

    def advance(self, control_s: float) -> None:
        """Let one control period [s] pass: clock and command filter move on.

        The clock obeys the filtered command that expert and student saw at the beginning of the period.
        """
        before, mark = self.phase, self.task.gait.change_phase
        self.phase = next_phase(self.task.gait, before, self.filtered_command, control_s)
        if self.next_task is not None and (mark is None or before == self.phase or passes(mark, before, self.phase)):
            self.change_task(self.next_task, 0.0)
        self.filtered_command = filtered(self.command, self.filtered_command, control_s)
        self.steps += 1
        self.time_s = self.steps * control_s
        if self.estimator_error is not None:
            self.estimator_error.advance()

    def change_task(self, task: Task, phase: float | None) -> None:
        """Change the task: at once to a phase, or with None to phase 0 as soon as the present gait can be left.

        With None, a task that is present already goes on as it is.
        """
        if phase is not None or (task != self.task and self.task.gait.change_phase is None):
            self.task, self.phase, self.next_task = task, phase or 0.0, None
        else:
            self.next_task = None if task == self.task else task

    def estimated(self, state: RobotState) -> RobotState:
        """What the state estimator makes of the true state, now."""
        estimator = self.state_estimator or self.estimator_error
        return state if estimator is None else estimator.estimate(state)

    def rewards(self, state: RobotState, torque: np.ndarray, ended: str) -> dict[str, float]:
        """The reward terms of the step that led to a state.

        Args:
            state: the true one, now.
            torque: of the joints [N m], shape (12,).
            ended: why the episode is over; after "unstable" nothing measured means anything and all terms are 0.
        """
        weights, height = self.task.reward, float(state.position_w[2])
        terms = reward_terms(weights, self.filtered_command, state.base_velocity, state.gravity_b, height, torque)
        return dict.fromkeys(terms, 0.0) if ended == "unstable" else terms

    def info(self, state: RobotState, terms: dict[str, float], ended: str) -> dict[str, Any]:
        """What `reset` and `step` report.

        Args:
            state: the true one, now.
            terms: of the reward.
            ended: why the episode is over; "" while it goes on.
        """
        return {
            "task": self.task.name,
            "command": self.command.copy(),
            "filtered_command": self.filtered_command.copy(),
            "base_velocity": np.nan_to_num(state.base_velocity),
            "contacts": state.contacts,
            "phase": self.phase,
            "standing": state.standing,
            "reward_terms": terms,
            "fallen": ended in ("fall", "unstable"),
            "ended": ended,
        }
