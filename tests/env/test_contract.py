"""What two sides must agree on: made by the environment, kept through files, compared by name."""

import dataclasses
import json

import numpy as np
import pytest

from go1_mtl_gym import TASKS, Go1Env, InvalidInputError, PolicyContract
from go1_mtl_gym.contract import CONTRACT_VERSION, ObservationTerm

PAPER = ("trot", "bound", "jump", "walk")


def contract(**kwargs) -> PolicyContract:
    return Go1Env("trot", **{"tasks": PAPER, "channels": ("command", "phase"), **kwargs}).contract


def test_it_names_what_the_observation_holds_and_where():
    made = contract(history=3)
    assert made.observation_size == 34 + 3 + 2 + 2 * 34 + 4
    assert made.slices["command"] == slice(34, 37) and made.slices["task"] == slice(107, 111)
    assert (made.channels, made.history, made.n_tasks) == (("command", "phase"), 3, 4)


def test_its_arguments_make_an_environment_of_the_same_contract():
    made = contract(history=2, control_hz=100, kp=40.0, kd=1.0)
    assert Go1Env("walk", **made.env_kwargs).contract == made


def test_its_action_map_is_the_environments():
    env = Go1Env("trot")
    action = np.linspace(-1, 1, 12)
    np.testing.assert_allclose(env.contract.to_radians(action), env.action_map.to_radians(action), rtol=0, atol=1e-15)


def test_it_comes_back_from_json():
    made = contract(history=2)
    text = json.dumps(made.as_dict())
    assert PolicyContract.from_dict(json.loads(text)) == made
    assert json.loads(text)["terms"][5] == {
        "name": "command",
        "size": 3,
        "unit": "m/s, m/s, rad/s",
        "start": 34,
        "stop": 37,
    }


@pytest.mark.parametrize(
    ("other", "field"),
    [
        ({"tasks": PAPER[::-1]}, "tasks"),
        ({"channels": ("command", "gravity")}, "terms"),
        ({"history": 2}, "terms"),
        ({"control_hz": 100}, "control_hz"),
        ({"kp": 40.0}, "kp"),
        ({"kd": 1.0}, "kd"),
    ],
)
def test_every_difference_is_refused_by_name(other, field):
    with pytest.raises(
        InvalidInputError, match=f"the policy and the rows do not belong together.*{field}: .* against "
    ):
        contract().check(contract(**other), "the policy", "the rows")


def test_a_difference_may_be_allowed():
    contract().check(contract(tasks=PAPER[::-1]), "a", "b", ignore=("tasks",))


def test_a_gait_of_the_same_name_and_another_period_is_another_gait():
    made = contract()
    slower = dataclasses.replace(TASKS["trot"].gait, period=0.5)
    other = dataclasses.replace(made, gaits=(slower, *made.gaits[1:]))
    assert set(made.differences(other)) == {"gaits"}
    assert set(made.differences(other, ignore=("tasks",))) == {"gaits"}
    assert not made.differences(dataclasses.replace(made, gaits=()))


def test_rounding_on_the_way_through_a_file_is_no_difference():
    made = contract()
    close = dataclasses.replace(made, action_scale=np.array(made.action_scale) + 1e-12)
    assert not made.differences(close)
    assert made.differences(dataclasses.replace(made, action_scale=np.array(made.action_scale) + 1e-6))


@pytest.mark.parametrize(
    "change",
    [
        {"tasks": ()},
        {"tasks": ("trot", "trot")},
        {"gaits": (TASKS["trot"].gait,)},
        {"default_q": (0.0,) * 11},
        {"joints": ("a",)},
    ],
)
def test_sizes_must_agree(change):
    with pytest.raises(InvalidInputError):
        dataclasses.replace(contract(), **change)


@pytest.mark.parametrize(
    "damage",
    [lambda d: d.pop("kp"), lambda d: d.update(terms=[{"name": "q"}]), lambda d: d.update(gaits=[{"name": "x"}])],
)
def test_a_damaged_description_is_refused(damage):
    values = contract().as_dict()
    damage(values)
    with pytest.raises(InvalidInputError, match="not a policy contract"):
        PolicyContract.from_dict(values)


def test_a_later_version_is_refused():
    values = contract().as_dict() | {"version": CONTRACT_VERSION + 1}
    with pytest.raises(InvalidInputError, match="reads up to"):
        PolicyContract.from_dict(values)


def test_other_terms_give_another_size():
    made = contract().with_terms([ObservationTerm("features", 7)])
    assert made.observation_size == 11 and made.slices["features"] == slice(0, 7)
