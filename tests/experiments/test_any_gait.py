"""Studies of the space of gaits."""

import dataclasses

import numpy as np
import pytest

import trainers
from experiments.agents import PolicyFile
from experiments.any_gait import expert_map, student
from experiments.any_gait.episodes import MovedSliders, episode, held_out_gaits
from experiments.results import Results
from go1_mtl_gym import NAMED_GAITS, GaitSpace, InvalidInputError
from go1_mtl_gym.tasks import ANY_GAIT


def results(study, records):
    return Results(study, "", 1, {}, {}, None, {}, tuple(records))


def test_held_out_gaits_depend_on_their_number_alone():
    gaits = dict(held_out_gaits(GaitSpace(), 0, 6, 1))
    assert dict(held_out_gaits(GaitSpace(), 4, 2, 1)) == {number: gaits[number] for number in (4, 5)}
    assert len(set(gaits.values())) == 6 and dict(held_out_gaits(GaitSpace(), 0, 1, 2))[0] != gaits[0]


def test_sliders_move_all_the_time_and_alike_for_everybody():
    seen = []

    def watch(env, step, sliders):
        sliders(env, step)
        seen.append(env.unwrapped.task.gait.numbers)

    for _ in range(2):
        sliders = MovedSliders(GaitSpace(), 4)
        done = episode("expert", None, 3.0, "sliders", 1, watch=lambda env, step, s=sliders: watch(env, step, s))
        assert not done.fallen
    first, second = np.array(seen[: len(seen) // 2]), np.array(seen[len(seen) // 2 :])
    np.testing.assert_array_equal(first, second)
    assert len(np.unique(first.round(6), axis=0)) > 50


def of_gait(condition, number, gait, **values):
    head = {"agent": "expert", "task": ANY_GAIT, "condition": condition, "seed": 1, "number": number, "trials": 1}
    scores = {"survived": 1, "succeeded": 1, "velocity_error": 0.05}
    return head | scores | {"gait": gait.numbers.tolist()} | values


def test_the_map_tells_where_the_expert_ends():
    slow = dataclasses.replace(NAMED_GAITS["trot"], period=0.6)
    records = [
        of_gait(expert_map.INSIDE, 0, NAMED_GAITS["trot"]),
        of_gait(expert_map.INSIDE, 1, NAMED_GAITS["trot"], succeeded=0, velocity_error=0.25),
        of_gait(expert_map.INSIDE, 2, slow, survived=0, succeeded=0, velocity_error=None),
    ]
    study = expert_map.ExpertMap(expert_map.ExpertMap.full)
    text = study.table(results("any_gait_expert", records))
    assert "| declared space | all | 2/3 | 1/3 | 0.150 |" in text
    assert "| declared space | period 0.5 to 0.65 s | 0/1 | 0/1 | - |" in text
    assert study.figure(results("any_gait_expert", records)) is not None
    assert expert_map.AROUND not in text


def test_the_expert_is_measured_gait_by_gait():
    study = expert_map.ExpertMap(expert_map.ExpertMap.quick)
    agent = study.agents()[0]
    cells = study.cells(agent)
    assert [cell.condition for cell in cells] == ["declared space, from 0 on", "around it, from 0 on"]
    found = study.measure(agent, cells[0], 1)
    assert [each["number"] for each in found] == [0, 1] and {each["condition"] for each in found} == {expert_map.INSIDE}
    assert all(GaitSpace().contains(gait) for _, gait in held_out_gaits(GaitSpace(), 0, 2, 1))


def test_a_student_is_held_against_the_experts_successes():
    trot = NAMED_GAITS["trot"]
    expert = [of_gait(student.RANDOM, i, trot, succeeded=int(i < 3)) for i in range(4)]
    mine = [of_gait(student.RANDOM, i, trot, agent="any gait", succeeded=int(i in (0, 1, 3))) for i in range(4)]
    canter = [of_gait("transverse_gallop", 0, trot, agent="any gait")]
    study = student.Student(student.Student.full)
    text = study.table(results("any_gait_student", [*canter, *mine, *expert]))
    lines = text.splitlines()[2:]
    assert lines[0].startswith("| random gaits | any gait | 4/4 | 3/4 | 2/3 | 0.135 |")
    assert "| random gaits | expert | 4/4 | 3/4 | - | - |" in text
    assert lines[-1].startswith("| transverse gallop | any gait | 1/1 | 1/1 | - |")


@pytest.fixture(scope="module")
def untrained(tmp_path_factory):
    env = trainers.make_env(ANY_GAIT)
    policy = trainers.MultiHeadPolicy(
        env.observation_space, env.action_space, contract=env.unwrapped.contract, width=8, seed=0
    )
    policy.save(path := tmp_path_factory.mktemp("policy") / "any.zip")
    return PolicyFile("any gait", path=path)


@pytest.mark.parametrize("name", [student.RANDOM, "canter", student.CHANGING, student.SLIDERS])
def test_every_condition_is_measured_of_policies_and_the_expert(untrained, name):
    study = student.Student(student.Student.quick, (untrained,))
    policy, expert = study.agents()
    cell = next(cell for cell in study.cells(policy) if cell.condition.startswith(name))
    mine, theirs = (study.measure(agent, cell, 1) for agent in (policy, expert))
    assert len(mine) == len(theirs) == {student.RANDOM: 2}.get(name, 1)
    assert {each["condition"] for each in mine} == {name} and mine[0]["gait"] == theirs[0]["gait"]
    assert theirs[0]["survived"] == 1
    if name == "canter":
        assert mine[0]["gait"][0] == NAMED_GAITS["canter"].period


def test_policies_for_something_else_are_refused(tmp_path):
    env = trainers.make_env("trot")
    policy = trainers.MultiHeadPolicy(
        env.observation_space, env.action_space, contract=env.unwrapped.contract, width=8, seed=0
    )
    policy.save(tmp_path / "trot.zip")
    study = student.Student(student.Student.quick, (PolicyFile("trot", path=tmp_path / "trot.zip"),))
    with pytest.raises(InvalidInputError, match="a policy for 'any_gait' was expected, trot is for"):
        study.agents()
    with pytest.raises(InvalidInputError, match="a policy for any gait was expected: --policy FILE"):
        student.Student(student.Student.quick).agents()
