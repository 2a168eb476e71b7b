"""How often the nonlinear program is linearized, and the options that remember."""

from dataclasses import replace

import numpy as np
import pytest

from experts import NMPCConfig, NMPCExpert, nmpc
from experts.mpc.srbd import COM, RPY
from experts.nmpc import WHOLE_BODY
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.sensing.state import RobotState

REMEMBERING = {
    "shifted": NMPCConfig(linearization="shifted", sqp_iterations=1),
    "mpc_hz": NMPCConfig(mpc_hz=100.0),
    "both": NMPCConfig(linearization="shifted", mpc_hz=100.0),
}


def episode(task: str, steps: int, push: float = 0.0) -> list[RobotState]:
    """States of a gait that was pushed just before the last one."""
    env = Go1Env(task)
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    states = []
    for _ in range(steps):
        env.step(env.expert_action())
        states.append(env.state)
    env.push((0.0, push, 0.0))
    return [*states, env.state]


@pytest.fixture(scope="module")
def trot() -> list[RobotState]:
    return episode("trot", 70, push=1.0)


def test_a_steady_trot_needs_one_program_per_call(trot):
    expert = NMPCExpert()
    for state in trot[30:-1]:
        expert.action(state)
    assert expert.counters.solves == expert.counters.calls == len(trot[30:-1])


def test_a_pushed_one_needs_more(trot):
    expert = NMPCExpert()
    expert.action(trot[-1])
    assert 1 < expert.counters.solves <= NMPCConfig().sqp_iterations


def test_the_number_of_programs_is_limited(trot):
    for most in (1, 2, 5):
        expert = NMPCExpert(config=NMPCConfig(sqp_iterations=most, sqp_tolerance=0.0))
        expert.action(trot[-1])
        assert expert.counters.solves == most


@pytest.mark.parametrize("task", ["trot", "bound"])
def test_a_converged_solution_is_a_fixed_point(task, monkeypatch):
    """Linearised once more along the answer, the program gives the answer."""
    tolerance = 1e-4
    expert = NMPCExpert(config=NMPCConfig(sqp_iterations=20, sqp_tolerance=tolerance))
    calls, problems = [], []
    linearize, solve = nmpc.linearize, expert._mpc.solve
    monkeypatch.setattr(nmpc, "linearize", lambda *args: (calls.append(args), linearize(*args))[1])
    monkeypatch.setattr(expert._mpc, "solve", lambda *args, **told: (problems.append(args), solve(*args, **told))[1])
    states = episode(task, 40, push=0.3)
    for state in states[30:]:
        plan = expert.plan(state, expert._model.dynamics(state))
        _, _, *rest = calls[-1]
        again = solve(linearize(plan.states, plan.inputs, *rest), *problems[-1][1:])
        moved = np.abs(again.states - plan.states[1:])
        assert moved[:, RPY].max() < tolerance and moved[:, COM].max() < 0.28 * tolerance
    assert len(states[30:]) < expert.counters.solves < 20 * len(states[30:])


def test_converging_changes_the_answer_a_little(trot):
    quick, converged = NMPCExpert(), NMPCExpert(config=NMPCConfig(sqp_iterations=20, sqp_tolerance=1e-4))
    moved = [np.abs(quick.action(state) - converged.action(state)).max() for state in trot]
    assert 1e-4 < max(moved) < 0.3


@pytest.mark.parametrize("name", REMEMBERING)
def test_asking_twice_at_one_time_gives_the_same_bits(trot, name):
    expert = NMPCExpert(config=REMEMBERING[name])
    for state in trot[::3]:
        actions = [expert.action(state) for _ in range(3)]
        np.testing.assert_array_equal(actions[0], actions[1])
        np.testing.assert_array_equal(actions[0], actions[2])


@pytest.mark.parametrize("name", REMEMBERING)
def test_asking_twice_does_not_change_what_comes_later(trot, name):
    once, twice = (NMPCExpert(config=REMEMBERING[name]) for _ in range(2))
    for state in trot[:20]:
        twice.action(state)
        np.testing.assert_array_equal(once.action(state), twice.action(state))


@pytest.mark.parametrize("name", REMEMBERING)
def test_reset_forgets(trot, name):
    expert, fresh = (NMPCExpert(config=REMEMBERING[name]) for _ in range(2))
    later = replace(trot[21], time_s=trot[20].time_s + 0.005)
    for state in trot[:21]:
        expert.action(state)
    remembered = expert.action(later)
    expert.reset(later)
    np.testing.assert_array_equal(expert.action(later), fresh.action(later))
    assert (remembered != fresh.action(later)).any(), "there was something to forget"


def test_by_default_nothing_is_remembered(trot):
    used, later = NMPCExpert(), replace(trot[21], time_s=trot[20].time_s + 0.005)
    for state in trot[:21]:
        used.action(state)
    np.testing.assert_array_equal(used.action(later), NMPCExpert().action(later))
    np.testing.assert_array_equal(used.action(replace(later, time_s=77.0)), used.action(later))


def test_forces_are_planned_at_the_rate_asked_for():
    config = NMPCConfig(mpc_hz=100)
    env = Go1Env("trot", control_hz=500, expert=lambda **keywords: NMPCExpert(config=config, **keywords))
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    for _ in range(100):
        env.step(env.expert_action())
    counters = env._expert.counters
    assert counters.calls == 100 and 20 <= counters.solves <= 24


@pytest.mark.parametrize("name", WHOLE_BODY)
def test_every_whole_body_walks(name):
    env = Go1Env("trot", expert=lambda **keywords: NMPCExpert(config=NMPCConfig(whole_body=name), **keywords))
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    for _ in range(100):
        assert not env.step(env.expert_action())[2]
    assert env.state.base_velocity[0] == pytest.approx(0.3, abs=0.12)
