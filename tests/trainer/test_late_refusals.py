"""What cannot be written down or is overridden is refused before any work; what only looks odd is brought into form."""

import functools

import numpy as np
import pytest

import trainers
from experts import NMPCConfig, NMPCExpert
from go1_mtl_gym import InvalidInputError, SensorNoise
from tests.trainer.stub_env import make_stub
from trainers import CollectJob, collect, evaluate, evaluate_transition, make_env, record_frames
from trainers.utils.files import json_form


def test_numpys_numbers_are_taken(tmp_path):
    rows = collect("trot", np.array([0.1, 0, 0]), np.int64(3), np.float32(0.5), make_env=make_stub)
    rows.save(tmp_path / "rows.npz")
    assert rows.meta["job"]["seed"] == 3 and rows.meta["job"]["command"] == [0.1, 0.0, 0.0] and len(rows) == 25


def test_an_expert_with_settings_of_its_own_can_be_told_to_a_shard(tmp_path):
    expert = functools.partial(NMPCExpert, config=NMPCConfig(com_height=0.27))
    rows = collect("trot", seconds=0.1, env_kwargs={"expert": expert, "noise": SensorNoise(q=0.01)})
    rows.save(tmp_path / "rows.npz")
    job = trainers.Demonstrations.load(tmp_path / "rows.npz").meta["job"]
    named = job["env_kwargs"]["expert"]
    assert named["partial"] == "experts.nmpc:NMPCExpert" and named["keywords"]["config"]["com_height"] == 0.27
    assert job["env_kwargs"]["noise"]["q"] == 0.01


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": -1}, "seed"),
        ({"seed": 1.5}, "seed"),
        ({"seconds": 0}, "seconds must be a finite number > 0"),
        ({"seconds": np.inf}, "seconds"),
        ({"seconds": True}, "seconds"),
        ({"seconds": "3"}, "seconds"),
        ({"command": (1, 2)}, "command"),
        ({"perturbation": True}, "perturbation must be"),
        ({"env_kwargs": {"expert": lambda **_: None}}, r"env_kwargs\['expert'\] must be"),
    ],
)
def test_a_job_that_cannot_be_is_refused_when_it_is_described(arguments, message):
    with pytest.raises(InvalidInputError, match=message):
        CollectJob("trot", **{"seed": 0, **arguments})


def test_an_unknown_task_is_refused_by_name():
    for use in (collect, make_env):
        with pytest.raises(InvalidInputError, match="task must be one of 'trot'.*got 'trto'"):
            use("trto")


def test_arguments_that_would_be_overridden_are_refused():
    for use in (
        lambda: evaluate("expert", "trot", episode_s=5.0),
        lambda: evaluate_transition("expert", "trot", "walk", episode_s=5.0),
        lambda: record_frames("expert", "trot", episode_s=5.0),
    ):
        with pytest.raises(InvalidInputError, match="episode_s is set by .* here, got episode_s=5.0"):
            use()


def test_json_form_of_nested_things():
    value = {"a": (np.float32(0.5), None), "b": SensorNoise(), "c": np.arange(2), "d": NMPCExpert}
    form = json_form(value, "value")
    assert form["a"] == [0.5, None] and form["c"] == [0, 1] and form["d"] == "experts.nmpc:NMPCExpert"
    assert form["b"]["gyroscope"] == SensorNoise().gyroscope
    for bad in (np.nan, object(), {"x": float("inf")}):
        with pytest.raises(InvalidInputError, match="value.* must be something that JSON can hold"):
            json_form(bad, "value")
