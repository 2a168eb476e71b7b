"""The policies that come with the package: there, small, without pickles, and able to walk."""

import zipfile

import pytest

import trainers
from go1_mtl_gym import BUILT_IN_TASKS
from go1_mtl_gym.errors import InvalidInputError
from trainers import MultiHeadPolicy, PhaseFreePolicy
from trainers.policies.pretrained import FOLDER, PRETRAINED

LARGEST_BYTES = 12_000_000
"""Of all files together."""
CLASSES = {"clocked": MultiHeadPolicy, "phase_free": PhaseFreePolicy}
EVERY = pytest.mark.parametrize("name", PRETRAINED)


@pytest.mark.parametrize("name", ["other", "../phase_free", "phase_free.zip", None, "phasefree"])
def test_unknown_names_are_refused_with_a_list_of_those_there(name):
    with pytest.raises(InvalidInputError, match="must be one of 'clocked', 'phase_free'; got"):
        trainers.load_pretrained(name)


def test_the_files_are_those_named_and_small():
    files = {path.name: path.stat().st_size for path in FOLDER.iterdir()}
    assert sorted(files) == sorted(f"{name}.zip" for name in PRETRAINED)
    assert sum(files.values()) <= LARGEST_BYTES


@EVERY
def test_the_files_hold_json_and_safetensors_only(name):
    with zipfile.ZipFile(FOLDER / f"{name}.zip") as archive:
        assert {entry.rpartition(".")[2] for entry in archive.namelist()} == {"json", "safetensors"}


@EVERY
def test_they_are_read_ready_to_act(name):
    policy = trainers.load_pretrained(name)
    assert type(policy) is CLASSES[name] and not policy.training
    assert tuple(policy.env_kwargs["tasks"]) == BUILT_IN_TASKS
    assert ("phase" in policy.env_kwargs["channels"]) == (name == "clocked")


def test_the_default_is_the_one_with_a_clock():
    assert type(trainers.load_pretrained()) is MultiHeadPolicy


@EVERY
@pytest.mark.parametrize("task", BUILT_IN_TASKS)
def test_they_walk_in_the_real_environment(name, task):
    result = trainers.evaluate(trainers.load_pretrained(name), task, 1, 4.0, commands=[(0.3, 0.0, 0.0)])
    assert result.survival_rate == 1.0 and result.velocity_error < 0.15, result
