"""The expert drives the robot: five seconds of every gait through the action interface at 50 Hz."""

from dataclasses import dataclass

import numpy as np
import pytest

from go1_mtl_gym import GAITS
from go1_mtl_gym.env import Go1Env

COMMAND = np.array([0.4, 0.1, 0.3])
STEPS, SETTLED = 250, 100


@dataclass(frozen=True)
class Rollout:
    contacts: np.ndarray
    velocity: np.ndarray
    height: np.ndarray
    ended: str
    counters: object


@pytest.fixture(scope="module", params=list(GAITS))
def rollout(request) -> tuple[str, Rollout]:
    env = Go1Env(request.param)
    env.reset(seed=2, options={"command": COMMAND})
    contacts, velocity, height = [], [], []
    for _ in range(STEPS):
        _, _, terminated, _, info = env.step(env.expert_action())
        contacts.append(info["contacts"])
        velocity.append(info["base_velocity"])
        height.append(env.state.position_w[2])
        if terminated:
            break
    counters = env._expert.counters
    return request.param, Rollout(np.array(contacts), np.array(velocity), np.array(height), info["ended"], counters)


def touchdowns(contacts: np.ndarray, min_air: int = 3) -> np.ndarray:
    """Touchdowns per leg after at least `min_air` samples in the air: a bounce is not a step."""
    count = np.zeros(4, int)
    for leg in range(4):
        air = 0
        for contact in contacts[:, leg]:
            count[leg] += contact and air >= min_air
            air = 0 if contact else air + 1
    return count


def test_survives(rollout):
    _, run = rollout
    assert run.ended == "" and len(run.velocity) == STEPS
    assert run.height.min() > 0.18 and run.height.max() < 0.42


def test_follows_the_command(rollout):
    _, run = rollout
    np.testing.assert_allclose(run.velocity[SETTLED:].mean(axis=0), COMMAND, atol=0.08)


def test_steps_at_the_rate_of_the_gait(rollout):
    name, run = rollout
    rate = touchdowns(run.contacts[SETTLED:]) / ((STEPS - SETTLED) * 0.02)
    np.testing.assert_allclose(rate, GAITS[name].step_rate, rtol=0.25)


def test_solves_every_problem(rollout):
    _, run = rollout
    assert run.counters.calls == STEPS
    assert run.counters.solver_failures == run.counters.bad_states == 0
    assert run.counters.inexact_solves < 0.2 * STEPS


def test_supports_itself_as_the_gait_says(rollout):
    name, run = rollout
    feet = run.contacts[50:].sum(axis=1)
    if name == "jump":
        assert (feet == 0).mean() > 0.2, "all four feet leave the ground together"
    elif name == "walk":
        assert feet.min() >= 2
        assert (feet >= 3).mean() > 0.7
    elif name == "trot":
        diagonals = run.contacts[50:, [0, 1]] == run.contacts[50:, [3, 2]]
        assert diagonals.mean() > 0.8 and (feet == 0).mean() < 0.1
    else:
        pairs = run.contacts[50:, [0, 2]] == run.contacts[50:, [1, 3]]
        assert pairs.mean() > 0.8 and (feet == 4).mean() < 0.2


def test_standing_commands_do_not_drift():
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    for _ in range(150):
        assert not env.step(env.expert_action())[2]
    assert np.linalg.norm(env.state.position_w[:2]) < 0.15 and abs(env.state.rpy[2]) < 0.1


def test_a_pushed_trot_recovers():
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    for step in range(150):
        if step == 50:
            env.push((0.0, 0.6, 0.0))
        assert not env.step(env.expert_action())[2]
    assert abs(env.state.base_velocity[1]) < 0.2


def test_a_change_of_gait_is_survived():
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    for step in range(200):
        if step % 50 == 25:
            env.set_task(("bound", "jump", "walk", "trot")[step // 50])
        assert not env.step(env.expert_action())[2]


@pytest.mark.parametrize("task", ["trot", "jump"])
def test_asking_the_expert_has_no_side_effects(task):
    asked, driven = Go1Env(task, noise=True), Go1Env(task, noise=True)
    asked.reset(seed=0), driven.reset(seed=0)
    for _ in range(60):
        actions = [asked.expert_action() for _ in range(3)]
        np.testing.assert_array_equal(actions[0], actions[2])
        (a, *_), (b, *_) = asked.step(actions[0]), driven.step(driven.expert_action())
        np.testing.assert_array_equal(a, b)


def test_an_action_learned_elsewhere_does_not_need_the_expert():
    """Never asking gives the same physics as asking at every step."""
    asked, never = Go1Env("walk"), Go1Env("walk")
    asked.reset(seed=0), never.reset(seed=0)
    for action in np.random.default_rng(0).uniform(-0.2, 0.2, (20, 12)):
        asked.expert_action()
        np.testing.assert_array_equal(asked.step(action)[0], never.step(action)[0])
    assert never._expert is None
