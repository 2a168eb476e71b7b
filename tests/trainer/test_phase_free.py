"""The student without a clock: an oracle of the phase makes it the policy, and its own clock runs as it says."""

import dataclasses

import numpy as np
import pytest

import trainers
from go1_mtl_gym import PAPER_TASKS
from go1_mtl_gym.sensing.observation import ObservationLayout
from tests.trainer.stub_env import StubEnv
from trainers import MultiHeadPolicy, PhaseEstimator, PhaseFreePolicy
from trainers.policies.phase_free import phase_free_layout

CHANNELS = ("command", "phase", "last_action")
"""What the student sees."""
BLIND = {"channels": ("command", "last_action"), "history": 3}
"""Of the environments that the policy without a clock acts in."""
TROT, BOUND, JUMP, WALK = (PAPER_TASKS.index(name) for name in ("trot", "bound", "jump", "walk"))
GO = (0.5, 0.0, 0.0)


class Oracle(PhaseEstimator):
    """Answers the phases [cycles] that a function tells, one for each observation."""

    phases = None

    def estimate(self, obs: np.ndarray) -> np.ndarray:
        turns = 2 * np.pi * np.broadcast_to(self.phases(), len(obs))
        return np.stack([np.sin(turns), np.cos(turns)], axis=1).astype(np.float32)


def oracle(policy: MultiHeadPolicy, phases, correction: float = 1.0, history: int = 3) -> PhaseFreePolicy:
    """A phase_free policy whose estimator answers the phases that a function tells, or always one."""
    estimator = Oracle(phase_free_layout(policy, history), width=8)
    estimator.phases = phases if callable(phases) else lambda: phases
    return PhaseFreePolicy(policy, estimator, correction)


def rows(tasks: list[int], command=GO, seed: int = 0) -> np.ndarray:
    """Observations without a clock, of the tasks given under one command."""
    layout = ObservationLayout(PAPER_TASKS, **BLIND)
    obs = np.random.default_rng(seed).uniform(-1, 1, (len(tasks), layout.size))
    obs[:, layout.slices["command"]] = command
    obs[:, layout.slices["task"]] = np.eye(4)[tasks]
    return obs.astype(np.float32)


def turns(clock: np.ndarray) -> np.ndarray:
    """Phases [cycles] of sines and cosines, in [-0.5, 0.5)."""
    return np.arctan2(clock[:, 0], clock[:, 1]) / (2 * np.pi)


# -- In the student's place --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("task", PAPER_TASKS)
def test_with_an_oracle_it_acts_exactly_like_the_student(policy, task):
    seen, blind = StubEnv(task), StubEnv(task, **BLIND)
    phase_free = oracle(policy, lambda: blind.phase)
    (obs, _), (without, _) = seen.reset(seed=3), blind.reset(seed=3)
    assert phase_free.observation_space.contains(without) and without.size == obs.size - 2 + 2 * 34
    state = None
    for _ in range(60):
        expected = policy.predict(obs, deterministic=True)[0]
        action, state = phase_free.predict(without, state, deterministic=True)
        np.testing.assert_array_equal(action, expected)
        obs, without = seen.step(expected)[0], blind.step(action)[0]


def test_the_students_observation_is_put_together_entry_by_entry(policy):
    obs = rows([TROT, WALK])
    seen = []
    policy.predict = lambda full, **_: (seen.append(full), (np.zeros((len(full), 12)), None))[1]
    oracle(policy, 0.25).predict(obs)
    have, want = ObservationLayout(PAPER_TASKS, **BLIND), ObservationLayout(PAPER_TASKS, CHANNELS)
    for name, where in want.slices.items():
        expected = np.tile([1.0, 0.0], (2, 1)) if name == "phase" else obs[:, have.slices[name]]
        np.testing.assert_allclose(seen[0][:, where], expected, atol=1e-7, err_msg=name)


def test_a_batch_of_mixed_tasks_equals_one_row_at_a_time(policy):
    phases = np.array([0.1, 0.8, 0.35, 0.5, 0.6])
    obs = rows([WALK, TROT, TROT, JUMP, BOUND])
    actions, state = oracle(policy, phases).predict(obs, deterministic=True)
    assert actions.shape == (5, 12) and state[1].tolist() == [WALK, TROT, TROT, JUMP, BOUND]
    for row, phase, action in zip(obs, phases, actions):
        alone, (clock, task) = oracle(policy, phase).predict(row, deterministic=True)
        assert alone.shape == (12,) and clock.shape == (1, 2) and task.shape == (1,)
        np.testing.assert_allclose(alone, action, atol=1e-5)
    assert oracle(policy, phases[:0]).predict(obs[:0])[0].shape == (0, 12)


def test_with_a_correction_of_one_there_is_no_memory(policy):
    obs, phase_free = rows([TROT, BOUND, WALK]), oracle(policy, 0.3)
    alone = phase_free.predict(obs, deterministic=True)[0]
    for state in [(np.tile([1.0, 0.0], (3, 1)), np.array([TROT, TROT, WALK])), (np.zeros((9, 2)), np.zeros(9))]:
        for starts in (None, np.array([True, False, True])):
            again = phase_free.predict(obs, state, starts, deterministic=True)[0]
            np.testing.assert_array_equal(again, alone)


# -- The clock with correction -----------------------------------------------------------------------------------------


def test_the_clock_turns_and_is_corrected_half_way(policy):
    """The half-way mean of two unit vectors has the direction of their bisector; periods .4 s, .32 s and .6 s."""
    obs, phase_free = rows([TROT, BOUND, WALK]), oracle(policy, 0.25, 0.5)
    _, state = phase_free.predict(obs)
    np.testing.assert_allclose(turns(state[0]), 0.125, atol=1e-6)
    _, state = phase_free.predict(obs, state)
    later = 0.125 + 0.02 / np.array([0.4, 0.32, 0.6])
    np.testing.assert_allclose(turns(state[0]), (later + 0.25) / 2, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(state[0], axis=1), 1.0, atol=1e-6)


def test_a_quarter_of_the_way_and_the_environments_rate(policy):
    policy.contract = dataclasses.replace(policy.contract, control_hz=100)
    phase_free = oracle(policy, 0.25, 0.25)
    _, state = phase_free.predict(rows([TROT]), (np.array([[0.0, 1.0]]), np.array([TROT])))
    angle = 2 * np.pi * 0.01 / 0.4
    sine, cosine = 0.75 * np.sin(angle) + 0.25, 0.75 * np.cos(angle)
    np.testing.assert_allclose(turns(state[0]), np.arctan2(sine, cosine) / (2 * np.pi), atol=1e-6)


def test_episodes_and_tasks_begin_at_phase_zero(policy):
    phase_free = oracle(policy, 0.25, 0.5)
    before = (np.tile([0.0, -1.0], (3, 1)), np.array([TROT, BOUND, WALK]))
    _, state = phase_free.predict(rows([TROT, JUMP, WALK]), before, np.array([True, False, False]))
    begun, half = 0.125, (0.5 + 0.02 / 0.6 + 0.25) / 2
    np.testing.assert_allclose(turns(state[0]), [begun, begun, half], atol=1e-6)


def test_it_stands_while_the_command_asks_for_it_and_then_walks(policy):
    phase_free = oracle(policy, 0.25, 0.5)
    still, go = rows([TROT, BOUND, WALK], command=(0.0, 0.0, 0.0)), rows([TROT, BOUND, WALK])
    state = None
    for i in range(5):
        _, state = phase_free.predict(still, state)
        np.testing.assert_array_equal(state[0][[0, 2]], [[0.0, 1.0]] * 2)
        assert turns(state[0])[1] > 0.12, f"a bound cannot stand, call {i}"
    _, state = phase_free.predict(go, state)
    later = 0.02 / np.array([0.4, 0.6])
    np.testing.assert_allclose(turns(state[0])[[0, 2]], (later + 0.25) / 2, atol=1e-6)


def test_it_runs_on_to_phase_zero_before_it_stands(policy):
    answers = iter([0.98, 0.03, 0.4, 0.4])
    phase_free = oracle(policy, lambda: next(answers), 0.5)
    still = rows([TROT], command=(0.0, 0.0, 0.0))
    angle = 2 * np.pi * 0.93
    state = (np.array([[np.sin(angle), np.cos(angle)]]), np.array([TROT]))
    phases = []
    for _ in range(4):
        _, state = phase_free.predict(still, state)
        phases.append(turns(state[0]).item())
    np.testing.assert_allclose(phases, [-0.02, 0.0, 0.0, 0.0], atol=1e-6)


def test_a_correction_back_over_phase_zero_is_no_arrival(policy):
    phase_free = oracle(policy, 0.85, 0.75)
    angle = 2 * np.pi * 0.02
    state = (np.array([[np.sin(angle), np.cos(angle)]]), np.array([TROT]))
    _, state = phase_free.predict(rows([TROT], command=(0.0, 0.0, 0.0)), state)
    assert -0.15 < turns(state[0]).item() < -0.05


def test_the_real_environments_clock_is_followed_through_a_stand():
    """Driven by the expert; the oracle keeps the clock true, but for the period in which a command begins to ask."""
    kwargs = {"tasks": ("trot", "walk"), "channels": CHANNELS[:2], "history": 1}
    env = trainers.make_env("trot", **kwargs)
    base = env.unwrapped
    policy = MultiHeadPolicy(env.observation_space, env.action_space, contract=base.contract, width=8, seed=0)
    phase_free = oracle(policy, lambda: info["phase"], 0.3, history=1)
    columns = base.layout.columns(phase_free.estimator.layout)
    obs, info = env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    state, errors, standing = None, [], []
    for step in range(150):
        _, state = phase_free.predict(obs[columns], state, np.array([step == 0]))
        errors.append(abs((turns(state[0]).item() - info["phase"] + 0.5) % 1.0 - 0.5))
        standing.append(info["standing"])
        if step in (10, 70):
            base.set_command((0.4, 0.0, 0.0) if step == 10 else (0.0, 0.0, 0.0))
        obs, *_, info = env.step(env.expert_action())
    assert standing[:10] == [True] * 10 and standing[-1] and not any(standing[20:70])
    assert max(errors) <= 0.05 and max(errors[40:]) < 1e-3 and max(errors[:11] + errors[-20:]) == 0.0
