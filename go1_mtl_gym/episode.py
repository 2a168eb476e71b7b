"""What an episode carries from step to step, apart from the physics."""

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from go1_mtl_gym.tasks import Task

COMMAND_FILTER_S = 0.2
"""Time constant of the low-pass between a command and what expert and student see of it [s]."""


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
    """

    task: Task
    command: np.ndarray
    last_action: np.ndarray
    older_frames: deque[np.ndarray]
    filtered_command: np.ndarray = field(default_factory=lambda: np.zeros(3))
    phase: float = 0.0
    steps: int = 0

    def advance(self, control_s: float) -> None:
        """Let one control period [s] pass: clock and command filter move on."""
        self.phase = (self.phase + control_s / self.task.gait.period) % 1.0
        share = 1.0 - np.exp(-control_s / COMMAND_FILTER_S)
        self.filtered_command = self.filtered_command + share * (self.command - self.filtered_command)
        self.steps += 1
