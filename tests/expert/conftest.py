"""Shared by the expert's tests: states from driven episodes, and the problems that the MPC met there."""

from dataclasses import dataclass

import numpy as np
import pytest

from experts import NMPCExpert
from go1_mtl_gym import GAITS
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.sensing.state import RobotState


@dataclass(frozen=True)
class Driven:
    """Every fifth state of a short episode with a push, and the arguments of the MPC's solve there."""

    states: list[RobotState]
    problems: list[tuple]


def drive(task: str, steps: int = 60) -> Driven:
    env = Go1Env(task)
    env.reset(seed=1, options={"command": (0.4, 0.1, 0.2)})
    env.expert_action()
    mpc, states, problems = env._expert._mpc, [], []
    solve = mpc.solve
    mpc.solve = lambda *problem, **told: (problems.append(problem), solve(*problem, **told))[1]
    kept = []
    for step in range(steps):
        if step == steps // 2:
            env.push((0.1, 0.3, 0.0))
        problems.clear()
        state, action = env.state, env.expert_action()
        if step % 5 == 2:
            states.append(state)
            kept.append(problems[-1])
        env.step(action)
    return Driven(states, kept)


@pytest.fixture(scope="session", params=list(GAITS))
def driven(request) -> Driven:
    return drive(request.param)


@pytest.fixture(scope="session")
def trotting() -> Driven:
    return drive("trot")


@pytest.fixture(scope="session")
def expert() -> NMPCExpert:
    return NMPCExpert()


@pytest.fixture
def standing() -> RobotState:
    """A Go1 in its home pose at phase 0 of a trot, with no command."""
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    env.simulation.reset(np.tile([0.0, 0.9, -1.8], 4))
    return env.state
