"""The policy: heads, normalisation, and everything stable-baselines3 wants of it."""

import copy
import pickle

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy

from go1_mtl_gym import Go1Env
from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import SIZE, StubEnv
from trainers import MultiHeadPolicy
from trainers.policies.networks import route


def observations(tasks: list[int], seed: int = 0, n_tasks: int = 4) -> np.ndarray:
    """Random observations of the tasks given, float32, shape (len(tasks), D)."""
    rows = np.random.default_rng(seed).normal(size=(len(tasks), SIZE))
    return np.hstack([rows, np.eye(n_tasks)[tasks]]).astype(np.float32)


@pytest.mark.parametrize("tasks", [[0, 0, 1, 2, 3, 3], [3, 0, 2, 0, 1, 3, 0], [2, 2, 2], [1, 3, 1]])
def test_mixed_batch_equals_one_row_at_a_time(policy, tasks):
    obs = observations(tasks)
    batch = policy.predict(obs, deterministic=True)[0]
    single = np.array([policy.predict(row, deterministic=True)[0] for row in obs])
    assert batch.shape == (len(tasks), 12)
    np.testing.assert_allclose(batch, single, atol=1e-5)


def test_routing_gives_each_row_its_own_head():
    heads = [torch.nn.Linear(2, 1) for _ in range(3)]
    for k, head in enumerate(heads):
        torch.nn.init.zeros_(head.weight)
        torch.nn.init.constant_(head.bias, float(k))
    index = torch.tensor([2, 0, 0, 2, 1])
    assert route(heads, torch.zeros(5, 2), index).flatten().tolist() == [2.0, 0.0, 0.0, 2.0, 1.0]
    assert route(heads, torch.zeros(0, 2), index[:0]).shape == (0, 1)


def test_only_chosen_heads_get_gradients(policy):
    policy.mean_actions(torch.from_numpy(observations([1, 3, 1]))).sum().backward()
    for k, head in enumerate(policy.actor.heads):
        moved = [p.grad is not None and bool(p.grad.abs().sum() > 0) for p in head.parameters()]
        assert all(moved) if k in (1, 3) else not any(moved), k
    assert all(p.grad.abs().sum() > 0 for p in policy.actor.trunk.parameters())


def test_other_heads_do_not_matter(policy):
    obs = observations([0, 2])
    before = policy.predict(obs, deterministic=True)[0]
    torch.nn.init.constant_(policy.actor.heads[1][-1].weight, 7.0)
    np.testing.assert_array_equal(policy.predict(obs, deterministic=True)[0], before)
    assert not np.allclose(policy.predict(observations([1]), deterministic=True)[0], before[:1])


def test_depth_is_trunk_two_head_two_and_elu(policy):
    linear = [m for m in policy.actor.trunk if isinstance(m, torch.nn.Linear)]
    assert [m.out_features for m in linear] == [32, 32] and linear[0].in_features == SIZE
    assert [m.out_features for m in policy.actor.heads[0] if isinstance(m, torch.nn.Linear)] == [32, 12]
    assert len(policy.actor.heads) == 4
    activations = [m for m in policy.actor.modules() if not list(m.children()) and not isinstance(m, torch.nn.Linear)]
    assert activations and all(isinstance(m, torch.nn.ELU) for m in activations)


def test_pooled_ignores_the_task_id():
    env = StubEnv()
    pooled = MultiHeadPolicy(env.observation_space, env.action_space, n_tasks=4, width=16, pooled=True, seed=0)
    obs = np.repeat(observations([0]), 4, axis=0)
    obs[:, -4:] = np.eye(4)
    actions = pooled.predict(obs, deterministic=True)[0]
    np.testing.assert_array_equal(actions, np.repeat(actions[:1], 4, axis=0))
    assert len(pooled.actor.heads) == 1


@pytest.mark.parametrize("bad", [[0, 0, 0, 0], [1, 1, 0, 0], [0.5, 0.5, 0, 0], [2, -1, 0, 0]])
def test_malformed_task_id(policy, bad):
    obs = observations([0, 1])
    obs[1, -4:] = bad
    with pytest.raises(InvalidInputError, match="one-hot"):
        policy.predict(obs)


def test_nan_observation(policy):
    obs = observations([0])
    obs[0, 3] = np.nan
    with pytest.raises(InvalidInputError, match="finite"):
        policy.predict(obs)


@pytest.mark.parametrize("mode", ["mean_std", "min_max", "none"])
def test_normalisation(mode):
    env = StubEnv()
    policy = MultiHeadPolicy(env.observation_space, env.action_space, n_tasks=4, width=8, normalization=mode, seed=0)
    obs = observations([0, 1, 2, 3] * 50) * 5 + 2
    obs[:, 30:34] = np.random.default_rng(1).integers(0, 2, (200, 4))
    obs[:, 7] = 0.4  # constant
    acts = np.random.default_rng(2).uniform(-0.2, 0.7, (200, 12)).astype(np.float32)
    policy.fit_normalization(obs, acts)
    inner = policy.obs_normalizer(torch.from_numpy(obs[:, :-4])).numpy()
    np.testing.assert_array_equal(inner[:, 30:34], obs[:, 30:34])
    assert np.abs(inner[:, 7] - (0.4 if mode == "none" else 0.0)).max() < 1e-6
    if mode == "mean_std":
        np.testing.assert_allclose([inner[:, 0].mean(), inner[:, 0].std()], [0, 1], atol=1e-5)
    if mode == "min_max":
        np.testing.assert_allclose([inner[:, 0].min(), inner[:, 0].max()], [-1, 1], atol=1e-5)
        normalized = policy.act_normalizer(torch.from_numpy(acts)).numpy()
        np.testing.assert_allclose([normalized.min(0), normalized.max(0)], [[-1] * 12, [1] * 12], atol=1e-5)
    back = policy.act_normalizer.inverse(policy.act_normalizer(torch.from_numpy(acts)))
    np.testing.assert_allclose(back.numpy(), acts, atol=1e-6)


def test_outliers_are_clipped(policy):
    obs = observations([0])
    policy.fit_normalization(observations([0] * 100), np.random.default_rng(0).normal(size=(100, 12)))
    far, farther = obs.copy(), obs.copy()
    far[0, 0], farther[0, 0] = 1e3, 1e6
    one, other = (policy.predict(o, deterministic=True)[0] for o in (far, farther))
    np.testing.assert_array_equal(one, other)


def test_normalisation_rejects_nan(policy):
    obs = observations([0, 1])
    obs[0, 5] = np.nan
    with pytest.raises(InvalidInputError, match=r"\[5\]"):
        policy.fit_normalization(obs, np.zeros((2, 12)))


@pytest.mark.parametrize(
    "kwargs",
    [{"width": 0}, {"n_tasks": 0}, {"n_tasks": 500}, {"normalization": "z"}, {"clip_sd": 0}, {"use_sde": True}],
)
def test_bad_arguments(kwargs):
    env = StubEnv()
    with pytest.raises(InvalidInputError):
        MultiHeadPolicy(env.observation_space, env.action_space, **kwargs)


def test_seed_fixes_weights_and_spares_the_global_generator():
    env = StubEnv()
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    a, b = (MultiHeadPolicy(env.observation_space, env.action_space, n_tasks=4, width=8, seed=1) for _ in range(2))
    assert torch.equal(torch.rand(1), expected)
    assert all(torch.equal(p, q) for p, q in zip(a.parameters(), b.parameters()))


def test_heads_are_those_of_the_contracts_tasks():
    env = StubEnv(tasks=("trot", "walk"))
    policy = MultiHeadPolicy(env.observation_space, env.action_space, contract=env.contract)
    assert policy.n_tasks == 2 and policy.tasks == ("trot", "walk") and policy.env_kwargs["tasks"] == ("trot", "walk")


def test_a_contract_is_not_to_be_forgotten_and_must_fit():
    env, other = StubEnv(), StubEnv(tasks=("trot", "walk"))
    with pytest.raises(InvalidInputError, match="policy_kwargs={'contract': env.unwrapped.contract}"):
        MultiHeadPolicy(env.observation_space, env.action_space)
    with pytest.raises(InvalidInputError, match="by the contract .*trot, walk"):
        MultiHeadPolicy(env.observation_space, env.action_space, contract=other.contract)
    with pytest.raises(InvalidInputError, match="by the contract"):
        MultiHeadPolicy(env.observation_space, env.action_space, contract=env.contract, n_tasks=3)


def test_an_observation_of_another_environment_is_refused_with_the_one_that_is_meant(policy):
    for shape in ((40,), (3, 56), (2, 2, 55), ()):
        with pytest.raises(InvalidInputError, match=r"task id of trot, bound, jump, walk; policy.make_env\(\) makes"):
            policy.predict(np.zeros(shape, dtype=np.float32))


def test_a_policy_makes_its_environment():
    env = Go1Env("trot", tasks=("trot", "walk"), channels=("command",), control_hz=100, noise=True)
    policy = MultiHeadPolicy(
        env.observation_space, env.action_space, contract=env.contract, env_kwargs={"friction": 0.5}, width=8
    )
    made = policy.make_env("walk", episode_s=2.0)
    assert made.unwrapped.contract == env.contract and made.unwrapped.physics_params.friction == 0.5
    assert policy.make_env().reset(seed=0)[1]["task"] in ("trot", "walk")
    with pytest.raises(InvalidInputError, match="task must be one of 'trot', 'walk'; got 'jump'"):
        policy.make_env("jump")
    with pytest.raises(InvalidInputError, match="the policy and the environment do not belong together: kp"):
        policy.make_env("walk", kp=40.0)


def test_copies_predict_the_same(policy):
    obs = observations([0, 3, 1])
    expected = policy.predict(obs, deterministic=True)[0]
    for other in (copy.deepcopy(policy), pickle.loads(pickle.dumps(policy))):
        np.testing.assert_array_equal(other.predict(obs, deterministic=True)[0], expected)
        assert other.env_kwargs == policy.env_kwargs


def test_constructor_parameters_rebuild_the_policy(policy):
    other = MultiHeadPolicy(**policy._get_constructor_parameters())
    other.load_state_dict(policy.state_dict())
    obs = observations([2])
    np.testing.assert_array_equal(other.predict(obs, deterministic=True)[0], policy.predict(obs, deterministic=True)[0])


def test_exploration_is_small_gaussian_and_clipped(policy):
    torch.manual_seed(0)
    actions = policy.predict(np.repeat(observations([0]), 2000, axis=0))[0]
    assert np.abs(actions).max() <= 1.0
    stddev = policy.get_distribution(torch.from_numpy(observations([0]))).distribution.stddev
    np.testing.assert_allclose(stddev.detach(), np.exp(-3.5), rtol=1e-5)


def test_ppo_learns_saves_and_loads(venv, tmp_path):
    kwargs = {"n_steps": 16, "batch_size": 32, "n_epochs": 1, "policy_kwargs": {"n_tasks": 4}}
    model = PPO(MultiHeadPolicy, venv, **kwargs, seed=0, device="cpu")
    before = copy.deepcopy(model.policy.state_dict())
    model.learn(64)
    assert any(not torch.equal(before[k], v) for k, v in model.policy.state_dict().items() if k.startswith("actor"))
    mean, _ = evaluate_policy(model.policy, venv, n_eval_episodes=1, warn=False)
    assert np.isfinite(mean)
    model.save(tmp_path / "ppo.zip")
    again = PPO.load(tmp_path / "ppo.zip", device="cpu")
    obs = observations([0, 1, 2, 3])
    np.testing.assert_array_equal(again.predict(obs, deterministic=True)[0], model.predict(obs, deterministic=True)[0])


def test_ppo_starts_from_a_clone(policy, venv):
    model = PPO(MultiHeadPolicy, venv, policy_kwargs=policy.network_kwargs(), device="cpu")
    model.policy.load_state_dict(policy.state_dict())
    obs = observations([1])
    np.testing.assert_array_equal(model.predict(obs, deterministic=True)[0], policy.predict(obs, deterministic=True)[0])
