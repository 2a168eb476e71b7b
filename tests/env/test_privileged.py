"""The privileged expert: told what is different and what is still on its way, while nothing else is changed by it."""

import copy
import dataclasses

import numpy as np
import pytest

from go1_mtl_gym import DomainRandomization, EnvConfig, Go1Env, InvalidInputError, PhysicsParams, RobotState, robot
from go1_mtl_gym.env_config import EXPERT_ONLY

DIFFERENT = PhysicsParams(
    friction=0.45,
    payload_kg=2.0,
    action_delay_s=0.012,
    motor_strength=0.9,
    joint_friction=0.7,
    contact_time_s=0.1,
    joint_damping=0.6,
)
TOLD = ("payload_kg", "motor_strength", "friction", "joint_friction", "joint_damping", "foot_sink")
MOVING = tuple(each.name for each in dataclasses.fields(RobotState) if each.name not in (*TOLD, "contacts", "time_s"))


def walking(steps: int = 25, **kwargs) -> Go1Env:
    """An environment in the middle of an episode under gentle random actions, commands and a change of task."""
    env = Go1Env(None, **kwargs)
    env.reset(seed=2, options={"task": "jump", "command": (0.3, -0.1, 0.2)})
    for step, action in enumerate(np.random.default_rng(0).uniform(-0.05, 0.05, (steps, 12))):
        env.step(action)
        if step == steps - 5:
            env.set_task("trot"), env.set_command((0.0, 0.2, 0.0))  # a jump is left in the middle of its stance
    return env


def same(one: RobotState, other: RobotState, names: tuple[str, ...] = MOVING) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


# -- What is told ------------------------------------------------------------------------------------------------------


def test_the_differences_are_told_and_those_of_the_model_are_none():
    told = walking(privileged=True, physics=DIFFERENT).estimated_state
    assert (told.payload_kg, told.motor_strength, told.friction) == (2.0, 0.9, 0.45)
    assert told.joint_friction == pytest.approx(0.7 - 0.2) and told.joint_damping == pytest.approx(0.6 - 0.1)
    for state in (walking(physics=DIFFERENT).estimated_state, walking(privileged=True).estimated_state):
        assert [getattr(state, name) for name in TOLD] == [0.0, 1.0, None, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("payload_kg", [0.0, 3.0])
def test_feet_sink_as_deep_as_is_told(payload_kg):
    env = Go1Env(privileged=True, contact_time_s=0.1, payload_kg=payload_kg, settle_s=2.0)
    env.reset(seed=0)
    depth = robot.FOOT_RADIUS - env.simulation.feet_w[:, 2].mean()
    assert env.estimated_state.foot_sink == pytest.approx(depth, rel=0.1) and depth > 0.007
    assert Go1Env(contact_time_s=0.005).simulation.foot_sink == 0.0


def test_what_a_randomization_draws_is_told():
    env = Go1Env(privileged=True, randomization=DomainRandomization(action_delay_s=None))
    told = set()
    for seed in range(3):
        env.reset(seed=seed)
        assert env.estimated_state.payload_kg == env.physics_params.payload_kg
        assert env.estimated_state.friction == env.physics_params.friction
        assert env.estimated_state.joint_damping == pytest.approx(env.physics_params.joint_damping - 0.1)
        told.add(env.estimated_state.payload_kg)
    assert len(told) == 3


@pytest.mark.parametrize("task", ["trot", "jump"])
def test_where_nothing_is_different_the_expert_answers_as_ever_to_the_bit(task):
    env, plain = Go1Env(task, privileged=True), Go1Env(task)
    env.reset(seed=0), plain.reset(seed=0)
    for _ in range(20):
        action = plain.expert_action()
        np.testing.assert_array_equal(env.expert_action(), action)
        env.step(action), plain.step(action)


# -- What is foreseen --------------------------------------------------------------------------------------------------


def test_the_state_of_a_delay_of_one_period_is_that_after_the_next_step_whatever_is_done():
    env = walking(0, privileged=True, payload_kg=1.0, action_delay_s=0.02)
    rng = np.random.default_rng(0)
    for step in range(40):
        if step == 12:
            env.set_task("trot")  # out of the jump's stance, a little later
        if step == 30:
            env.set_command((0.0, 0.0, 0.0))
        foreseen = env.estimated_state
        assert not np.array_equal(foreseen.q, env.state.q)
        env.step(rng.uniform(-0.05, 0.05, 12))
        assert same(foreseen, env.state) and foreseen.time_s == pytest.approx(env.state.time_s)
    assert env.task.name == "trot"


@pytest.mark.parametrize(("delay_ms", "control_hz"), [(7, 50), (33, 50), (40, 50), (5, 500)])
def test_a_delay_of_any_length_is_foreseen(delay_ms, control_hz):
    env = walking(privileged=True, control_hz=control_hz, action_delay_s=delay_ms / 1000)
    foreseen, period = env.estimated_state, 1000 // control_hz
    whole, rest = divmod(delay_ms, period)
    before = env.state
    for _ in range(whole):
        env.step(np.zeros(12))
        before = env.state
    assert foreseen.time_s == pytest.approx(before.time_s + rest / 1000)
    assert foreseen.phase == pytest.approx(before.phase + rest / 1000 / before.gait.period, abs=1e-12)
    env.simulation.step(robot.HOME_POSE, rest) if rest else None
    np.testing.assert_allclose(foreseen.q, env.simulation.q, atol=1e-8)
    np.testing.assert_allclose(foreseen.position_w, env.simulation.data.qpos[:3], atol=1e-8)
    np.testing.assert_array_equal(foreseen.contacts, env.simulation.contacts)


def test_an_estimators_errors_are_made_about_the_foreseen_state():
    env = walking(privileged=True, action_delay_s=0.02, estimator_noise={"height": 0.0, "height_bias": 0.5})
    exact = walking(privileged=True, action_delay_s=0.02)
    height = env.estimated_state.position_w[2] - exact.estimated_state.position_w[2]
    assert abs(height) > 0.01 and env.estimated_state.phase == exact.estimated_state.phase


# -- What stays as it is -----------------------------------------------------------------------------------------------


def test_asking_changes_nothing_to_the_bit():
    asked, never = (walking(privileged=True, noise=True, physics=DIFFERENT) for _ in range(2))
    for action in np.random.default_rng(1).uniform(-0.05, 0.05, (20, 12)):
        before = copy.deepcopy(asked._episode), asked.simulation.snapshot()
        derived = [np.array(getattr(asked.simulation.data, name)) for name in ("sensordata", "geom_xpos", "qacc")]
        np.testing.assert_array_equal(asked.expert_action(), asked.expert_action())
        np.testing.assert_array_equal(before[1], asked.simulation.snapshot())
        for name, value in zip(("sensordata", "geom_xpos", "qacc"), derived):
            np.testing.assert_array_equal(value, getattr(asked.simulation.data, name))
        assert (before[0].phase, before[0].steps, before[0].task) == (
            asked._episode.phase,
            asked._episode.steps,
            asked._episode.task,
        )
        np.testing.assert_array_equal(before[0].filtered_command, asked._episode.filtered_command)
        (a, *_, info), (b, *_, expected) = asked.step(action), never.step(action)
        np.testing.assert_array_equal(a, b)
        assert info["phase"] == expected["phase"]


def test_observations_and_the_true_state_are_those_of_any_environment():
    env, plain = (walking(privileged=privileged, physics=DIFFERENT) for privileged in (True, False))
    np.testing.assert_array_equal(env.step(np.zeros(12))[0], plain.step(np.zeros(12))[0])
    assert same(env.state, plain.state, (*MOVING, *TOLD))


def test_a_copys_privileged_expert_gives_the_same_labels():
    env = walking(privileged=True, physics=DIFFERENT)
    twin = copy.deepcopy(env)
    for _ in range(5):
        action = env.expert_action()
        np.testing.assert_array_equal(action, twin.expert_action())
        env.step(action), twin.step(action)


# -- As an argument ----------------------------------------------------------------------------------------------------


def test_it_is_part_of_a_configuration_and_only_the_expert_notices():
    config = EnvConfig(privileged=np.bool_(True))
    assert config.privileged is True and EnvConfig.from_dict(config.as_dict()) == config
    assert EnvConfig().privileged is False and "privileged" in EXPERT_ONLY


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"privileged": 1}, "privileged must be True or False, got 1"),
        ({"privileged": True, "state_estimator": True}, "privileged expert is told what a state_estimator has to"),
    ],
)
def test_what_cannot_be_is_refused(arguments, words):
    with pytest.raises(InvalidInputError, match=words):
        Go1Env(**arguments)
