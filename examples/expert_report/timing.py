"""How fast the expert is: milliseconds per answer, multiples of real time, and what its other settings buy and cost."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import mujoco
import numpy as np

from expert_report.lab import Lab
from expert_report.limits import CRUISE, PushConfig, largest_push
from experts import NMPCConfig, NMPCExpert
from experts.nmpc import WHOLE_BODY
from go1_mtl_gym.actuation import PHYSICS_HZ
from go1_mtl_gym.sensing.state import RobotState

MODES = {
    "default": NMPCConfig(),
    "one QP per call": NMPCConfig(sqp_iterations=1),
    "real-time iterations": NMPCConfig(sqp_iterations=1, linearization="shifted"),
    "converged SQP": NMPCConfig(sqp_iterations=20, sqp_tolerance=1e-3),
} | {f"whole body: {name}": NMPCConfig(whole_body=name) for name in WHOLE_BODY if name != NMPCConfig().whole_body}
"""Settings of the expert that are compared with each other, by name."""
MPC_HZ = 100
"""Where control is faster than this, forces are planned at this rate, the whole body at every step [Hz]."""
MODE_TASKS = ("trot", "jump")
"""Gaits on which they are compared."""


@dataclass(frozen=True)
class TimingConfig:
    """Measuring time, alone on a core.

    Attributes:
        states: along a walk, at each of which the expert is asked.
        rates: of control, at which the multiple of real time is measured [Hz].
        blocks: repetitions, of which the median counts.
        block_s: simulated time of a block [s].
    """

    states: int = 500
    rates: tuple[int, ...] = (50, 1000)
    blocks: int = 7
    block_s: float = 1.0


@dataclass(frozen=True)
class ModesConfig:
    """Comparing `MODES`.

    Attributes:
        episodes, seconds: of drawn commands.
        push: how the largest kick to the side is searched.
    """

    episodes: int = 5
    seconds: float = 10.0
    push: PushConfig = PushConfig(directions=("left", "right"))


def make_mode(name: str) -> Callable[..., Any]:
    """What makes an expert with the settings of that name, for the environment's argument `expert`."""
    return partial(NMPCExpert, config=MODES[name])


# -- Time --------------------------------------------------------------------------------------------------------------


def timing(lab: Lab, task: str, config: TimingConfig, seed: int) -> dict[str, Any]:
    """Milliseconds of an action and of the MPC update in it, of each mode's action, and multiples of real time."""
    states = walked_states(lab, task, config.states, seed)
    labs = {name: Lab(lab.env.control_hz, make_mode(name)) for name in MODES if task in MODE_TASKS}
    for own in labs.values():
        own.begin(task, CRUISE, "timing", seed)
        own.walk(0.1)
    calls = {"action": lab.counted.action, "mpc_update": partial(mpc_update, lab.counted.expert)}
    calls |= {f"mode {name}": own.counted.action for name, own in labs.items()}
    times = {name: quantiles(seconds) for name, seconds in interleaved(calls, states).items()}
    rates = {str(rate): real_time(lab, task, rate, config, seed) for rate in config.rates}
    for own in labs.values():
        lab.ledger.add(own.settle())
    return {
        "action_ms": times["action"],
        "mpc_update_ms": times["mpc_update"],
        "mode_action_ms": {name: times[f"mode {name}"] for name in labs},
        "real_time": rates,
    }


def walked_states(lab: Lab, task: str, count: int, seed: int) -> list[RobotState]:
    """States of successive control steps at `CRUISE`."""
    lab.begin(task, CRUISE, "timing", seed)
    states = []
    for _ in range(count):
        states.append(lab.env.state)
        lab.step()
    return states


def mpc_update(expert: Any, state: RobotState) -> float:
    """Seconds that the MPC proper takes: from a state and its dynamics to ground forces (build, update and solve)."""
    dynamics = expert._model.dynamics(state)
    return elapsed(partial(expert.forces, state, dynamics))


def elapsed(call: Callable[[], Any]) -> float:
    """Seconds that a call takes."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def interleaved(calls: dict[str, Callable[[RobotState], Any]], states: Sequence[RobotState]) -> dict[str, np.ndarray]:
    """Seconds of every call at every state, the calls taking turns; a call that returns a float has timed itself."""
    times = {name: np.empty(len(states)) for name in calls}
    for i, state in enumerate(states):
        for name, call in calls.items():
            start = time.perf_counter()
            result = call(state)
            times[name][i] = result if isinstance(result, float) else time.perf_counter() - start
    return times


def quantiles(seconds: np.ndarray) -> dict[str, float]:
    """Median and 99th percentile in milliseconds."""
    return {"median": float(1e3 * np.median(seconds)), "p99": float(1e3 * np.quantile(seconds, 0.99))}


def real_time(lab: Lab, task: str, rate: int, config: TimingConfig, seed: int) -> dict[str, float]:
    """Simulated seconds per second of one core at a control rate, medians of blocks that take turns.

    The expert plans forces at most at `MPC_HZ`.

    Returns:
        "expert" in the loop; "environment", the same without the expert, standing; "physics", MuJoCo alone; and
        "expert_to_physics", which depends less on the machine.
    """
    slower = NMPCConfig(mpc_hz=MPC_HZ if rate > MPC_HZ else None)
    walking, standing = Lab(rate, partial(NMPCExpert, config=slower)), Lab(rate)
    for own in (walking, standing):
        own.begin(task, CRUISE, "timing", seed)
    walking.walk(0.5)
    simulation, steps = standing.env.simulation, round(config.block_s * rate)
    home = standing.env.action_map.from_radians(simulation.q)

    def expert() -> None:
        for _ in walking.drive(config.block_s):
            pass

    def environment() -> None:
        for _ in range(steps):
            standing.env.step(home)

    def physics() -> None:
        for _ in range(steps):
            mujoco.mj_step(simulation.model, simulation.data, nstep=PHYSICS_HZ // rate)

    calls = {"expert": expert, "environment": environment, "physics": physics}
    blocks = [{name: elapsed(call) for name, call in calls.items()} for _ in range(config.blocks)]
    factors = {name: float(config.block_s / np.median([block[name] for block in blocks])) for name in calls}
    lab.ledger.add(walking.settle())
    return factors | {"expert_to_physics": factors["expert"] / factors["physics"]}


# -- Modes -------------------------------------------------------------------------------------------------------------


def modes(lab: Lab, task: str, config: ModesConfig, seed: int) -> dict[str, Any]:
    """{mode: survival, velocity error [m/s] and largest kick to the side [m/s]}; `timing` has their milliseconds."""
    figures: dict[str, Any] = {}
    for name in MODES:
        own = Lab(lab.env.control_hz, make_mode(name))
        walked = own.score(task, config.seconds, seed, config.episodes)
        kicks = [largest_push(own, task, direction, config.push, seed) for direction in config.push.directions]
        figures[name] = {
            "survival_rate": walked.survival_rate,
            "episodes": config.episodes,
            "velocity_error": walked.velocity_error,
            "lateral_push": min(kicks),
        }
        lab.ledger.add(own.settle())
    return figures
