"""What Python writes for the page in the browser is what the code says."""

import json
from pathlib import Path

import numpy as np
import pytest

import trainers
from go1_mtl_gym import TASKS, Go1Env, InvalidInputError, robot
from go1_mtl_gym.episode import COMMAND_SLEW
from web.export import CONSTANTS, export, read_policies
from web.footfalls import _footfalls


@pytest.fixture(scope="module")
def policies():
    return read_policies("clocked", "phase_free")


@pytest.fixture(scope="module")
def folder(policies, tmp_path_factory):
    out = tmp_path_factory.mktemp("page")
    export(policies, out, footfalls=False)
    return out


@pytest.fixture(scope="module")
def constants(folder):
    return json.loads((folder / CONSTANTS).read_text())


def read(folder, weights):
    """The tensors of a file, as the page reads them."""
    flat = np.fromfile(folder / weights["file"], "<f4")
    assert flat.nbytes == weights["bytes"]
    tensors, start = {}, 0
    for entry in weights["tensors"]:
        size = int(np.prod(entry["shape"]))
        tensors[entry["name"]] = flat[start : start + size].reshape(entry["shape"])
        start += size
    assert start == flat.size
    return tensors


def elu(x):
    return np.where(x > 0, x, np.expm1(np.minimum(x, 0)))


def test_the_weights_act_as_the_policy_does(policies, folder, constants):
    policy, exported = policies[0], constants["policies"]["multi_head"]
    env = policy.make_env("walk")
    obs, _ = env.reset(seed=0, options={"command": (0.3, 0.1, 0.2)})
    shared, head = read(folder, exported["shared"]), read(folder, exported["heads"]["walk"])
    for _ in range(5):
        action = policy.predict(obs, deterministic=True)[0]
        x = (obs[: -len(policy.tasks)] - shared["obs.shift"]) / shared["obs.scale"]
        x = np.clip(x, -exported["clip_sd"], exported["clip_sd"])
        for index in (0, 2):
            x = elu(shared[f"trunk.{index}.weight"] @ x + shared[f"trunk.{index}.bias"])
        x = elu(head["0.weight"] @ x + head["0.bias"])
        y = shared["act.shift"] + shared["act.scale"] * (head["2.weight"] @ x + head["2.bias"])
        np.testing.assert_allclose(np.clip(y, -1, 1), action, atol=1e-5)
        obs = env.step(action)[0]


def test_every_head_is_a_file_and_equal_networks_are_one(folder, constants):
    clocked, free = constants["policies"]["multi_head"], constants["policies"]["phase_free"]
    files = {head["file"] for head in clocked["heads"].values()}
    assert len(files) == len(clocked["contract"]["tasks"])
    assert free["student"]["contract"] == clocked["contract"]
    named = {clocked["shared"]["file"], *files, free["student"]["shared"]["file"], free["estimator"]["weights"]["file"]}
    named |= {head["file"] for head in free["student"]["heads"].values()}
    assert named == {path.relative_to(folder).as_posix() for path in folder.glob("weights/*")}


def test_the_constants_are_the_environments(policies, constants):
    env = Go1Env(**policies[0].env_kwargs)
    assert constants["control_hz"] == env.control_hz
    assert constants["actuators"]["action_scale"] == env.action_map.half_range.tolist()
    assert constants["command_filter"]["slew"] == list(COMMAND_SLEW)
    assert constants["robot"]["home_pose"] == robot.HOME_POSE.tolist()
    for name, task in constants["tasks"].items():
        assert task["gait"]["offsets"] == list(TASKS[name].gait.offsets)
        assert task["gait"]["change_phase"] == TASKS[name].gait.change_phase
        assert task["gait"]["can_stand"] == TASKS[name].gait.can_stand
        assert task["command_range"] == list(TASKS[name].command_range)
        assert task["push_limit"] == list(TASKS[name].push_limit)
    low = constants["policies"]["multi_head"]["low"]
    np.testing.assert_array_equal(np.float32(low), env.layout.low)


def test_the_robots_files_are_unmodified(folder):
    for path in (robot.MODEL_PATH, robot.SCENE_PATH):
        name = path.rpartition("/")[2]
        assert (folder / "model" / name).read_bytes() == Path(path).read_bytes()


def test_what_stood_there_before_goes(policies, tmp_path):
    (tmp_path / "weights").mkdir()
    (tmp_path / "weights" / "old.bin").write_bytes(b"old")
    export(policies[:1], tmp_path, footfalls=False)
    assert not (tmp_path / "weights" / "old.bin").exists()
    assert "phase_free" not in json.loads((tmp_path / CONSTANTS).read_text())["policies"]


def test_policies_that_the_page_cannot_drive_are_refused(policies, tmp_path):
    env = Go1Env(channels=("command", "phase"), history=1)
    blind = trainers.MultiHeadPolicy(env.observation_space, env.action_space, contract=env.contract, width=8, seed=0)
    with pytest.raises(InvalidInputError, match="channels"):
        export([blind], tmp_path)
    with pytest.raises(InvalidInputError, match="first policy"):
        export(policies[1:], tmp_path)
    with pytest.raises(InvalidInputError, match="one without was expected"):
        export([policies[0], policies[0]], tmp_path)
    assert not any(tmp_path.iterdir()), "nothing is overwritten"


def test_the_experts_footfalls_are_its_gaits(policies):
    falls = np.array(_footfalls("pace", policies[0].contract))
    assert falls.shape == (16, 4)
    np.testing.assert_array_equal(falls[:, 0], falls[:, 2])  # left legs together, right legs together
    np.testing.assert_array_equal(falls[:, 1], falls[:, 3])
    assert np.abs(falls.mean(axis=0) - TASKS["pace"].gait.duty).max() < 0.15
