"""Names of the version before: they give the same things, and say what to write instead."""

import importlib

import pytest

import go1_mtl_gym
from go1_mtl_gym import DomainRandomization, Go1Env, PerturbationWrapper
from go1_mtl_gym._moved import MOVED
from go1_mtl_gym.env_config import EXPERT_ONLY

OLD = [
    ("realism", "Realism", go1_mtl_gym.PhysicsParams),
    ("observation", "SensorNoise", go1_mtl_gym.SensorNoise),
    ("state", "RobotState", go1_mtl_gym.RobotState),
    ("estimator", "EstimatorNoise", go1_mtl_gym.EstimatorNoise),
    ("perturbation", "PerturbationWrapper", PerturbationWrapper),
    ("randomization", "DomainRandomization", DomainRandomization),
    ("conditions", "EXPERTS_ALONE", EXPERT_ONLY),
]


@pytest.mark.parametrize(("module", "name", "thing"), OLD)
def test_old_modules_lead_to_the_new_ones(module, name, thing):
    old = importlib.import_module(f"go1_mtl_gym.{module}")
    with pytest.warns(DeprecationWarning, match=rf"go1_mtl_gym.{module}.{name} is an old name; write go1_mtl_gym\."):
        assert getattr(old, name) == thing
    with pytest.raises(AttributeError):
        _ = old.nothing


def test_every_old_module_has_a_new_one_and_no_other_name_is_found():
    for module in MOVED.values():
        importlib.import_module(f"go1_mtl_gym.{module}")
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("go1_mtl_gym.relativity")


def test_old_arguments_and_attributes():
    with pytest.warns(DeprecationWarning, match=r"DomainRandomization\(share=\) is an old name; write fraction"):
        randomization = DomainRandomization(share=0.3)
    assert randomization == DomainRandomization(fraction=0.3)
    with pytest.warns(DeprecationWarning, match="DomainRandomization.share is an old name; write fraction"):
        assert randomization.share == 0.3
    env = Go1Env("trot", friction=0.5)
    with pytest.warns(DeprecationWarning, match=r"Go1Env.realism is an old name; write physics_params"):
        assert env.realism == env.physics_params
    with pytest.warns(DeprecationWarning, match=r"PerturbationWrapper\(kick=\) is an old name; write push"):
        old = PerturbationWrapper(env, kick=0.7)
    assert vars(old)["_push_speed"] == 0.7
