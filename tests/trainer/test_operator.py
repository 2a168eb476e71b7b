"""Settings of hands, and an environment in them."""

import dataclasses

import numpy as np
import pytest

import trainers
from go1_mtl_gym import TASKS, InvalidInputError
from trainers.data.operator import MOVES, OperatorConfig
from trainers.data.operator_wrapper import OperatorWrapper


def opened(task="trot", config=None, **env_kwargs):
    return OperatorWrapper(trainers.make_env(task, **env_kwargs), config or OperatorConfig())


def test_hands_can_be_left_few_moves():
    config = OperatorConfig(release=2.0, deflection=0.5).of_moves("release", "jerk")
    assert config.weights.tolist() == [0, 0, 0, 0, 0, 0, 0, 1.0, 2.0, 0] and config.deflection == 0.5
    for wrong, message in ((("hop",), "move"), ((), "at least one move")):
        with pytest.raises(InvalidInputError, match=message):
            config.of_moves(*wrong)


# -- Settings ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"hold": -1.0}, "weight of the move 'hold'"),
        (dict.fromkeys(MOVES, 0.0), "at least one move"),
        ({"starts_released": 1.5}, "starts_released"),
        ({"deflection": -0.1}, "deflection"),
        ({"move_s": (2.0, 1.0)}, "move_s"),
        ({"stand_s": None}, "stand_s must be intervals"),
        ({"push_interval": 0.0}, "push_interval"),
        ({"hard_push": -0.5}, "hard_push"),
        ({"hard_push_interval": "often"}, "hard_push_interval"),
        ({"task_interval": (0.0, 1.0)}, "task_interval"),
    ],
)
def test_impossible_settings_are_refused(settings, message):
    with pytest.raises(InvalidInputError, match=message):
        OperatorConfig(**settings)


# -- An environment in somebody's hands --------------------------------------------------------------------------------


def test_the_command_is_the_stick_times_the_range_of_the_task_asked_for():
    config = OperatorConfig(task_interval=(0.3, 0.6), push_interval=None)
    env = opened(config=config, episode_s=6.0)
    env.reset(seed=4)
    seen = set()
    for i in range(1, 250):
        _, _, terminated, truncated, info = env.step(env.unwrapped.expert_action())
        assert not terminated and not truncated
        task = env.unwrapped.requested_task
        seen.add(task.name)
        assert info["command"] == pytest.approx(env.plan.stick(i / 50) * np.array(task.command_range), abs=1e-12)
        assert info["operator_move"] == env.plan.move(i / 50)
    assert len(seen) > 3
    env.close()


def test_events_are_told_with_the_step_they_come_with():
    config = OperatorConfig(task_interval=(0.5, 1.0), push_interval=0.5, push=0.05)
    env = opened(config=config, episode_s=5.0)
    env.reset(seed=1)
    told = [event for _ in range(200) for event in env.step(env.unwrapped.expert_action())[4]["operator_events"]]
    plan_ = env.plan
    assert sorted(told) == sorted([*plan_.changes_in(0.0, 4.0), *["push"] * len(plan_.pushes_in(0.0, 4.0))])
    env.close()


def test_all_policies_meet_the_same_hands():
    plans = []
    for action in (0.0, 0.3):
        env = opened("walk", episode_s=3.0)
        env.reset(seed=9)
        for _ in range(20):
            env.step(np.full(12, action))
        plans.append(env.plan)
        env.close()
    assert plans[0] == plans[1] and plans[0].task == "walk"


def test_deflection_makes_the_range_smaller():
    env = opened(config=OperatorConfig(deflection=0.5, starts_released=0.0), episode_s=2.0)
    _, info = env.reset(seed=2)
    expected = 0.5 * env.plan.stick(0.0) * np.array(TASKS["trot"].command_range)
    assert info["command"] == pytest.approx(expected) and info["command"].any()
    env.close()


def test_a_command_beside_an_operator_is_refused():
    env = opened()
    with pytest.raises(InvalidInputError, match="the operator gives the commands"):
        env.reset(options={"command": (0.1, 0.0, 0.0)})
    env.close()
    perturbation = trainers.PerturbationConfig(operator=OperatorConfig())
    with pytest.raises(InvalidInputError, match="an operator gives the commands"):
        trainers.CollectJob("trot", 0, command=(0.1, 0, 0), perturbation=perturbation)
    with pytest.raises(InvalidInputError, match="an operator gives the commands"):
        trainers.evaluate("expert", "trot", 1, 1.0, operator=OperatorConfig(), corners=True)
    with pytest.raises(InvalidInputError, match="operator must be an OperatorConfig"):
        trainers.PerturbationConfig(operator={"hold": 1.0})


def test_collection_and_evaluation_are_in_the_operators_hands():
    config = OperatorConfig(task_interval=(0.4, 0.8))
    rows = trainers.collect("trot", seed=2, seconds=4.0, perturbation=trainers.PerturbationConfig(operator=config))
    assert len(rows.per_task()) > 2
    result = trainers.evaluate("expert", "trot", 1, 4.0, operator=config)
    assert result.survival_rate == 1.0
    one = trainers.collect(
        "trot", seed=2, seconds=2.0, perturbation=trainers.PerturbationConfig(operator=config.of_one_gait())
    )
    assert set(one.per_task()) == {"trot"}
    assert dataclasses.asdict(config)["task_interval"] == (0.4, 0.8)
