"""How fast is the expert, next to a public controller of the same kind and next to exact QP solvers?

    python benchmarks/expert.py                                  ours, and piqp and daqp where they are installed
    python benchmarks/expert.py --go2-convex-mpc PATH            and a checkout of that repository
    python benchmarks/expert.py --out docs/results/benchmark_expert.json

Everything is timed in one run of one process on one thread: at every state of one walk all contestants answer in turn.
See benchmarks/README.md for what is compared with what.
"""

import argparse
import shlex
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from peers import SOLVERS, Go2ConvexMPC, MissingPeer
from threadpoolctl import threadpool_limits

from experts import MPCConfig, NMPCConfig, NMPCExpert
from experts.dynamics import FORCE_UNIT
from experts.mpc import NU, NX
from go1_mtl_gym import TASKS, Go1Env, Go1Error
from go1_mtl_gym.state import RobotState
from go1_mtl_gym.validation import number_in
from trainers.checkpoint import versions
from trainers.files import write_json
from trainers.report import benchmark_table

OURS = "ours, OSQP"
COMMAND = (0.3, 0.0, 0.0)
SCOPES = {
    "qp": "QP: from its matrices to a solution",
    "update": "MPC update: from the robot's dynamics to ground forces",
    "action": "action: from the robot's state to joint commands",
}
"""What is timed -> its meaning."""
WARM_UP = 10
"""States at which nothing is timed yet."""
Call = Callable[[RobotState], dict[str, float]]
"""Answers at a state and gives the seconds of each scope."""


def walk(task: str, count: int, seed: int) -> Iterator[RobotState]:
    """States of successive control steps (50 Hz) of our expert, after a second of walking."""
    env = Go1Env(task, episode_s=1e6)
    env.reset(seed=seed, options={"command": COMMAND})
    for i in range(50 + count):
        if i >= 50:
            yield env.state
        if env.step(env.expert_action())[4]["fallen"]:
            raise Go1Error(f"the robot fell after {i} steps of {task}; nothing can be compared")


class Ours:
    """Our expert with some settings of its QP solver."""

    def __init__(self, config: MPCConfig) -> None:
        self.expert = NMPCExpert(config=NMPCConfig(mpc=config))
        self.problem: tuple[Any, ...] = ()
        self.solution: Any = None
        mpc = self.expert._mpc
        solve = mpc.solve

        def remember(*problem: Any) -> Any:
            self.problem, self.solution = problem, solve(*problem)
            return self.solution

        mpc.solve = remember

    def __call__(self, state: RobotState) -> dict[str, float]:
        dynamics = self.expert._model.dynamics(state)
        update = _seconds(lambda: self.expert.forces(state, dynamics))
        mpc = self.expert._mpc
        data = _seconds(lambda: mpc.program.update(*self.problem))
        both = _seconds(lambda: mpc.solve(*self.problem))
        return {"qp": both - data, "update": update, "action": _seconds(lambda: self.expert.action(state))}


class ExactSolver:
    """Another solver on the QP that our expert has just solved.

    Args:
        name: in `SOLVERS`.
        ours: whose QP it is.
    """

    def __init__(self, name: str, ours: Ours) -> None:
        self._ours = ours
        config = ours.expert.config.mpc
        self._solver = SOLVERS[name](ours.expert._mpc.program, equalities=config.steps * NX)
        self.forces_w = np.zeros((4, 3))
        self._first = slice(config.steps * NX, config.steps * NX + NU)

    def __call__(self, state: RobotState) -> dict[str, float]:
        program = self._ours.expert._mpc.program
        seconds = _seconds(lambda: self._solver.solve(program))
        self.forces_w = self._solver.x[self._first].reshape(4, 3) * FORCE_UNIT
        return {"qp": seconds}


def contestants(options: argparse.Namespace) -> dict[str, Call]:
    """Who takes part; who is absent is named on standard error, unless asked for by path.

    Raises:
        MissingPeer: if the checkout that was asked for cannot be used.
    """
    ours = Ours(MPCConfig())
    calls: dict[str, Call] = {OURS: ours}
    known = {field.name for field in fields(MPCConfig)}
    for name in SOLVERS:
        try:
            calls[name] = ExactSolver(name, ours)
        except ImportError as error:
            print(f"{name} is left out: {error}; pip install {name}", file=sys.stderr)
            continue
        if "solver" in known:  # the expert itself can use it
            calls[f"ours, {name}"] = Ours(replace(MPCConfig(), solver=name))
    if options.go2_convex_mpc is not None:
        gait = TASKS[options.task].gait
        calls["go2-convex-mpc"] = Go2ConvexMPC(options.go2_convex_mpc, gait, COMMAND)
    return calls


def compare(options: argparse.Namespace) -> dict[str, Any]:
    """Milliseconds of every contestant and scope, ratios to ours, and how far forces are from the exact ones."""
    with threadpool_limits(1):
        calls = contestants(options)
        seconds: dict[str, dict[str, list[float]]] = {name: {} for name in calls}
        errors: dict[str, list[float]] = {}
        for i, state in enumerate(walk(options.task, options.states + WARM_UP, options.seed)):
            for name, call in calls.items():
                for scope, value in call(state).items():
                    if i >= WARM_UP:
                        seconds[name].setdefault(scope, []).append(value)
            for name, value in _force_errors(calls).items():
                errors.setdefault(name, []).append(value)
    times = {
        name: {
            scope: {"median": 1e3 * float(np.median(values)), "p99": 1e3 * float(np.quantile(values, 0.99))}
            for scope, values in own.items()
        }
        for name, own in seconds.items()
    }
    ratios = {
        name: {scope: found["median"] / times[OURS][scope]["median"] for scope, found in own.items()}
        for name, own in times.items()
    }
    return {
        "scopes": SCOPES,
        "times_ms": times,
        "ratio_to_ours": ratios,
        "force_error_n": {name: {"median": np.median(v), "largest": np.max(v)} for name, v in errors.items()},
        "config": {"task": options.task, "states": options.states, "command": COMMAND, "control_hz": 50},
        "seed": options.seed,
        "versions": versions(),
    }


def _force_errors(calls: dict[str, Call]) -> dict[str, float]:
    """Largest difference of a force component from daqp's solution, which is exact to 1e-6 [N]."""
    if "daqp" not in calls:
        return {}
    exact = calls["daqp"].forces_w
    found = {name: call.forces_w for name, call in calls.items() if isinstance(call, ExactSolver) and name != "daqp"}
    found |= {name: call.solution.forces_w for name, call in calls.items() if isinstance(call, Ours)}
    return {name: float(np.abs(forces - exact).max()) for name, forces in found.items()}


def _seconds(call: Callable[[], Any]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def published(arguments: list[str]) -> str:
    """The command line without the folders that only its machine knows."""
    words, kept = iter(arguments), []
    for word in words:
        name = word.partition("=")[0]
        if name == "--out":
            next(words, None) if word == name else None
        elif name == "--go2-convex-mpc":
            next(words, None) if word == name else None
            kept += ["--go2-convex-mpc", "PATH"]
        else:
            kept.append(word)
    return shlex.join(["python", "benchmarks/expert.py", *kept])


def parse(arguments: list[str]) -> argparse.Namespace:
    """Read the command line.

    Raises:
        InvalidInputError: for an impossible number.
    """
    parser = argparse.ArgumentParser(
        description="Time the expert next to others.", formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("--task", choices=tuple(TASKS), default="trot", help="gait; the peer knows trot only")
    parser.add_argument("--states", type=int, default=400, help="states at which everybody answers")
    parser.add_argument("--seed", type=int, default=0, help="of the walk")
    parser.add_argument("--go2-convex-mpc", type=Path, default=None, help="checkout of that repository")
    parser.add_argument("--out", type=Path, default=None, help="file of the results")
    options = parser.parse_args(arguments)
    number_in(options.states, 1, 1e6, "states")
    number_in(options.seed, 0, 2**31 - 1, "seed")
    return options


def main(arguments: list[str] | None = None) -> int:
    """Run from the command line; returns the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        options = parse(arguments)
        result = compare(options)
    except (Go1Error, MissingPeer) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(benchmark_table(result))
    if options.out is not None:
        write_json(options.out, result | {"command": published(arguments)})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
