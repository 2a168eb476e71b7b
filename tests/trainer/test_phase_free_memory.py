"""What the student without a clock remembers for who hands no state back, and what leaves that memory alone."""

import copy
import functools
import pickle
import warnings

import numpy as np
import pytest
import torch
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

import trainers
from go1_mtl_gym import PAPER_TASKS
from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import StubEnv, make_stub
from tests.trainer.test_phase_free import BLIND, BOUND, JUMP, TROT, WALK, oracle, rows, turns
from trainers import Learner, MultiHeadPolicy, PhaseEstimator, PhaseFreePolicy, offline_metrics, train_phase_free, watch
from trainers.data.stateful import act_on_rows
from trainers.policies.phase_free import CORRECTION, phase_free_layout


@pytest.fixture
def phase_free(policy) -> PhaseFreePolicy:
    """With an untrained estimator, and a first knee that never makes the stub fall."""
    policy.act_normalizer.scale[2] = 0.0
    return PhaseFreePolicy(policy, PhaseEstimator(phase_free_layout(policy, 3), width=16, seed=0), 0.3)


def act(policy: PhaseFreePolicy, obs: np.ndarray, *state, **starts) -> np.ndarray:
    """The action alone."""
    return policy.predict(obs, *state, deterministic=True, **starts)[0]


def walked(policy: PhaseFreePolicy, tasks: list[int], steps: int = 5) -> np.ndarray:
    """The action after some steps in which no state was handed back."""
    return [act(policy, rows(tasks, seed=i)) for i in range(steps)][-1]


def anew(policy: PhaseFreePolicy, obs: np.ndarray) -> np.ndarray:
    """The action at the beginning of an episode."""
    return act(policy, obs, policy.initial_state(len(np.atleast_2d(obs))))


def duplicates() -> list:
    return [copy.copy, copy.deepcopy, lambda policy: pickle.loads(pickle.dumps(policy))]


# -- Nothing to hand back ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(-1,), (1, -1), (3, -1)])
def test_who_hands_no_state_back_gets_the_same_to_the_bit(phase_free, shape):
    """Through changes of task, episodes that begin, and commands that ask for a stand."""
    other, n = phase_free.with_correction(0.3), 1 if len(shape) == 1 else shape[0]
    rng, state = np.random.default_rng(0), other.initial_state(n)
    memoryless = phase_free.with_correction(1.0)
    differs = 0
    for step in range(100):
        tasks = [[TROT, WALK, JUMP], [TROT, BOUND, JUMP]][step // 10 % 2][:n]
        obs = rows(tasks, (0.0, 0.0, 0.0) if step % 30 > 20 else (0.5, 0.0, 0.0), seed=step).reshape(shape)
        starts = rng.random(n) < 0.05
        expected, state = other.predict(obs, state, starts, deterministic=True)
        action, returned = phase_free.predict(obs, episode_start=starts, deterministic=True)
        np.testing.assert_array_equal(action, expected)
        for one, same in zip(returned, state):
            np.testing.assert_array_equal(one, same)
        differs += not np.array_equal(action, act(memoryless, obs))
    assert differs > 70


def test_a_state_that_was_returned_can_be_changed_without_harm(phase_free):
    other, obs = phase_free.with_correction(0.3), rows([TROT, WALK])
    for _ in range(3):
        (action, state), expected = phase_free.predict(obs, deterministic=True), act(other, obs)
        np.testing.assert_array_equal(action, expected)
        state[0][:], state[1][:] = 0.0, JUMP


def test_a_reset_and_the_beginning_of_an_episode_begin_anew(phase_free):
    obs = rows([TROT, WALK], seed=9)
    fresh, goes_on = anew(phase_free, obs), act(phase_free, obs, phase_free.predict(rows([TROT, WALK]))[1])
    for begin in (True, np.array([True, True])):
        assert not np.array_equal(walked(phase_free, [TROT, WALK]), fresh)
        np.testing.assert_array_equal(act(phase_free, obs, episode_start=begin), fresh)
    walked(phase_free, [TROT, WALK])
    phase_free.reset()
    np.testing.assert_array_equal(act(phase_free, obs), fresh)
    phase_free.reset()
    act(phase_free, rows([TROT, WALK]))
    half = act(phase_free, obs, episode_start=np.array([True, False]))
    np.testing.assert_array_equal(half, [fresh[0], goes_on[1]])
    assert not np.array_equal(fresh[1], goes_on[1])


def test_another_size_of_batch_begins_anew_and_warns_once(phase_free):
    one, two = rows([TROT], seed=5), rows([TROT, WALK], seed=6)
    walked(phase_free, [TROT])
    with pytest.warns(UserWarning, match="2 observations and no state after 1") as record:
        np.testing.assert_array_equal(act(phase_free, two), anew(phase_free, two))
    assert len(record) == 1 and record[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(act(phase_free, one), anew(phase_free, one))
        other = phase_free.with_correction(0.3)
        for n in (1, 2, 3):  # who says that episodes begin is not warned
            act(other, rows([TROT] * n), episode_start=True)
        memoryless = phase_free.with_correction(1.0)
        for n in (1, 2, 3):
            act(memoryless, rows([TROT] * n))


def test_what_was_refused_is_not_remembered(phase_free):
    other, obs = phase_free.with_correction(0.3), rows([TROT, WALK], seed=4)
    walked(phase_free, [TROT, WALK]), walked(other, [TROT, WALK])
    no_task = obs.copy()
    no_task[0, -4:] = 0.5
    with pytest.raises(InvalidInputError, match="one-hot"):
        phase_free.predict(no_task)
    for starts in ([True], [[True, False]], np.zeros(3)):
        with pytest.raises(InvalidInputError, match=r"one bool or 2, one an observation, got shape"):
            phase_free.predict(obs, episode_start=starts)
    np.testing.assert_array_equal(act(phase_free, obs), act(other, obs))


def test_a_change_out_of_a_jump_begins_the_clock_when_the_environment_does():
    """The environment waits for the middle of the stance; until then the task id and the clock are the jump's."""
    env = trainers.make_env("jump", tasks=("jump", "trot"), channels=("command", "phase"), history=1)
    base = env.unwrapped
    policy = MultiHeadPolicy(env.observation_space, env.action_space, contract=base.contract, width=8, seed=0)
    phase_free = oracle(policy, lambda: info["phase"], 0.3, history=1)
    columns = base.layout.columns(phase_free.estimator.layout)
    obs, info = env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    errors, tasks = [], []
    for step in range(60):
        clock = phase_free.predict(obs[columns])[1][0]
        errors.append(abs((turns(clock).item() - info["phase"] + 0.5) % 1.0 - 0.5))
        tasks.append(info["task"])
        if step == 32:
            base.set_task("trot")
        obs, *_, info = env.step(env.expert_action())
    assert tasks[33] == "jump" and tasks[-1] == "trot" and max(errors[30:]) < 1e-5


@pytest.mark.parametrize("n", [-1, 1.5, None])
def test_states_of_no_number_of_environments(phase_free, n):
    with pytest.raises(InvalidInputError, match="number of environments"):
        phase_free.initial_state(n)


# -- Who keeps states --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("first", ["initial_state", "episode_start"])
def test_states_are_followed_and_leave_the_memory_alone(phase_free, first):
    """Also if the first call has no state, once the state that it returned comes back."""
    lone, kept = phase_free.with_correction(0.3), phase_free.with_correction(0.3)
    walked(phase_free, [TROT]), walked(lone, [TROT])
    start = rows([WALK, JUMP], seed=20)
    if first == "initial_state":
        action, state = phase_free.predict(start, phase_free.initial_state(2), deterministic=True)
    else:
        action, state = phase_free.predict(start, None, np.ones(2, dtype=bool), deterministic=True)
    np.testing.assert_array_equal(action, act(kept, start))
    for i in range(5):
        obs, single = rows([WALK, JUMP], seed=i), rows([TROT], seed=30 + i)
        action, state = phase_free.predict(obs, state, deterministic=True)
        np.testing.assert_array_equal(action, act(kept, obs))
        np.testing.assert_array_equal(act(phase_free, single), act(lone, single))


def test_every_episode_of_who_keeps_states_can_begin_with_none(phase_free):
    first = None
    for _ in range(3):
        state, actions = None, []
        for i in range(4):
            action, state = phase_free.predict(rows([TROT], seed=i), state, deterministic=True)
            actions.append(action)
        first = actions if first is None else first
        np.testing.assert_array_equal(actions, first)


def test_learners_share_a_policy_and_leave_its_memory_alone(phase_free):
    tasks = {"one": [TROT], "pair": [WALK, JUMP], "own": [BOUND]}
    alone = {name: phase_free.with_correction(0.3) for name in tasks}
    learners = {name: Learner(phase_free) for name in ("one", "pair")}
    walked(phase_free, tasks["own"]), walked(alone["own"], tasks["own"])
    for step in range(20):
        for name, of_tasks in tasks.items():
            obs, starts = rows(of_tasks, seed=step + 1), np.full(len(of_tasks), step % 7 == 0)
            if name == "own":
                action, expected = act(phase_free, obs), act(alone[name], obs)
            else:
                action, expected = learners[name].act(obs, starts), act(alone[name], obs, episode_start=starts)
            np.testing.assert_array_equal(action, expected, err_msg=f"{name}, step {step}")


def test_stable_baselines3s_evaluation_leaves_the_memory_alone(phase_free):
    lone, obs = phase_free.with_correction(0.3), rows([TROT], seed=7)
    walked(phase_free, [TROT]), walked(lone, [TROT])
    makes = [functools.partial(StubEnv, task, episode_s=0.2, **BLIND) for task in PAPER_TASKS]
    evaluate_policy(phase_free, VecMonitor(DummyVecEnv(makes)), 4)
    np.testing.assert_array_equal(act(phase_free, obs), act(lone, obs))


# -- Copies and files --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("duplicate", duplicates())
def test_copies_begin_anew_and_go_their_own_way(phase_free, duplicate):
    lone, obs = phase_free.with_correction(0.3), rows([TROT], seed=8)
    walked(phase_free, [TROT]), walked(lone, [TROT])
    other = duplicate(phase_free)
    np.testing.assert_array_equal(act(other, obs), anew(phase_free, obs))
    walked(other, [WALK])
    np.testing.assert_array_equal(act(phase_free, obs), act(lone, obs))


def test_files_hold_no_memory(phase_free, tmp_path):
    phase_free.save(tmp_path / "before.zip")
    walked(phase_free, [TROT])
    phase_free.save(tmp_path / "after.zip")
    assert (tmp_path / "before.zip").read_bytes() == (tmp_path / "after.zip").read_bytes()
    obs = rows([TROT], seed=1)
    np.testing.assert_array_equal(act(PhaseFreePolicy.load(tmp_path / "after.zip"), obs), anew(phase_free, obs))


# -- Rows, and walks that are watched ----------------------------------------------------------------------------------


def test_rows_are_answered_by_themselves_and_not_remembered(phase_free):
    lone, obs = phase_free.with_correction(0.3), rows([TROT, WALK, JUMP, TROT], seed=3)
    walked(phase_free, [TROT]), walked(lone, [TROT])
    expected = act(phase_free.with_correction(1.0), obs)
    np.testing.assert_array_equal(act_on_rows(phase_free, obs), expected)
    np.testing.assert_array_equal(phase_free._predict(torch.from_numpy(obs), deterministic=True).numpy(), expected)
    np.testing.assert_allclose(act_on_rows(phase_free, obs[::-1])[::-1], expected, atol=1e-5)
    np.testing.assert_array_equal(walked(phase_free, [TROT]), walked(lone, [TROT]))


def test_offline_metrics_are_of_rows_by_themselves(phase_free, monkeypatch):
    monkeypatch.setattr("trainers.evaluation.metrics.BATCH", 10)  # batches of one size that follow one another
    driven = watch(phase_free.with_correction(1.0).student, "trot", 0, 1.0, history=3, make_env=make_stub)
    driven = driven.select(("command", "last_action"), 3)
    expected = offline_metrics(phase_free.with_correction(1.0), driven)
    assert offline_metrics(phase_free, driven) == expected


def test_a_watched_policy_keeps_its_state_and_begins_anew_with_every_episode(policy):
    policy.act_normalizer.scale[2] = 0.0
    phase_free = PhaseFreePolicy(policy, PhaseEstimator(phase_free_layout(policy, 1), width=16, seed=0), 0.3)
    driven = watch(phase_free, "trot", 0, 1.0, make_env=make_stub, episode_s=0.4)
    learner = Learner(phase_free.with_correction(0.3))
    expected = [learner.act(obs, np.array([start])) for obs, start in zip(driven.obs, driven.starts)]
    assert driven.starts.sum() == 3
    np.testing.assert_array_equal(driven.acts, expected)


def test_a_clock_with_correction_is_the_default(policy):
    estimator = PhaseEstimator(phase_free_layout(policy, 1), width=8)
    assert 0 < PhaseFreePolicy(policy, estimator).correction == CORRECTION < 1
    assert train_phase_free.__kwdefaults__["correction"] == CORRECTION
