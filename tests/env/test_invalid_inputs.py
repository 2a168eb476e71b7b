"""Bad input: an error that says what came and what was expected, and an environment that goes on unharmed."""

import numpy as np
import pytest
import torch
from gymnasium.error import ResetNeeded

from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.errors import Go1Error, InvalidInputError

CONSTRUCTION = [
    ({"task": "moonwalk"}, r"task must be one of 'trot', 'bound', 'jump', 'walk', .*; got 'moonwalk'"),
    ({"task": "walk", "tasks": ("trot",)}, r"task must be one of 'trot'; got 'walk'"),
    ({"tasks": "trot"}, r"tasks must be a sequence of task names.*got 'trot'"),
    ({"tasks": ()}, r"tasks must be a sequence.*got \(\)"),
    ({"tasks": ("trot", "moonwalk")}, r"got 'moonwalk'"),
    ({"tasks": ("trot", "trot")}, r"differ.*'trot', 'trot'"),
    ({"channels": ("velocity",)}, r"channel must be one of.*'gait'; got 'velocity'"),
    ({"channels": "command"}, r"channels must be a sequence.*got 'command'"),
    ({"history": 0}, r"history must be an integer from 1 to 50, got 0"),
    ({"history": 1.5}, r"history.*1.5"),
    ({"control_hz": 300}, r"control_hz must be an integer that divides 1000, got 300"),
    ({"control_hz": 10}, r"control_hz must lie in \[50, 1000\], got 10"),
    ({"control_hz": 2000}, r"control_hz.*2000"),
    ({"control_hz": float("nan")}, r"control_hz.*nan"),
    ({"kp": 0.0}, r"kp \[N m/rad\] must lie in \[5, 500\], got 0"),
    ({"kp": "stiff"}, r"kp.*number.*'stiff'"),
    ({"kd": -1.0}, r"kd.*\[0, 20\], got -1"),
    ({"noise": "x"}, r"noise must be None, True, False or a SensorNoise, got 'x'"),
    ({"episode_s": 0.0}, r"episode_s must lie in \[0.02, .*got 0"),
    ({"episode_s": float("inf")}, r"episode_s.*inf"),
    ({"render_mode": "ansi"}, r"render_mode must be one of 'human', 'rgb_array'; got 'ansi'"),
]
WRONG_KIND = [
    ({"control_hz": 62.5}, "control_hz.*62.5"),
    ({"control_hz": "50"}, "control_hz.*'50'"),
    ({"kp": "50"}, "kp.*'50'"),
    ({"tasks": 3}, "tasks.*3"),
    ({"channels": 3}, "channels.*3"),
    ({"history": True}, "history.*True"),
    ({"width": -3}, "width.*-3"),
    ({"expert": 3}, "expert.*3"),
    ({"expert": "experts.nmpc"}, "expert.*'experts.nmpc'"),
]
ACTIONS = [
    (np.full(12, np.nan), r"action must be finite, got \[nan"),
    (np.r_[np.zeros(11), np.inf], r"action must be finite"),
    (np.zeros(11), r"action must have shape \(12,\), got shape \(11,\)"),
    (np.zeros((1, 12)), r"action must have shape \(12,\), got shape \(1, 12\)"),
    (0.0, r"action must have shape \(12,\), got shape \(\)"),
    ("up", r"action must be 12 numbers, got 'up'"),
    (None, r"action"),
    ([[1.0], [2.0, 3.0]], r"action must be 12 numbers"),
    (torch.zeros(12, requires_grad=True), r"action must be 12 numbers, got tensor.*requires grad"),
    (np.zeros(12, dtype=bool), r"action must be 12 numbers, got array"),
    (["1"] * 12, r"action must be 12 numbers, got .'1'"),
    (np.zeros(12, dtype=complex), r"action must be 12 numbers"),
]
RUNNING = [
    (lambda env: env.set_task("moonwalk"), r"task must be one of .*got 'moonwalk'"),
    (lambda env: env.set_task("walk", phase=1.0), r"phase \[cycles\] must lie in \[0, 1\), got 1"),
    (lambda env: env.set_task("walk", phase=-0.1), r"phase.*got -0.1"),
    (lambda env: env.set_task("walk", phase=10**400), r"phase"),
    (lambda env: env.reset(seed=0, options={"command": (10**400, 0, 0)}), r"command"),
    (lambda env: env.set_task("walk", phase="late"), r"phase.*got 'late'"),
    (lambda env: env.set_command((0.1, 0.2)), r"command \(vx, vy, yaw rate\) must have shape \(3,\), got shape \(2,\)"),
    (lambda env: env.set_command((9.0, 0.0, 0.0)), r"command.*'trot' must lie within.*got \[9.0, 0.0, 0.0\]"),
    (lambda env: env.set_command((np.nan, 0.0, 0.0)), r"command.*finite.*nan"),
    (lambda env: env.push((1.0, 2.0)), r"push.*shape \(3,\)"),
    (lambda env: env.push((np.inf, 0.0, 0.0)), r"push.*finite"),
    (
        lambda env: env.reset(options={"speed": 1}),
        r"reset option must be one of 'command', 'gait', 'task'; got 'speed'",
    ),
    (lambda env: env.reset(options=["command"]), r"reset options must be a dictionary.*got \['command'\]"),
    (lambda env: env.reset(options={"task": ["walk"]}), r"task must be one of.*got \['walk'\]"),
    (lambda env: env.set_task("walk", phase=True), r"phase.*True"),
    (lambda env: env.reset(options={"task": "moonwalk"}), r"got 'moonwalk'"),
    (lambda env: env.reset(seed=1, options={"command": (0.0, 5.0, 0.0)}), r"command.*within.*got \[0.0, 5.0, 0.0\]"),
    (lambda env: env.reset(options={"command": "fast"}), r"command.*'fast'"),
]


@pytest.mark.parametrize(("arguments", "words"), CONSTRUCTION, ids=lambda value: str(value)[:40])
def test_impossible_arguments_are_refused(arguments, words):
    with pytest.raises(InvalidInputError, match=words):
        Go1Env(**arguments)


@pytest.mark.parametrize(("arguments", "words"), WRONG_KIND, ids=lambda value: str(value)[:40])
def test_arguments_of_the_wrong_kind_are_refused(arguments, words):
    with pytest.raises(InvalidInputError, match=words):
        Go1Env(**arguments)


def continues_unchanged(disturb) -> None:
    """A disturbed environment and its twin take the same 10 steps to the bit."""
    env, twin = Go1Env("trot", noise=True, history=2), Go1Env("trot", noise=True, history=2)
    for each in (env, twin):
        each.reset(seed=5)
        each.step(np.zeros(12))
    disturb(env)
    actions = np.random.default_rng(0).uniform(-0.2, 0.2, (10, 12))
    for action in actions:
        np.testing.assert_array_equal(env.step(action)[0], twin.step(action)[0])
    np.testing.assert_array_equal(env.reset()[0], twin.reset()[0])


@pytest.mark.parametrize(("action", "words"), ACTIONS, ids=lambda value: str(value)[:25])
def test_malformed_actions_step_nothing(action, words):
    def disturb(env):
        with pytest.raises(InvalidInputError, match=words):
            env.step(action)

    continues_unchanged(disturb)


@pytest.mark.parametrize(("call", "words"), RUNNING, ids=[words[:30] for _, words in RUNNING])
def test_refused_calls_change_nothing(call, words):
    def disturb(env):
        with pytest.raises(InvalidInputError, match=words):
            call(env)

    continues_unchanged(disturb)


@pytest.mark.parametrize(
    "call",
    [
        lambda env: env.step(np.zeros(12)),
        lambda env: env.expert_action(),
        lambda env: env.state,
        lambda env: env.estimated_state,
        lambda env: env.task,
        lambda env: env.set_task("walk"),
        lambda env: env.set_command((0.1, 0, 0)),
        lambda env: env.push((0.1, 0, 0)),
    ],
)
def test_everything_before_the_first_reset_asks_for_one(call):
    env = Go1Env("trot")
    with pytest.raises(ResetNeeded, match=r"call reset\(\) before"):
        call(env)
    env.reset(seed=0)
    call(env)


def test_actions_out_of_range_are_clipped():
    one, two = Go1Env("trot"), Go1Env("trot")
    one.reset(seed=0), two.reset(seed=0)
    np.testing.assert_array_equal(one.step(np.full(12, 3.0))[0], two.step(np.ones(12))[0])


@pytest.mark.parametrize(
    ("expert", "error"),
    [("experts.nmpc:Nobody", InvalidInputError), ("nobody:X", ModuleNotFoundError)],
)
def test_an_expert_that_cannot_be_found_is_named(expert, error):
    env = Go1Env("trot", expert=expert)
    env.reset(seed=0)
    with pytest.raises(error, match="(?i)experts.nmpc|nobody"):
        env.expert_action()


def test_one_except_clause_catches_everything():
    assert issubclass(InvalidInputError, Go1Error) and issubclass(InvalidInputError, ValueError)
