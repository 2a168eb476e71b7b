"""The expert drives the robot: five seconds of every gait through the action interface at 50 Hz."""

from dataclasses import dataclass

import numpy as np
import pytest

from go1_mtl_gym import GAITS, TASKS, robot
from go1_mtl_gym.env import Go1Env

COMMAND = np.array([0.4, 0.1, 0.3])
STEPS, SETTLED = 250, 100


@dataclass(frozen=True)
class Rollout:
    contacts: np.ndarray
    velocity: np.ndarray
    height: np.ndarray
    clearance: np.ndarray
    phase: np.ndarray
    ended: str
    counters: object


@pytest.fixture(scope="module", params=list(GAITS))
def rollout(request) -> tuple[str, Rollout]:
    env = Go1Env(request.param)
    env.reset(seed=2, options={"command": COMMAND})
    rows = []
    for _ in range(STEPS):
        _, _, terminated, _, info = env.step(env.expert_action())
        feet = env.simulation.feet_w[:, 2] - robot.FOOT_RADIUS
        rows.append((info["contacts"], info["base_velocity"], env.state.position_w[2], feet, info["phase"]))
        if terminated:
            break
    return request.param, Rollout(*map(np.array, zip(*rows)), info["ended"], env._expert.counters)


def steps(clearance: np.ndarray, swing_height: float) -> np.ndarray:
    """Steps per leg: how often a foot that was down rises to half its swing's height; a bounce is not a step."""
    count = np.zeros(4, int)
    for leg in range(4):
        down = False
        for height in clearance[:, leg]:
            count[leg] += down and height > 0.5 * swing_height
            down = height < 0.005 or (down and height <= 0.5 * swing_height)
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
    expected = (STEPS - SETTLED) * 0.02 * GAITS[name].step_rate
    assert np.abs(steps(run.clearance[SETTLED:], GAITS[name].swing_height) - expected).max() <= 1


def test_feet_swing_as_high_as_the_gait_says(rollout):
    name, run = rollout
    highest = run.clearance[SETTLED:].max(axis=0)
    np.testing.assert_allclose(highest, GAITS[name].swing_height, atol=0.02)


def test_solves_every_problem(rollout):
    _, run = rollout
    assert run.counters.calls == STEPS
    assert run.counters.solver_failures == run.counters.bad_states == 0
    assert run.counters.inexact_solves < 0.2 * STEPS


def test_supports_itself_as_the_gait_says(rollout):
    name, run = rollout
    contacts = run.contacts[50:]
    feet = contacts.sum(axis=1)
    fl, fr, rl, rr = contacts.T
    if name == "jump":
        assert 0.2 < (feet == 0).mean() < 0.5, "all four feet leave the ground together"
        assert ((feet == 0) | (feet == 4)).mean() > 0.9
    elif name == "bound":
        assert min((fl == fr).mean(), (rl == rr).mean()) > 0.9, "front and hind pairs"
        assert 0.05 < (feet == 0).mean() < 0.3, "with a flight between them"
        assert (fl & rl).mean() < 0.2
    elif name == "walk":
        assert feet.min() >= 2
        assert (feet >= 3).mean() > 0.6
    elif name == "trot":
        assert min((fl == rr).mean(), (fr == rl).mean()) > 0.85, "diagonal pairs"
        assert (feet == 0).mean() < 0.1 and (fl & fr).mean() < 0.3
    elif name == "pace":
        assert min((fl == rl).mean(), (fr == rr).mean()) > 0.85, "lateral pairs"
        assert (fl & fr).mean() < 0.4 and (feet == 0).mean() < 0.1
    else:
        assert 0.05 < (fl != fr).mean() < 0.4, "a gallop's pair is nearly together"
        assert 0.05 < (rl != rr).mean() < 0.4
        assert (fl & rl).mean() < 0.2 and (feet >= 2).mean() > 0.7


def test_each_foot_stands_for_its_share_at_its_time(rollout):
    """On the ground for the duty, give or take what landing takes, and in the order of the offsets."""
    name, run = rollout
    gait = GAITS[name]
    planned = gait.stance(run.phase[50:])
    agreement = (planned == run.contacts[50:]).mean(axis=0)
    assert agreement.min() > 0.75
    for other in GAITS.keys() - {name}:
        assert (GAITS[other].stance(run.phase[50:]) == run.contacts[50:]).mean() < agreement.mean()


STANDING = [name for name, gait in GAITS.items() if gait.can_stand]


@pytest.mark.parametrize("task", STANDING)
def test_standing_commands_do_not_drift(task):
    env = Go1Env(task)
    env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    for step in range(150):
        assert not env.step(env.expert_action())[2]
        assert step < 25 or env.state.contacts.all(), "no steps"
        assert env.state.standing and env.state.phase == 0.0
    assert np.linalg.norm(env.state.position_w[:2]) < 0.02 and abs(env.state.rpy[2]) < 0.02
    assert np.abs(env.state.rpy[:2]).max() < 0.03
    assert np.abs(env.state.linear_velocity_w).max() < 0.01 and np.abs(env.state.v).max() < 0.05


@pytest.mark.parametrize("task", STANDING)
def test_a_gait_comes_to_a_stand_and_starts_again(task):
    env = Go1Env(task)
    env.reset(seed=0, options={"command": (0.4, 0.0, 0.0)})
    for step in range(250):
        if step in (70, 160):
            env.set_command((0.0, 0.0, 0.0) if step == 70 else (0.4, 0.0, 0.0))
        assert not env.step(env.expert_action())[2]
        if step == 159:
            assert env.state.standing and env.state.contacts.all()
            assert np.linalg.norm(env.state.linear_velocity_w) < 0.05
    assert env.state.base_velocity[0] == pytest.approx(0.4, abs=0.15)


@pytest.mark.parametrize("push", [(0.0, 0.6, 0.0), (-0.6, 0.0, 0.0)])
def test_a_pushed_trot_recovers(push):
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    for step in range(125):
        if step == 50:
            env.push(push)
        assert not env.step(env.expert_action())[2]
    assert abs(env.state.base_velocity[1]) < 0.15
    assert env.state.base_velocity[0] == pytest.approx(0.3, abs=0.15)


@pytest.mark.parametrize("tasks", [("trot", "bound", "jump", "walk"), ("pace", "gallop", "trot", "pace")])
def test_changes_of_gait_are_survived(tasks):
    env = Go1Env(tasks[0], tasks=tuple(TASKS))
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    for step in range(200):
        if step % 40 == 20:
            env.set_task(tasks[step // 40 % 4])
        assert not env.step(env.expert_action())[2]


@pytest.mark.parametrize("control_hz", [100, 1000])
def test_trots_at_other_rates(control_hz):
    env = Go1Env("trot", control_hz=control_hz)
    env.reset(seed=0, options={"command": COMMAND})
    velocity = []
    for _ in range(4 * control_hz // 5):
        _, _, terminated, _, info = env.step(env.expert_action())
        assert not terminated
        velocity.append(info["base_velocity"])
    np.testing.assert_allclose(np.mean(velocity[-2 * control_hz // 5 :], axis=0), COMMAND, atol=0.12)


@pytest.mark.parametrize(
    ("task", "physics"),
    [
        ("pace", {"action_delay_s": 0.02}),
        ("pace", {"friction": 0.25}),
        ("bound", {"payload_kg": 3.0}),
        ("bound", {"action_delay_s": 0.015}),
        ("walk", {"joint_friction": 1.0, "joint_damping": 1.0, "contact_time_s": 0.1, "action_delay_s": 0.012}),
        ("trot", {"payload_kg": 2.0, "motor_strength": 0.9, "action_delay_s": 0.033}),
    ],
)
def test_a_privileged_expert_walks_under_what_it_is_told_of(task, physics):
    env = Go1Env(task, privileged=True, **physics)
    env.reset(seed=2, options={"command": COMMAND})
    velocity = []
    for _ in range(STEPS):
        _, _, terminated, _, info = env.step(env.expert_action())
        assert not terminated
        velocity.append(info["base_velocity"])
    np.testing.assert_allclose(np.mean(velocity[SETTLED:], axis=0), COMMAND, atol=0.08)


@pytest.mark.parametrize("task", ["trot", "jump"])
def test_asking_the_expert_has_no_side_effects(task):
    asked, driven = Go1Env(task, noise=True), Go1Env(task, noise=True)
    asked.reset(seed=0), driven.reset(seed=0)
    for _ in range(40):
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
