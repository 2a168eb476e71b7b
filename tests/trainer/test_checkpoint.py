"""Policies on disk."""

import dataclasses
import json
import zipfile

import numpy as np
import pytest
import torch

import trainers
from go1_mtl_gym import SensorNoise
from go1_mtl_gym.errors import Go1Error, InvalidInputError
from tests.trainer.stub_env import StubEnv
from tests.trainer.test_phase_free import rows
from tests.trainer.test_policy import observations
from trainers import MultiHeadPolicy, PhaseEstimator, PhaseFreePolicy
from trainers.policies.phase_free import phase_free_layout


@pytest.fixture
def saved(policy, tmp_path):
    """A policy with fitted normalisation, and the file it was saved to."""
    policy.fit_normalization(observations([0, 1, 2, 3] * 20), np.random.default_rng(0).uniform(-1, 1, (80, 12)))
    policy.extra_env_kwargs = {"friction": 0.7, "noise": True}
    path = tmp_path / "deep" / "policy.zip"
    policy.save(path)
    return policy, path


@pytest.fixture
def phase_free(policy, tmp_path):
    """A phase_free policy whose estimator has learned a normalisation, and the file it was saved to."""
    estimator = PhaseEstimator(phase_free_layout(policy, 3), width=16, seed=5)
    rng = np.random.default_rng(1)
    estimator.normalizer.set(rng.normal(size=estimator.layout.size), rng.uniform(0.5, 2, estimator.layout.size))
    policy, path = PhaseFreePolicy(policy, estimator, 0.3), tmp_path / "phase_free.zip"
    policy.save(path)
    return policy, path


def rewrite(path, changes: dict[str, bytes | None], description: dict | None = None) -> None:
    """Replace files of an archive, or leave them out, and entries of the description of its phase_free part."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    known = json.loads(files["policy.json"])
    known["policy"]["phase"] |= description or {}
    files |= {"policy.json": json.dumps(known).encode()} | changes
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in files.items():
            if content is not None:
                archive.writestr(name, content)


@pytest.mark.parametrize("load", [trainers.load, MultiHeadPolicy.load])
def test_round_trip_is_exact(saved, load):
    policy, path = saved
    other = load(path)
    obs = observations([0, 3, 1, 2])
    np.testing.assert_array_equal(other.predict(obs, deterministic=True)[0], policy.predict(obs, deterministic=True)[0])
    assert other.state_dict().keys() == policy.state_dict().keys()
    assert all(torch.equal(a, b) for a, b in zip(other.state_dict().values(), policy.state_dict().values()))
    assert other.env_kwargs == policy.env_kwargs
    assert other.observation_space == policy.observation_space and other.action_space == policy.action_space
    assert not other.training


def test_kwargs_and_infinite_bounds_survive(tmp_path):
    env = StubEnv()
    space = type(env.observation_space)(-np.inf, np.inf, env.observation_space.shape, np.float32)
    kwargs = {"width": 8, "pooled": True, "normalization": "min_max", "clip_sd": 4.0, "log_std_init": -1.5}
    policy = MultiHeadPolicy(space, env.action_space, contract=env.contract, **kwargs)
    policy.save(tmp_path / "p.zip")
    other = trainers.load(tmp_path / "p.zip")
    assert other.network_kwargs() == policy.network_kwargs()
    assert other.observation_space == space


def test_equal_policies_are_equal_files(saved, tmp_path, monkeypatch):
    monkeypatch.setattr("time.time", lambda: 2_000_000_000.0)
    trainers.load(saved[1]).save(tmp_path / "again.zip")
    assert (tmp_path / "again.zip").read_bytes() == saved[1].read_bytes()


def test_file_is_json_and_safetensors(saved):
    with zipfile.ZipFile(saved[1]) as archive:
        assert sorted(archive.namelist()) == ["policy.json", "weights.safetensors"]
        description = json.loads(archive.read("policy.json"))
    assert description["versions"]["torch"] and description["policy"]["network"]["width"] == 32
    assert description["policy"]["contract"]["terms"][0]["unit"] == "m/s^2"


def test_failed_save_leaves_the_old_file(saved, monkeypatch):
    policy, path = saved
    before = path.read_bytes()
    monkeypatch.setattr("safetensors.torch.save", lambda weights: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        policy.save(path)
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == ["policy.zip"]


def test_degrees_of_physics_params_travel_with_the_policy(tmp_path):
    kwargs = {"friction": 0.5, "payload_kg": 1.0, "action_delay_s": 0.01, "estimator_noise": True, "tasks": ("trot",)}
    env = trainers.make_env("trot", **kwargs)
    contract = env.unwrapped.contract
    policy = MultiHeadPolicy(env.observation_space, env.action_space, contract=contract, width=8, env_kwargs=kwargs)
    policy.save(tmp_path / "p.zip")
    again = trainers.load(tmp_path / "p.zip")
    assert kwargs.items() <= again.env_kwargs.items() and again.contract == contract
    twin = trainers.make_env("trot", **again.env_kwargs)
    env.reset(seed=0), twin.reset(seed=0)
    for _ in range(3):
        action = env.expert_action()
        np.testing.assert_array_equal(action, twin.expert_action())
        np.testing.assert_array_equal(env.step(action)[0], twin.step(action)[0])


def test_what_cannot_be_saved_is_refused_when_the_policy_is_made():
    env = StubEnv()
    with pytest.raises(InvalidInputError, match="expert.* must be something that JSON can hold"):
        MultiHeadPolicy(env.observation_space, env.action_space, contract=env.contract, env_kwargs={"expert": object()})


def test_numpys_numbers_and_the_environments_dataclasses_can_be_saved(tmp_path):
    env, kwargs = StubEnv(), {"episode_s": np.float32(2.5), "noise": SensorNoise(q=0.01)}
    policy = MultiHeadPolicy(env.observation_space, env.action_space, contract=env.contract, width=8, env_kwargs=kwargs)
    policy.save(tmp_path / "p.zip")
    again = trainers.load(tmp_path / "p.zip").extra_env_kwargs
    assert again == {"episode_s": 2.5, "noise": dataclasses.asdict(SensorNoise(q=0.01))}


def test_missing_truncated_and_foreign_files(saved, tmp_path):
    _, path = saved
    whole = path.read_bytes()
    (tmp_path / "half.zip").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.zip").write_text("not a zip")
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 0xFF
    (tmp_path / "flipped.zip").write_bytes(flipped)
    with zipfile.ZipFile(tmp_path / "foreign.zip", "w") as archive:
        archive.writestr("data", "{}")
    for name in ("absent.zip", "half.zip", "text.zip", "flipped.zip", "foreign.zip"):
        with pytest.raises(trainers.CheckpointError, match=name) as caught:
            trainers.load(tmp_path / name)
        assert isinstance(caught.value, Go1Error)


@pytest.mark.parametrize(
    "change",
    [{"format": "x"}, {"format_version": 99}, {"kind": "x"}, {"network": {"width": 31}}, {"network": {"rm": 1}}],
)
def test_inconsistent_description(saved, tmp_path, change):
    with zipfile.ZipFile(saved[1]) as archive:
        description = json.loads(archive.read("policy.json"))
        weights = archive.read("weights.safetensors")
    for name, value in change.items():
        place = description["policy"] if isinstance(value, dict) else description
        place[name] = {**place[name], **value} if isinstance(value, dict) else value
    with zipfile.ZipFile(tmp_path / "p.zip", "w") as archive:
        archive.writestr("policy.json", json.dumps(description))
        archive.writestr("weights.safetensors", weights)
    with pytest.raises(trainers.CheckpointError):
        trainers.load(tmp_path / "p.zip")


@pytest.mark.parametrize("load", [trainers.load, PhaseFreePolicy.load])
def test_phase_free_round_trip_is_exact(phase_free, load):
    policy, path = phase_free
    other = load(path)
    assert isinstance(other, PhaseFreePolicy) and not other.training and not other.student.training
    assert other.state_dict().keys() == policy.state_dict().keys()
    assert all(torch.equal(a, b) for a, b in zip(other.state_dict().values(), policy.state_dict().values()))
    assert (other.correction, other.env_kwargs) == (policy.correction, policy.env_kwargs)
    assert other.observation_space == policy.observation_space and other.action_space == policy.action_space
    state = other_state = None
    for seed in range(3):
        obs = rows([0, 3, 1, 2], seed=seed)
        acts, state = policy.predict(obs, state, deterministic=True)
        other_acts, other_state = other.predict(obs, other_state, deterministic=True)
        np.testing.assert_array_equal(other_acts, acts)
        np.testing.assert_array_equal(other_state[0], state[0])


def test_a_phase_free_file_is_json_and_safetensors_and_saves_to_the_same_bytes(phase_free, tmp_path):
    with zipfile.ZipFile(phase_free[1]) as archive:
        assert sorted(archive.namelist()) == ["phase.safetensors", "policy.json", "weights.safetensors"]
        first = {name: archive.read(name) for name in archive.namelist()}
    assert json.loads(first["policy.json"])["policy"]["phase"] == {"history": 3, "width": 16, "correction": 0.3}
    trainers.load(phase_free[1]).save(tmp_path / "again.zip")
    with zipfile.ZipFile(tmp_path / "again.zip") as archive:
        assert first == {name: archive.read(name) for name in archive.namelist()}


@pytest.mark.parametrize("device", ["auto", "cuda:99", 3.5, None])
def test_a_device_that_is_none_is_refused(saved, device):
    with pytest.raises(InvalidInputError, match="device must be one that torch has"):
        trainers.load(saved[1], device)


@pytest.mark.parametrize("path", [b"policy.zip", None, 3])
def test_a_path_that_is_none_is_refused(path):
    with pytest.raises(InvalidInputError, match="path must be"):
        trainers.load(path)


def test_a_file_of_the_other_kind_says_what_it_holds(phase_free, saved):
    with pytest.raises(trainers.CheckpointError, match="holds a phase_free policy, a multi_head one was expected"):
        MultiHeadPolicy.load(phase_free[1])
    with pytest.raises(trainers.CheckpointError, match="holds a multi_head policy, a phase_free one was expected"):
        PhaseFreePolicy.load(saved[1])


@pytest.mark.parametrize("name", ["phase.safetensors", "weights.safetensors"])
def test_missing_and_damaged_weights(phase_free, name):
    path = phase_free[1]
    with zipfile.ZipFile(path) as archive:
        whole = archive.read(name)
    rewrite(path, {name: whole[: len(whole) // 2]})
    with pytest.raises(trainers.CheckpointError, match="is damaged"):
        trainers.load(path)
    rewrite(path, {name: None})
    with pytest.raises(trainers.CheckpointError, match=f"is damaged: .*{name}"):
        trainers.load(path)


@pytest.mark.parametrize(
    "change", [{"width": 15}, {"history": 2}, {"history": 0}, {"correction": 2.0}, {"width": None}]
)
def test_inconsistent_description_of_a_phase_free_policy(phase_free, change):
    rewrite(phase_free[1], {}, change)
    with pytest.raises(trainers.CheckpointError, match="does not hold a consistent policy"):
        trainers.load(phase_free[1])
