"""An episode that somebody drives, step by step. No window, no clock on the wall, no keys."""

import contextlib
import dataclasses
from collections import deque
from collections.abc import Callable
from typing import Any, cast

import gymnasium
import numpy as np

from go1_mtl_gym import TASKS, Go1Env
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import one_of
from trainers.data.environments import EnvFactory, make_env
from trainers.evaluation.captions import STRIP_S, Reading
from trainers.evaluation.episodes import DrawnCommands, EpisodeSetup, Watch
from trainers.evaluation.rollout import begin, controller, opened

EXPERT = "expert"


class Session:
    """One environment, its episodes, and whoever is at the joints: a student or the expert, who take turns.

    Every step is what `EpisodeSetup.play` does: asked the same things, the robot goes the same way to the last bit,
    whoever looks on. The student is asked at every step, so that one with a memory has followed when it takes over.

    Args:
        student: a policy; None leaves all to the expert.
        setup: of the episodes.
        drive: gives commands before each step, such as `Hands.drive` or `Script.drive`; None leaves that to the setup.
        expert_drives: who begins.
        make_env: another environment factory.
        env_kwargs: of the environment, on top of the student's own.

    Attributes:
        env: in the hands of the setup's operator, if it has one.
        steps: that were made in this episode.
        ended: how it ended, "fall", "unstable" or "time"; "" while it goes on.

    Raises:
        InvalidInputError: if the student and the environment do not belong together.
    """

    def __init__(
        self,
        student: Any,
        setup: EpisodeSetup,
        drive: Watch | None = None,
        *,
        expert_drives: bool = False,
        make_env: EnvFactory = make_env,
        **env_kwargs: Any,
    ) -> None:
        self._student, self._setup, self._drive = student, setup, drive
        self._resources = contextlib.ExitStack()
        kwargs = {**getattr(student, "env_kwargs", {}), **env_kwargs, "episode_s": setup.seconds}
        one_of(setup.task, tuple(kwargs.get("tasks", (setup.task,))), "task")
        env = self._resources.enter_context(opened(make_env, setup.task, kwargs))
        self.env: gymnasium.Env = setup.in_hands(env)
        self._expert_drives = expert_drives
        self.go1 = cast(Go1Env, env.unwrapped)
        self._told: deque[dict[str, Any]] = deque(maxlen=round(STRIP_S * self.go1.control_hz))
        self._expert_known = False
        self.reset()

    def __enter__(self) -> "Session":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the environment; may be called twice."""
        self._resources.close()

    def reset(self, task: str | None = None) -> None:
        """Begin the episode again, from its stand and its seed.

        Args:
            task: to begin in, another than the setup's; None keeps it.

        Raises:
            InvalidInputError: if it is unknown here, or does not allow the setup's command; the episode goes on then.
        """
        setup = self._setup
        if task is not None:
            setup = dataclasses.replace(setup, task=one_of(task, self.go1.tasks, "task"))
            if setup.command is not None:
                TASKS[task].check_command(setup.command)
        commands, agent = DrawnCommands(setup), EXPERT if self._student is None else self._student
        self._ask_student: Callable[[np.ndarray], np.ndarray] = controller(agent, self.go1)  # with an empty memory
        self._obs, info = begin(self.env, agent, setup.seed, commands.options)
        self._setup, self._commands = setup, commands
        self._told.clear()
        self._told.append(info)
        self._expert_action: np.ndarray | None = None
        self.steps, self.ended = 0, ""

    def step(self) -> None:
        """Go on for a control period; a robot that fell may be watched for longer.

        Raises:
            InvalidInputError: if the episode had its time, or the physics has diverged.
        """
        if self.ended in ("time", "unstable"):
            raise InvalidInputError(f"the episode is over ({self.ended}): reset the session first")
        if self._drive is not None:
            self._drive(self.env, self.steps)
        self._commands.drive(self.env, self.steps)
        self._expert_action = None  # it was asked under another command
        action = self._ask_student(self._obs) if self._student is not None else None
        if self.expert_drives or action is None:
            action = self._ask_expert()
        self._obs, _, _, _, info = self.env.step(action)
        self._told.append(info)
        self.steps, self._expert_action = self.steps + 1, None
        self.ended = info["ended"] if info["ended"] == "unstable" else self.ended or info["ended"]

    def waits_for_expert(self, ghost: bool) -> bool:
        """Whether the expert is needed next and was never asked, which takes long once.

        Args:
            ghost: whether its pose is to be shown.
        """
        return not self._expert_known and (self.expert_drives or ghost)

    def prepare_expert(self) -> None:
        """Ask the expert once: load what it is made of, and compile it where it never was."""
        self._ask_expert()

    def _ask_expert(self) -> np.ndarray:
        if self._expert_action is None:
            self._expert_action = self.go1.expert_action()
            self._expert_known = True
        return self._expert_action

    @property
    def expert_drives(self) -> bool:
        """Whether the expert is at the joints; may be changed at any time where there is a student."""
        return self._expert_drives or self._student is None

    @expert_drives.setter
    def expert_drives(self, wanted: bool) -> None:
        self._expert_drives = wanted

    # -- What there is to see ------------------------------------------------------------------------------------------

    @property
    def time_s(self) -> float:
        """Since the reset [s]."""
        return self.steps / self.go1.control_hz

    @property
    def driver(self) -> str:
        """Who is at the joints, in a word."""
        return EXPERT if self.expert_drives else "student"

    @property
    def expert_target(self) -> np.ndarray:
        """The pose that the expert asks for now: joint targets [rad], shape (12,)."""
        return self.go1.action_map.to_radians(self._ask_expert())

    @property
    def reading(self) -> Reading:
        """What captions say of the present instant."""
        told, now = list(self._told), self._told[-1]
        measured = np.array([info["base_velocity"] for info in told])
        contacts = np.array([info["contacts"] for info in told], dtype=bool)
        tasks = self.go1.tasks
        return Reading.of(now["task"], tasks, now["filtered_command"], measured, contacts, self.go1.control_hz)
