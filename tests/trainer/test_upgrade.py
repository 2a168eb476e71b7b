"""Policy files of version 0.1: their actions stay the same joint targets."""

import json
import zipfile

import numpy as np
import pytest
import safetensors.torch
import torch

import trainers
from go1_mtl_gym import PAPER_TASKS, TASKS, Go1Env
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.contract import PolicyContract
from go1_mtl_gym.sensing.observation import ObservationLayout
from trainers import MultiHeadPolicy, PhaseEstimator, PhaseFreePolicy
from trainers.policies.checkpoint import space_to_json, tensors_of
from trainers.policies.phase_free import phase_free_layout

GAINS = PDGains(40.0, 1.0)
OLD, NEW = ActionMap.of_version_0_1(GAINS), ActionMap.for_gains(GAINS)
CHANNELS = ("command", "phase", "last_action")
LAYOUT = ObservationLayout(PAPER_TASKS, CHANNELS)


@pytest.fixture
def old_policy() -> MultiHeadPolicy:
    """A policy of the old map, with weights and normalizations of its own."""
    contract = PolicyContract.of_environment(LAYOUT, [TASKS[name].gait for name in PAPER_TASKS], 50, GAINS, OLD)
    env = Go1Env("trot", **contract.env_kwargs)
    policy = MultiHeadPolicy(env.observation_space, env.action_space, contract=contract, width=16, seed=0)
    for head in policy.actor.heads:
        torch.nn.init.normal_(head[-1].weight, std=0.02)
    rng = np.random.default_rng(0)
    policy.obs_normalizer.set(rng.normal(size=51), rng.uniform(0.5, 2.0, 51))
    policy.act_normalizer.set(rng.uniform(-0.2, 0.2, 12), rng.uniform(0.02, 0.05, 12))
    return policy


def write_0_1(path, policy: MultiHeadPolicy, estimator: PhaseEstimator | None = None, **env_kwargs) -> None:
    """The file that version 0.1 wrote."""
    network = {"width": 16, "n_tasks": 4, "pooled": False, "normalization": "mean_std", "clip_sd": 6.0}
    given = {"tasks": list(PAPER_TASKS), "channels": list(CHANNELS), "kp": 40.0, "kd": 1.0, **env_kwargs}
    description = {
        "format": "go1-mtl-gym policy",
        "format_version": 1,
        "network": network | {"env_kwargs": given, "log_std_init": -1.0},
        "observation_space": space_to_json(policy.observation_space),
        "action_space": space_to_json(policy.action_space),
    }
    files = {"weights.safetensors": safetensors.torch.save(tensors_of(policy))}
    if estimator is not None:
        description["clockless"] = {"history": 3, "width": 16, "correction": 0.3}
        files["phase.safetensors"] = safetensors.torch.save(tensors_of(estimator))
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in ({"policy.json": json.dumps(description)} | files).items():
            archive.writestr(name, content)


def observations(last_targets: np.ndarray, action_map: ActionMap) -> np.ndarray:
    """What is seen after the robot was asked for joint targets [rad], told in the units of an action map."""
    obs = np.random.default_rng(1).normal(size=(len(last_targets), LAYOUT.size))
    obs[:, LAYOUT.slices["last_action"]] = (last_targets - action_map.center) / action_map.half_range
    obs[:, LAYOUT.slices["task"]] = np.eye(4)[np.arange(len(last_targets)) % 4]
    return obs.astype(np.float32)


def test_the_same_robot_is_asked_for_the_same_joint_targets(old_policy, tmp_path):
    write_0_1(tmp_path / "old.zip", old_policy, friction=0.7)
    new = trainers.load(tmp_path / "old.zip")
    assert new.contract == Go1Env("trot", **new.contract.env_kwargs).contract
    assert new.env_kwargs["friction"] == 0.7 and new.env_kwargs["tasks"] == PAPER_TASKS
    targets = np.random.default_rng(2).uniform(-0.5, 0.5, (40, 12)) + [0.0, 0.9, -1.8] * 4
    before = OLD.to_radians(old_policy.predict(observations(targets, OLD), deterministic=True)[0])
    after = NEW.to_radians(new.predict(observations(targets, NEW), deterministic=True)[0])
    np.testing.assert_allclose(after, before, rtol=0, atol=2e-6)
    radians = [np.exp(policy.log_std.detach().numpy()) * m.half_range for policy, m in ((old_policy, OLD), (new, NEW))]
    np.testing.assert_allclose(*radians, rtol=1e-5)


def test_a_phase_free_one_too(old_policy, tmp_path):
    estimator = PhaseEstimator(phase_free_layout(old_policy, 3), width=16, seed=1)
    rng = np.random.default_rng(3)
    estimator.normalizer.set(rng.normal(size=estimator.layout.size), rng.uniform(0.5, 2.0, estimator.layout.size))
    write_0_1(tmp_path / "old.zip", old_policy, estimator)
    new, old = trainers.load(tmp_path / "old.zip"), PhaseFreePolicy(old_policy, estimator, 0.3)
    slices, acts = old.contract.slices, []
    targets = rng.uniform(-0.5, 0.5, (8, 12)) + [0.0, 0.9, -1.8] * 4
    for policy, action_map in ((old, OLD), (new, NEW)):
        obs = np.random.default_rng(4).normal(size=(8, old.contract.observation_size))
        obs[:, slices["last_action"]] = (targets - action_map.center) / action_map.half_range
        obs[:, slices["task"]] = np.eye(4)[np.arange(8) % 4]
        actions, _ = policy.predict(obs.astype(np.float32), deterministic=True)
        acts.append(action_map.to_radians(actions))
    np.testing.assert_allclose(acts[1], acts[0], rtol=0, atol=1e-5)


@pytest.mark.parametrize("tasks", [[], ["trot", "bound", "jump", "crawl"]])
def test_tasks_that_are_not_named_or_not_known(old_policy, tmp_path, tasks):
    write_0_1(tmp_path / "old.zip", old_policy, tasks=tasks)
    with pytest.raises(trainers.CheckpointError, match="version 0.1 was expected to name its tasks"):
        trainers.load(tmp_path / "old.zip")
