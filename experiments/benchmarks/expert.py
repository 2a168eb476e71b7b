"""How fast is the expert, next to itself with exact QP solvers and next to a public controller of its kind?"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.agents import Agent
from experiments.benchmarks.peers import Go2ConvexMPC
from experiments.expert.timing import elapsed, quantiles
from experiments.pushing import CRUISE
from experiments.results import Results, group
from experiments.study import Cell, Metrics, Study, option
from experiments.tables import mean, table
from experts import MPCConfig, NMPCConfig, NMPCExpert
from go1_mtl_gym import TASKS, Go1Env, Go1Error
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.validation import number_in, one_of

OURS = "ours, osqp"
EXACT = ("daqp", "piqp")
"""Exact solvers that the expert can use instead; the first one at hand is what errors are counted from."""
SCOPES = {
    "qp": "QP: from its matrices to a solution",
    "update": "MPC update: from the robot's dynamics to ground forces",
    "action": "action: from the robot's state to joint commands",
}
"""What is timed -> its meaning."""
FORCE_ERROR = "force error"
WARM_UP = 10
"""States at which nothing is timed yet."""
Call = Callable[[RobotState], dict[str, float]]
"""Answers at a state and gives the seconds of each scope."""


@dataclass(frozen=True)
class ExpertOptions:
    """One walk at 50 Hz.

    Raises:
        InvalidInputError: if a number is outside its range.
    """

    task: str = option("trot", "gait; the peer knows trot only")
    states: int = option(400, "at which everybody answers")
    go2_convex_mpc: str = option("", "folder of a checkout of that repository; empty: without it")

    def __post_init__(self) -> None:
        one_of(self.task, tuple(TASKS), "task")
        number_in(self.states, 1, 1e6, "states")


class ExpertBenchmark(Study):
    """The expert's times in turns with exact QP solvers and with a public controller."""

    name = "benchmark_expert"
    title = "Expert against others"
    note = (
        "One process, one thread, one walk; at every state of it all answer in turn. daqp and piqp: our expert with "
        "these exact solvers in OSQP's place. "
        "[go2-convex-mpc](https://github.com/elijah-waichong-chan/go2-convex-mpc): a convex MPC of the Unitree Go2 in "
        "Python, CasADi and OSQP with a horizon like ours, asked at our robot's states with our gait; it answers with "
        "its own model, weights and tolerances, and its QP is timed by its own clock."
    )
    full = ExpertOptions()
    quick = ExpertOptions(states=5)
    alone = True

    def agents(self) -> list[Agent]:
        return [Agent("all")]

    def cells(self, agent: Agent) -> list[Cell]:
        return [Cell(self.options.task)]

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        calls = contestants(self.options)
        times: dict[tuple[str, str], list[float]] = {}
        errors: dict[str, list[float]] = {}
        for i, state in enumerate(walk(cell.task, self.options.states + WARM_UP, seed)):
            for name, call in calls.items():
                for scope, seconds in call(state).items():
                    if i >= WARM_UP:
                        times.setdefault((name, scope), []).append(seconds)
            for name, error in force_errors(calls).items():
                errors.setdefault(name, []).append(error)
        shown = {key: quantiles(values) for key, values in times.items()}
        records: list[dict[str, Any]] = [
            {"agent": name, "condition": scope, **ms, "ratio": ms["median_ms"] / shown[OURS, scope]["median_ms"]}
            for (name, scope), ms in shown.items()
        ]
        forces = {name: {"median_n": np.median(v), "largest_n": np.max(v)} for name, v in errors.items()}
        return records + [{"agent": name, "condition": FORCE_ERROR, **error} for name, error in forces.items()]

    def published_options(self) -> dict[str, Any]:
        checkout = "PATH" if self.options.go2_convex_mpc else ""
        return super().published_options() | {"go2_convex_mpc": checkout}

    def table(self, results: Results) -> str:
        columns = {
            "median [ms]": mean("median_ms", ".2f"),
            "p99 [ms]": mean("p99_ms", ".2f"),
            "in units of ours": mean("ratio", ".2f"),
        }
        groups = {
            (meaning, agent): members
            for scope, meaning in SCOPES.items()
            for agent, members in group(results.of(condition=scope), "agent").items()
        }
        return table(groups, ["timed", "agent"], columns)


def walk(task: str, count: int, seed: int) -> Iterator[RobotState]:
    """States of successive control steps (50 Hz) of our expert, after a second of walking."""
    env = Go1Env(task, episode_s=1e6)
    env.reset(seed=seed, options={"command": CRUISE})
    for i in range(50 + count):
        if i >= 50:
            yield env.state
        if env.step(env.expert_action())[4]["fallen"]:
            raise Go1Error(f"the robot fell after {i} steps of {task}; nothing can be compared")


class Ours:
    """Our expert with some settings of its MPC.

    Args:
        config: the settings.

    Raises:
        ImportError: if the QP solver is not installed.
    """

    def __init__(self, config: MPCConfig) -> None:
        self.expert = NMPCExpert(config=NMPCConfig(mpc=config))
        self.problem: tuple[Any, ...] = ()
        self.told: dict[str, Any] = {}
        self.solution: Any = None
        mpc = self.expert._mpc
        solve = mpc.solve

        def remember(*problem: Any, **told: Any) -> Any:
            self.problem, self.told, self.solution = problem, told, solve(*problem, **told)
            return self.solution

        mpc.solve = remember

    def __call__(self, state: RobotState) -> dict[str, float]:
        """Seconds of every scope."""
        dynamics, mpc = self.expert._model.dynamics(state), self.expert._mpc
        update = elapsed(lambda: self.expert.forces(state, dynamics))
        data = elapsed(lambda: mpc.program.update(*self.problem, **self.told))
        both = elapsed(lambda: mpc.solve(*self.problem, **self.told))
        return {"qp": both - data, "update": update, "action": elapsed(lambda: self.expert.action(state))}


def contestants(options: ExpertOptions) -> dict[str, Call]:
    """Who takes part; solvers that are not installed are named on standard error.

    Raises:
        MissingPeerError: if the checkout that was asked for cannot be used.
    """
    calls: dict[str, Call] = {OURS: Ours(MPCConfig())}
    for name in EXACT:
        try:
            calls[f"ours, {name}"] = Ours(MPCConfig(solver=name))
        except ImportError as error:
            print(f"{name} is left out: {error}; pip install {name}", file=sys.stderr)
    if options.go2_convex_mpc:
        calls["go2-convex-mpc"] = Go2ConvexMPC(Path(options.go2_convex_mpc), TASKS[options.task].gait, CRUISE)
    return calls


def force_errors(calls: dict[str, Call]) -> dict[str, float]:
    """Largest difference of a force component from an exact solver's solution of the same problem [N]."""
    ours = {name: call.solution.forces_w for name, call in calls.items() if isinstance(call, Ours)}
    exact = next((ours[f"ours, {name}"] for name in EXACT if f"ours, {name}" in ours), None)
    return {} if exact is None else {name: float(np.abs(forces - exact).max()) for name, forces in ours.items()}
