"""A Go1 without physics: same names and spaces as `Go1Env`, an expert that is linear in the observation.

The action's meaning is made up so that tests can script behavior: hips 0, 3, 6 set the base velocity (vx, vy, yaw
rate), a thigh above 0.5 lifts its leg, the first knee above 0.95 makes the robot fall. Joints lag behind.
"""

from collections import deque
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from go1_mtl_gym import PAPER_TASKS, TASKS, PolicyContract, Task
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.sensing.observation import FRAME_SIZE, ObservationLayout
from trainers.data.environments import ExpertAccess, PerturbationConfig

HIPS, THIGHS, KNEES = slice(0, 7, 3), slice(1, 12, 3), slice(2, 12, 3)
SPEED = 2.0
"""Velocity that a hip's action of 1 stands for [m/s, rad/s]; more than any task's `command_range`."""
SIZE = 34 + 3 + 2 + 12
"""Entries of the observation without the task id: proprioception, command, phase, last action."""


@dataclass(frozen=True)
class StubState:
    """What a stub's expert may read."""

    q: np.ndarray
    phase: float
    command: np.ndarray
    offsets: np.ndarray


def linear_expert(state: StubState) -> np.ndarray:
    """Hips follow the command, thighs lift in turn, knees damp; shape (12,), in [-1, 1]."""
    action = np.zeros(12)
    action[HIPS] = state.command / SPEED
    action[THIGHS] = 0.9 * np.sin(2 * np.pi * (state.phase + state.offsets))
    action[KNEES] = -0.5 * state.q[KNEES]
    return action


class StubEnv(gymnasium.Env):
    """See the module's docstring."""

    def __init__(
        self,
        task: str = "trot",
        tasks: tuple[str, ...] = PAPER_TASKS,
        episode_s: float = 30.0,
        control_hz: int = 50,
        expert_falls_after_s: float = np.inf,
        channels: tuple[str, ...] = ("command", "phase", "last_action"),
        history: int = 1,
        **_: Any,
    ) -> None:
        self.tasks, self.control_hz, self.control_s = tuple(tasks), control_hz, 1 / control_hz
        self.first_task = self.task = TASKS[task]
        self.layout = ObservationLayout(self.tasks, channels, history)
        self.observation_space = gymnasium.spaces.Box(-50, 50, (self.layout.size,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1, 1, (12,), np.float32)
        self.action_map = ActionMap(center=np.tile([0.0, 0.9, -1.8], 4), half_range=np.linspace(0.5, 1.6, 12))
        gaits = [TASKS[name].gait for name in self.tasks]
        self.contract = PolicyContract.of_environment(self.layout, gaits, control_hz, PDGains(), self.action_map)
        self.falls_after = expert_falls_after_s
        self.episode_steps = round(episode_s * control_hz)
        self.asked = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        options, self.task = options or {}, self.first_task
        drawn = self.task.draw_command(self.np_random)
        self.command = np.array(options.get("command", drawn), dtype=float)
        self.filtered = np.zeros(3)
        self.q = self.np_random.uniform(-0.1, 0.1, 12)
        self.phase, self.steps, self.last_action = 0.0, 0, np.zeros(12)
        older = self.layout.history - 1
        self.frames = deque([np.zeros(FRAME_SIZE)] * older, older)
        return self.observe(), self.info(False)

    @property
    def state(self) -> StubState:
        return StubState(self.q.copy(), self.phase, self.filtered.copy(), np.array(self.task.gait.offsets))

    def expert_action(self) -> np.ndarray:
        self.asked += 1
        action = linear_expert(self.state)
        if self.steps * self.control_s >= self.falls_after:
            action[2] = 1.0
        return action.astype(np.float32)

    @property
    def requested_task(self) -> Task:
        return self.task

    def set_command(self, command) -> None:
        self.command = np.array(command, dtype=float)

    def set_task(self, task: str, phase: float | None = None, command=None) -> None:
        assert task in self.tasks
        if command is not None:
            self.set_command(command)
        self.task, self.phase = TASKS[task], 0.0

    def push(self, delta_velocity_w) -> None:
        self.q[KNEES] += 0.1 * delta_velocity_w[0]

    def step(self, action):
        action = np.clip(action, -1, 1)
        self.q += 0.5 * (action - self.q)
        self.last_action = np.array(action, dtype=float)
        self.phase = (self.phase + self.control_s / self.task.gait.period) % 1.0
        self.filtered += 0.1 * (self.command - self.filtered)
        self.steps += 1
        fallen = bool(action[2] > 0.95)
        return self.observe(), 0.0, fallen, not fallen and self.steps >= self.episode_steps, self.info(fallen)

    def observe(self) -> np.ndarray:
        turn = 2 * np.pi * self.phase
        parts = {"q": self.q, "contacts": self.last_action[THIGHS] <= 0.5, "command": self.filtered}
        parts |= {"phase": np.array([np.sin(turn), np.cos(turn)]), "last_action": self.last_action}
        obs = self.layout.flatten(parts, self.frames, self.tasks.index(self.task.name))
        self.frames.appendleft(obs[:FRAME_SIZE])
        return obs

    def info(self, fallen: bool) -> dict[str, Any]:
        return {
            "task": self.task.name,
            "command": self.command.copy(),
            "filtered_command": self.filtered.copy(),
            "base_velocity": SPEED * self.last_action[HIPS],
            "contacts": self.last_action[THIGHS] <= 0.5,
            "phase": self.phase,
            "fallen": fallen,
        }


def make_stub(task: str, perturbation: PerturbationConfig | None = None, **env_kwargs: Any) -> gymnasium.Env:
    """The stub's environment factory."""
    env = StubEnv(task, **env_kwargs)
    if perturbation is not None:
        env = perturbation.wrap(env)
    return ExpertAccess(env)
