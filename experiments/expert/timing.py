"""How fast the expert is: milliseconds per answer, multiples of real time, and what its other settings buy and cost."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import mujoco
import numpy as np

from experiments.agents import Agent
from experiments.expert.lab import ExpertOptions, ExpertStudy, Lab
from experiments.expert.limits import PushOptions, largest_push
from experiments.pushing import CRUISE
from experiments.results import Results, group
from experiments.study import option
from experiments.tables import markdown, mean, share
from experts import NMPCConfig, NMPCExpert
from experts.nmpc import WHOLE_BODY
from go1_mtl_gym.actuation import PHYSICS_HZ
from go1_mtl_gym.sensing.state import RobotState

SETTINGS = {
    "default": NMPCConfig(),
    "one QP per call": NMPCConfig(sqp_iterations=1),
    "real-time iterations": NMPCConfig(sqp_iterations=1, linearization="shifted"),
    "converged SQP": NMPCConfig(sqp_iterations=20, sqp_tolerance=1e-3),
} | {f"whole body: {name}": NMPCConfig(whole_body=name) for name in WHOLE_BODY if name != NMPCConfig().whole_body}
"""Settings of the expert that are compared with each other, by name."""
MPC_HZ = 100
"""Where control is faster than this, forces are planned at this rate, the whole body at every step [Hz]."""
COMPARED = ("trot", "jump")
"""Gaits on which settings are compared."""
UPDATE, ACTION, COMPARED_ACTION, REAL_TIME = "MPC update", "action", "action, settings compared", "real time"


def make_expert(name: str) -> Callable[..., Any]:
    """What makes an expert with the settings of that name, for the environment's argument `expert`."""
    return partial(NMPCExpert, config=SETTINGS[name])


# -- Time --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TimingOptions(ExpertOptions):
    """Measuring time, alone on a core."""

    states: int = option(500, "along a walk, at each of which the expert is asked")
    rates: tuple[int, ...] = option((50, 1000), "of control, at which the multiple of real time is measured [Hz]")
    blocks: int = option(7, "repetitions, of which the median counts")
    block_s: float = option(1.0, "simulated time of a block [s]")


class Timing(ExpertStudy):
    """Milliseconds per answer of the expert and of its other settings, and multiples of real time."""

    name = "expert_timing"
    title = "Time"
    note = f"Where control is faster than {MPC_HZ} Hz, forces are planned at that rate."
    full = TimingOptions()
    quick = TimingOptions(("trot",), states=10, rates=(50,), blocks=1, block_s=0.2)
    alone = True

    def measure_in(self, lab: Lab, task: str, seed: int) -> list[dict[str, Any]]:
        states = walked_states(lab, task, self.options.states, seed)
        labs = {name: Lab(lab.env.control_hz, make_expert(name)) for name in SETTINGS if task in COMPARED}
        for other in labs.values():
            other.begin(task, CRUISE, "timing", seed)
            other.walk(0.1)
        calls = {UPDATE: partial(mpc_update, lab.counted.expert), ACTION: lab.counted.action}
        calls |= {name: other.counted.action for name, other in labs.items()}
        times = {name: quantiles(seconds) for name, seconds in interleaved(calls, states).items()}
        for other in labs.values():
            lab.ledger.update(other.settle())
        return [
            *({"condition": name, **times[name]} for name in (UPDATE, ACTION)),
            *({"agent": name, "condition": COMPARED_ACTION, **times[name]} for name in labs),
            *(
                {"condition": REAL_TIME, **real_time(lab, task, rate, self.options, seed)}
                for rate in self.options.rates
            ),
        ]

    def table(self, results: Results) -> str:
        rows = []
        for gait, members in group(results.records, "task").items():
            of = group(members, "condition")
            times = [f"{of[name][0][key]:.2f}" for name in (UPDATE, ACTION) for key in ("median_ms", "p99_ms")]
            for record in of[REAL_TIME]:
                factors = [f"{record[name]:.1f}" for name in ("expert", "environment", "physics")]
                rows.append(
                    [gait, f"{record['control_hz']} Hz", *times, *factors, f"{record['expert_to_physics']:.3f}"]
                )
        header = ["gait", "control", "MPC update [ms]", "p99", "action [ms]", "p99", "expert x real time"]
        return markdown([*header, "environment x", "MuJoCo x", "expert / MuJoCo"], rows, text_columns=2)

    def paragraphs(self, results: Results) -> list[str]:
        compared = group(results.of(condition=COMPARED_ACTION), "agent")
        gaits = list(dict.fromkeys(record["task"] for members in compared.values() for record in members))
        rows = [[name, *(f"{record['median_ms']:.2f}" for record in members)] for name, members in compared.items()]
        table = markdown(["action [ms]", *gaits], rows)
        return [*super().paragraphs(results), "Median time of an action with other settings:", table]


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


def quantiles(seconds: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Median and 99th percentile in milliseconds."""
    return {"median_ms": float(1e3 * np.median(seconds)), "p99_ms": float(1e3 * np.quantile(seconds, 0.99))}


def real_time(lab: Lab, task: str, rate: int, options: TimingOptions, seed: int) -> dict[str, float]:
    """Simulated seconds per second of one core at a control rate, medians of blocks that take turns.

    The expert plans forces at most at `MPC_HZ`.

    Returns:
        "expert" in the loop; "environment", the same without the expert, standing; "physics", MuJoCo alone; and
        "expert_to_physics", which depends less on the machine.
    """
    slower = NMPCConfig(mpc_hz=MPC_HZ if rate > MPC_HZ else None)
    walking, standing = Lab(rate, partial(NMPCExpert, config=slower)), Lab(rate)
    for used in (walking, standing):
        used.begin(task, CRUISE, "timing", seed)
    walking.walk(0.5)
    simulation, steps = standing.env.simulation, round(options.block_s * rate)
    home = standing.env.action_map.from_radians(simulation.q)

    def environment() -> None:
        for _ in range(steps):
            standing.env.step(home)

    def physics() -> None:
        for _ in range(steps):
            mujoco.mj_step(simulation.model, simulation.data, nstep=PHYSICS_HZ // rate)

    calls = {"expert": partial(walking.walk, options.block_s), "environment": environment, "physics": physics}
    blocks = [{name: elapsed(call) for name, call in calls.items()} for _ in range(options.blocks)]
    factors = {name: float(options.block_s / np.median([block[name] for block in blocks])) for name in calls}
    lab.ledger.update(walking.settle())
    return {"control_hz": rate} | factors | {"expert_to_physics": factors["expert"] / factors["physics"]}


# -- Settings ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SettingsOptions(ExpertOptions):
    """Comparing `SETTINGS`.

    Attributes:
        episodes, seconds: of drawn commands.
        push: how the largest push to the side is searched.
    """

    tasks: tuple[str, ...] = COMPARED
    episodes: int = 5
    seconds: float = 10.0
    push: PushOptions = PushOptions(directions=("left", "right"))


class Settings(ExpertStudy):
    """What other settings of the expert buy and cost."""

    name = "expert_settings"
    title = "Settings compared"
    rows = {"task": "gait", "agent": "settings"}
    columns = {
        "survived": share("survived"),
        "velocity error [m/s]": mean("velocity_error", ".3f"),
        "push to the side [m/s]": mean("lateral_push", ".1f"),
    }
    full = SettingsOptions()
    quick = SettingsOptions(("trot",), 50, 1, 2.5, PushOptions(phases=1, grid=0, after_s=0.5, directions=("left",)))
    code = (*ExpertStudy.code, "experiments.pushing", "experiments.searches")

    def agents(self) -> list[Agent]:
        return [Agent(name) for name in SETTINGS]

    def measure(self, agent: Agent, cell: Any, seed: int) -> dict[str, Any]:
        options, lab = self.options, Lab(self.options.control_hz, make_expert(agent.name))
        walked = lab.score(cell.task, options.seconds, seed, options.episodes)
        pushes = [largest_push(lab, cell.task, direction, options.push, seed) for direction in options.push.directions]
        survived = sum(not episode.fallen for episode in walked.episodes)
        counts = {"trials": options.episodes, "survived": survived, "velocity_error": walked.velocity_error}
        return counts | {"lateral_push": min(pushes)} | dict(lab.settle())

    def measure_in(self, lab: Lab, task: str, seed: int) -> list[dict[str, Any]]:
        raise NotImplementedError
