"""The student without a clock as others use it: vector environments, copies, learning, and what is refused."""

import copy
import functools
import pickle

import numpy as np
import pytest
import torch
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

from go1_mtl_gym import PAPER_TASKS
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout
from tests.trainer.stub_env import StubEnv, linear_expert, make_stub
from tests.trainer.test_phase_free import BLIND, CHANNELS, TROT, WALK, rows
from trainers import (
    MultiHeadPolicy,
    PerturbationConfig,
    PhaseConfig,
    PhaseEstimator,
    PhaseFreePolicy,
    evaluate,
    phase_errors,
    train_phase_free,
    watch,
)
from trainers.data.stateful import Learner
from trainers.policies.phase_free import phase_free_layout

QUICK = PhaseConfig(steps=400, batch_size=256)


@pytest.fixture
def phase_free(policy) -> PhaseFreePolicy:
    """With an untrained estimator, a clock of its own, and a first knee that never makes the stub fall."""
    policy.act_normalizer.scale[2] = 0.0
    return PhaseFreePolicy(policy, PhaseEstimator(phase_free_layout(policy, 3), width=16), 0.3)


class Expert(MultiHeadPolicy):
    """The stub's linear expert, which needs the clock."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        env, layout = StubEnv(), ObservationLayout(PAPER_TASKS, CHANNELS)
        obs = np.atleast_2d(observation)
        part = {name: obs[:, where] for name, where in layout.slices.items()}
        phase = np.arctan2(*part["phase"].T) / (2 * np.pi)
        acts = []
        for q, command, turns, task in zip(part["q"], part["command"], phase, part["task"]):
            env.task, env.q, env.filtered, env.phase = StubEnv(PAPER_TASKS[task.argmax()]).task, q, command, turns
            acts.append(linear_expert(env.state))
        return np.array(acts, dtype=np.float32).reshape(*np.shape(observation)[:-1], 12), state


def expert() -> Expert:
    env = StubEnv()
    return Expert(env.observation_space, env.action_space, contract=env.contract, width=8, seed=0)


def test_environments_side_by_side_equal_each_alone(phase_free):
    """The state is kept per environment, over the ends of episodes too, which come at different times."""
    lengths = {"trot": 0.3, "walk": 0.5}
    makes = [functools.partial(StubEnv, task, episode_s=s, **BLIND) for task, s in lengths.items()]
    venv, alone = DummyVecEnv(makes), [DummyVecEnv([make]) for make in makes]
    venv.seed(0), alone[0].seed(0), alone[1].seed(1)  # DummyVecEnv seeds environment i with seed + i
    together, singly = Learner(phase_free), [Learner(phase_free) for _ in alone]
    obs, single_obs = venv.reset(), [env.reset() for env in alone]
    starts, single_starts = np.ones(2, dtype=bool), [np.ones(1, dtype=bool)] * 2
    for _ in range(60):
        acts = together.act(obs, starts)
        for i, env in enumerate(alone):
            own = singly[i].act(single_obs[i], single_starts[i])
            np.testing.assert_allclose(own[0], acts[i], atol=1e-4)
            single_obs[i], _, single_starts[i], _ = env.step(acts[i : i + 1])
        obs, _, starts, _ = venv.step(acts)


def test_stable_baselines3_evaluates_it(phase_free):
    makes = [functools.partial(StubEnv, task, episode_s=0.4, **BLIND) for task in PAPER_TASKS]
    _, lengths = evaluate_policy(phase_free, VecMonitor(DummyVecEnv(makes)), 8, return_episode_rewards=True)
    assert lengths == [20] * 8


def test_evaluation_makes_its_environment_and_keeps_its_state(phase_free):
    seen = []
    phase_free.estimator.register_forward_hook(lambda module, args, output: seen.append(args[0].shape))
    result = evaluate(phase_free, "walk", 1, 0.4, make_env=make_stub)
    assert result.survival_rate == 1.0 and seen == [(1, phase_free.estimator.layout.size)] * 20


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda policy: pickle.loads(pickle.dumps(policy))])
def test_copies_act_alike(phase_free, duplicate):
    other, obs = duplicate(phase_free), rows([TROT, WALK])
    (acts, state), (same, _) = (policy.predict(obs, deterministic=True) for policy in (phase_free, other))
    np.testing.assert_array_equal(acts, same)
    acts, same = (policy.predict(obs, state, deterministic=True)[0] for policy in (phase_free, other))
    np.testing.assert_array_equal(acts, same)


def test_it_says_which_environment_it_is_for(phase_free, policy):
    expected = {"control_hz": 50, "tasks": PAPER_TASKS, "kp": 50.0, "kd": 2.0, **BLIND}
    assert phase_free.env_kwargs == expected
    assert phase_free.action_space == policy.action_space and policy.env_kwargs["channels"] == CHANNELS


# -- Learning ----------------------------------------------------------------------------------------------------------


def test_it_learns_to_walk_without_the_clock():
    teacher = expert()
    generator = torch.random.get_rng_state()
    policy = train_phase_free(teacher, 20.0, 3, config=QUICK, make_env=make_stub)
    assert torch.equal(torch.random.get_rng_state(), generator)
    assert policy.correction < 1 and policy.estimator.layout.history == 3
    held_out = watch(teacher, "trot", 77, 5.0, history=3, make_env=make_stub)
    assert phase_errors(policy.estimator, held_out)["trot"]["median"] < 0.02
    result = evaluate(policy, "trot", 1, 4.0, commands=[(0.5, 0.0, 0.0)], make_env=make_stub)
    assert result.step_rate == pytest.approx(2.5, rel=0.1), "the stub lifts its legs in turn only if it knows the phase"


def test_learning_depends_on_its_arguments_alone():
    def weights(seed: int) -> torch.Tensor:
        policy = train_phase_free(expert(), 0.5, 2, config=PhaseConfig(steps=3), seed=seed, make_env=make_stub)
        return policy.estimator.network[0].weight

    assert torch.equal(weights(0), weights(0)) and not torch.equal(weights(0), weights(1))


def test_long_walks_are_cut_into_episodes_of_their_own_seeds(monkeypatch):
    walks = []

    def record(policy, task, seed, seconds, perturbation, history, **kwargs):
        walks.append((task, seed, seconds, perturbation, kwargs["friction"]))
        return watch(policy, task, seed, 0.1, perturbation, history, make_env=kwargs["make_env"])

    monkeypatch.setattr("trainers.algorithms.phase_free.watch", record)
    train_phase_free(expert(), 75.0, 2, config=PhaseConfig(steps=1), make_env=make_stub, friction=0.5)
    assert [walk[0] for walk in walks] == list(PAPER_TASKS) * 3
    assert {walk[2:] for walk in walks} == {(25.0, PerturbationConfig(), 0.5)} and len({walk[1] for walk in walks}) == 3


@pytest.mark.parametrize("arguments", [{"seconds": 0.0}, {"seconds": -1.0}, {"history": 0}, {"correction": 0.0}])
def test_learning_refuses_impossible_arguments(arguments):
    with pytest.raises(InvalidInputError, match=next(iter(arguments))):
        train_phase_free(expert(), make_env=make_stub, **arguments)


# -- Refused -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("correction", [0.0, -0.1, 1.1, np.nan])
def test_bad_correction(policy, correction):
    with pytest.raises(InvalidInputError, match="correction must lie in"):
        PhaseFreePolicy(policy, PhaseEstimator(phase_free_layout(policy, 1), width=8), correction)


@pytest.mark.parametrize(
    ("tasks", "channels", "message"),
    [
        (PAPER_TASKS[:2], ("command", "last_action"), "must have the tasks"),
        (PAPER_TASKS, ("command",), "the channels"),
        (PAPER_TASKS, ("command", "gravity", "last_action"), "gravity"),
    ],
)
def test_an_estimator_of_something_else(policy, tasks, channels, message):
    estimator = PhaseEstimator(ObservationLayout(tasks, channels), width=8)
    with pytest.raises(InvalidInputError, match=message):
        PhaseFreePolicy(policy, estimator)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"channels": ("command", "last_action")}, "must see command and phase"),
        ({"channels": ("phase",)}, "must see command and phase"),
        ({"history": 2}, "at least the student's 2 frames, got 1"),
    ],
)
def test_a_policy_that_sees_something_else(kwargs, message):
    env = StubEnv(**{"channels": CHANNELS, **kwargs})
    other = MultiHeadPolicy(env.observation_space, env.action_space, contract=env.contract, width=8)
    with pytest.raises(InvalidInputError, match=message):
        PhaseFreePolicy(other, PhaseEstimator(phase_free_layout(other, 1), width=8))


def test_a_policy_without_a_contract_or_without_gaits():
    env = StubEnv()
    unnamed = MultiHeadPolicy(env.observation_space, env.action_space, n_tasks=4, width=8)
    with pytest.raises(InvalidInputError, match="with a contract was expected"):
        phase_free_layout(unnamed, 1)
    contract = env.contract.with_tasks(("trot", "jump", "bound", "crawl"))
    crawling = MultiHeadPolicy(env.observation_space, env.action_space, contract=contract, width=8)
    with pytest.raises(InvalidInputError, match="names the gaits"):
        PhaseFreePolicy(crawling, PhaseEstimator(phase_free_layout(crawling, 1), width=8))


def test_observations_that_are_none(phase_free):
    obs = rows([TROT, WALK])
    beyond, no_task = obs.copy(), obs.copy()
    beyond[1, 3] = np.nan
    no_task[0, -4:] = 0.5
    for bad, message in ((obs[:, 1:], "finite numbers"), (beyond, "1 that are not finite"), (no_task, "one-hot")):
        with pytest.raises(InvalidInputError, match=message):
            phase_free.predict(bad)
    _, state = phase_free.predict(obs)
    with pytest.raises(InvalidInputError, match="state of 1 environments was expected, got one of 2"):
        phase_free.predict(obs[:1], state)
