"""How fast is the expert, next to itself with exact QP solvers and next to a public controller of its kind?

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
from pathlib import Path
from typing import Any

import numpy as np
from peers import Go2ConvexMPC, MissingPeer
from threadpoolctl import threadpool_limits

from experts import MPCConfig, NMPCConfig, NMPCExpert
from go1_mtl_gym import TASKS, Go1Env, Go1Error
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.validation import number_in
from trainers.policies.checkpoint import versions
from trainers.utils.files import write_json
from trainers.utils.report import benchmark_table

OURS = "ours, osqp"
EXACT = ("daqp", "piqp")
"""Exact solvers that the expert can use instead; the first one at hand is what errors are counted from."""
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
    """Our expert with some settings of its MPC.

    Args:
        config: the settings.

    Raises:
        ImportError: if the QP solver is not installed.
    """

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


def contestants(options: argparse.Namespace) -> dict[str, Call]:
    """Who takes part; who is absent is named on standard error, unless asked for by path.

    Raises:
        MissingPeer: if the checkout that was asked for cannot be used.
    """
    calls: dict[str, Call] = {OURS: Ours(MPCConfig())}
    for name in EXACT:
        try:
            calls[f"ours, {name}"] = Ours(MPCConfig(solver=name))
        except ImportError as error:
            print(f"{name} is left out: {error}; pip install {name}", file=sys.stderr)
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
    """Largest difference of a force component from an exact solver's solution of the same problem [N]."""
    ours = {name: call.solution.forces_w for name, call in calls.items() if isinstance(call, Ours)}
    exact = next((ours[f"ours, {name}"] for name in EXACT if f"ours, {name}" in ours), None)
    return {} if exact is None else {name: float(np.abs(forces - exact).max()) for name, forces in ours.items()}


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
