"""An expert that was used can be copied, pickled and sent to workers; the copy goes on as the original would."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

import trainers
from experts import MPCConfig, NMPCConfig, NMPCExpert
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.sensing.state import RobotState

CONFIGS = {
    "default": NMPCConfig(),
    "whole-body program": NMPCConfig(whole_body="qp"),
    "Jacobian transpose": NMPCConfig(whole_body="jacobian_transpose"),
    "shifted": NMPCConfig(linearization="shifted", sqp_iterations=1),
    "100 Hz": NMPCConfig(mpc_hz=100.0),
    "piqp": NMPCConfig(mpc=MPCConfig(solver="piqp")),
    "daqp": NMPCConfig(mpc=MPCConfig(solver="daqp")),
}
COPIES = {"deepcopy": copy.deepcopy, "pickle": lambda expert: pickle.loads(pickle.dumps(expert))}


@pytest.fixture(scope="module")
def states() -> list[RobotState]:
    """The last states of a third of a second of a trot at 500 Hz, pushed in their middle."""
    env = Go1Env("trot", control_hz=500)
    env.reset(seed=0, options={"command": (0.4, 0.1, 0.2)})
    kept = []
    for step in range(170):
        if step == 155:
            env.push((0.2, 0.6, 0.0))
        kept.append(env.state)
        env.step(env.expert_action())
    return kept[140:]


@pytest.mark.parametrize("name", CONFIGS)
@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
def test_a_copy_of_a_used_expert_answers_as_the_original(states, name, copied):
    solver = CONFIGS[name].mpc.solver
    pytest.importorskip(solver)
    original = NMPCExpert(PDGains(40.0, 1.5), 0.002, CONFIGS[name])
    for state in states[:18]:  # in the middle of a period of 10 ms, just after the push
        original.action(state)
    other = copied(original)
    assert (other.gains, other.hold_s, other.config) == (original.gains, original.hold_s, original.config)
    assert other.counters == original.counters and other.counters is not original.counters
    for state in states[18:]:
        np.testing.assert_array_equal(other.action(state), original.action(state))
    assert other.counters == original.counters


@pytest.mark.parametrize("name", ["shifted", "100 Hz"])
def test_what_is_remembered_is_copied_and_not_shared(states, name):
    original = NMPCExpert(hold_s=0.002, config=CONFIGS[name])
    for state in states[:17]:
        original.action(state)
    other, fresh = copy.deepcopy(original), NMPCExpert(hold_s=0.002, config=CONFIGS[name])
    answer = original.action(states[17])
    assert (fresh.action(states[17]) != answer).any(), "there was something to remember"
    other.reset(states[17])
    np.testing.assert_array_equal(other.action(states[17]), fresh.action(states[17]))
    later = replace(states[17], time_s=states[17].time_s + 1e-4)
    expected = copy.deepcopy(original).action(later)
    np.testing.assert_array_equal(original.action(later), expected, "the copy's reset did not reach the original")


def test_a_used_expert_can_be_evaluated_by_two_workers(states):
    expert = NMPCExpert()
    expert.action(states[0])
    alone, shared = (trainers.evaluate(expert, "trot", episodes=2, seconds=0.3, n_jobs=jobs) for jobs in (1, 2))
    assert repr(alone) == repr(shared), "equal, NaN included"
    assert len(shared.episodes) == 2
