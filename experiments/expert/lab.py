"""What the expert is measured in: one environment, an expert whose every answer is counted; and its studies' frame."""

import dataclasses
from abc import abstractmethod
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import numpy as np

import experts
import trainers
from experiments.agents import EXPERT, Agent
from experiments.study import Cell, Metrics, Study, option
from go1_mtl_gym import BUILT_IN_TASKS, TASKS
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.robot import HOME_POSE
from go1_mtl_gym.sensing.state import RobotState
from trainers.data.environments import derive_seed

WIDEST = (10.0, 10.0, 20.0)
"""Commands that `Course` accepts: |vx|, |vy| [m/s], |yaw rate| [rad/s]; far beyond every `Task.command_limit`."""
UNENDING_S = 1e6
"""Length of an episode in which only a fall ends anything [s]."""


OWN_COUNTERS = ("inexact_solves", "solver_failures", "bad_states", "iterations")
"""What the expert counts itself, see `NMPCExpert.counters`."""
ANSWERS = ("calls", "bad_actions", "unhandled")
"""Control steps, answers with a number that is not finite, and exceptions that left the expert."""
Ledger = Counter[str]
"""What happened to an expert's answers, over all episodes of a measurement: `ANSWERS` and `OWN_COUNTERS`."""


class CountedExpert:
    """An expert under observation: it answers as it would, and every answer is entered in a ledger.

    Args:
        make: makes the expert from gains and hold_s.
        ledger: where things are entered.
        gains, hold_s: as the environment gives them.

    Attributes:
        expert: the one that answers.
        gains, hold_s: that its targets are for.
    """

    def __init__(self, make: Callable[..., Any], ledger: Ledger, gains: Any, hold_s: float) -> None:
        self.gains, self.hold_s = gains, hold_s
        self.expert = make(gains=gains, hold_s=hold_s)
        self.ledger = ledger

    def reset(self, state: RobotState) -> None:
        """Begin an episode; what was counted in the last one is kept."""
        self.settle()
        self.expert.reset(state)

    def action(self, state: RobotState) -> np.ndarray:
        """Joint targets [rad], shape (12,); the home pose where the expert raised or answered with NaN."""
        self.ledger["calls"] += 1
        try:
            target = np.asarray(self.expert.action(state))
        except Exception:  # whatever it is, it is what this ledger is for
            self.ledger["unhandled"] += 1
            return HOME_POSE.copy()
        if not np.isfinite(target).all():
            self.ledger["bad_actions"] += 1
            return HOME_POSE.copy()
        return target

    def settle(self) -> None:
        """Move what the expert has counted into the ledger."""
        counters = getattr(self.expert, "counters", None)
        for name in OWN_COUNTERS:
            if hasattr(counters, name):
                self.ledger[name] += int(getattr(counters, name))
                setattr(counters, name, 0)


class Course(Go1Env):
    """The environment with the fence taken down: commands beyond `Task.command_limit` are accepted.

    That limit keeps users from asking for what was never tested; here it is tested. Everything else is the
    environment's own. A reset hands the running episode a copy of its task with a wider limit, and then the command.
    """

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict]:
        """As in `Go1Env`, with any finite command."""
        options = dict(options or {})
        command = options.pop("command", None)
        observation, info = super().reset(seed=seed, options=options)
        if command is not None:
            episode = self._episode
            episode.task = dataclasses.replace(episode.task, command_limit=WIDEST)
            self.set_command(command)
            info["command"] = episode.command.copy()
        return observation, info


class Lab:
    """One environment for all gaits, driven by a counted expert.

    Args:
        control_hz: rate of the expert and of its joint targets [Hz].
        make_expert: makes the expert from gains and hold_s.

    Attributes:
        env: the environment; only falls end its episodes.
        ledger: see `Ledger`; complete after `settle`.
    """

    def __init__(self, control_hz: int = 50, make_expert: Callable[..., Any] = experts.NMPCExpert) -> None:
        self.ledger = Ledger(dict.fromkeys((*ANSWERS, *OWN_COUNTERS), 0))
        counted = partial(CountedExpert, make_expert, self.ledger)
        self.env = Course(None, control_hz=control_hz, episode_s=UNENDING_S, expert=counted)

    @property
    def counted(self) -> CountedExpert:
        """The environment's expert, once it has been asked for an action."""
        return self.env._expert

    def settle(self) -> Ledger:
        """The ledger with everything so far."""
        if self.env._expert is not None:
            self.counted.settle()
        return self.ledger

    def begin(self, task: str, command: Any, *keys: int | str) -> None:
        """Stand up with a task and a command (vx, vy [m/s], yaw rate [rad/s]), seeded by `keys`."""
        self.env.reset(seed=derive_seed("lab", task, *keys), options={"task": task, "command": tuple(command)})

    def step(self) -> dict[str, Any]:
        """One control period under the expert; its info."""
        return self.env.step(self.env.expert_action())[4]

    def walk(self, seconds: float) -> bool:
        """Let the expert walk for some seconds or until a fall; returns whether it stayed up."""
        return not any(self.step()["fallen"] for _ in range(round(seconds * self.env.control_hz)))

    def score(
        self, task: str, seconds: float, seed: int, episodes: int = 1, command: Any = None, **options: Any
    ) -> trainers.ClosedLoopResult:
        """`trainers.evaluate` of the expert in this environment; without a command they are drawn."""
        given = None if command is None else [tuple(float(value) for value in command)]
        return trainers.evaluate(
            "expert", task, episodes, seconds, seed, commands=given, make_env=lambda *_, **__: self.env, **options
        )


def generator(*keys: int | str) -> np.random.Generator:
    """Random numbers that depend on `keys` alone."""
    return np.random.default_rng(derive_seed(*keys))


def shared_range(*tasks: str) -> np.ndarray:
    """Largest |vx|, |vy| [m/s] and |yaw rate| [rad/s] that every one of some tasks draws, shape (3,)."""
    return np.min([TASKS[task].command_range for task in tasks], axis=0)


# -- Studies -----------------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class ExpertOptions:
    """What all studies of the expert share."""

    tasks: tuple[str, ...] = option(BUILT_IN_TASKS, "the gaits")
    control_hz: int = option(50, "rate of the expert and of the joint targets [Hz]")


class ExpertStudy(Study):
    """A study of the expert alone, one cell per gait; the ledger of a cell's lab stands in its first record."""

    code: ClassVar[tuple[str, ...]] = ("go1_mtl_gym", "experts", "trainers.evaluation", "experiments.expert")

    def agents(self) -> list[Agent]:
        return [Agent(EXPERT)]

    def cells(self, agent: Agent) -> list[Cell]:
        return [Cell(task) for task in self.options.tasks]

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        lab = Lab(self.options.control_hz)
        records = self.measure_in(lab, cell.task, seed)
        records[0] |= lab.settle()
        return records

    @abstractmethod
    def measure_in(self, lab: Lab, task: str, seed: int) -> list[dict[str, Any]]:
        """The records of one gait, without the ledger.

        Args:
            lab: where the expert walks.
            task: name of the gait.
            seed: of commands, resets and pushes.
        """
