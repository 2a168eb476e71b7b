"""Closed loop on scripted environments: what counts as a success and what does not."""

import json
import math

import numpy as np
import pytest

from go1_mtl_gym import TASKS
from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import HIPS, SPEED, THIGHS, StubEnv, linear_expert, make_stub
from trainers import evaluate
from trainers.data.environments import ExpertAccess

SHORT = {"episodes": 2, "seconds": 6.0, "make_env": make_stub}


class Scripted:
    """The stub's expert from what a policy sees, with its output changed by `spoil`."""

    def __init__(self, task: str = "trot", spoil=lambda action: action, env_kwargs=None) -> None:
        self.offsets, self.spoil, self.calls = np.array(TASKS[task].gait.offsets), spoil, 0
        self.env_kwargs = env_kwargs or {}

    def predict(self, obs, deterministic=False):
        assert deterministic and obs.ndim == 1
        self.calls += 1
        phase = np.arctan2(*obs[37:39]) / (2 * np.pi)
        action = np.zeros(12)
        action[HIPS], action[THIGHS] = obs[34:37] / SPEED, 0.9 * np.sin(2 * np.pi * (phase + self.offsets))
        return self.spoil(action).astype(np.float32), None


def still(action):
    action[THIGHS] = 0.0
    return action


def drifting(action):
    action[0] += 0.2 / SPEED
    return action


def falling(action):
    action[2] = 1.0
    return action


@pytest.mark.parametrize("task", list(TASKS))
def test_stepping_and_tracking_is_success(task):
    result = evaluate(Scripted(task), task, **SHORT, tasks=tuple(TASKS))
    assert result.survival_rate == result.success_rate == 1.0 and result.survival_s == 6.0
    assert result.velocity_error < 0.02 and result.yaw_rate_error < 0.02
    assert result.step_rate == pytest.approx(1 / TASKS[task].gait.period, rel=0.15)


def test_standing_still_survives_and_fails():
    result = evaluate(Scripted(spoil=still), **SHORT)
    assert result.survival_rate == 1.0 and result.velocity_error < 0.15
    assert result.step_rate == 0.0 and result.success_rate == 0.0


class Pausing(StubEnv):
    """A stub that has its robot stand while the filtered command is small."""

    def info(self, fallen):
        return super().info(fallen) | {"standing": bool(np.abs(self.filtered).max() < 0.05)}


def make_pausing(task, perturbation=None, **env_kwargs):
    return ExpertAccess(Pausing(task, **env_kwargs))


def lifting(every: int):
    """Lifts all legs for one swing in so many steps, and else stands."""
    policy = Scripted()

    def spoil(action):
        action[THIGHS] = 0.9 if policy.calls % every < 6 else 0.0
        return action

    policy.spoil = spoil
    return policy


@pytest.mark.parametrize(("policy", "success"), [(Scripted(spoil=still), 1.0), (Scripted(), 0.0)])
def test_a_robot_that_is_to_stand_must_not_step(policy, success):
    pausing = SHORT | {"make_env": make_pausing, "commands": [(0.0, 0.0, 0.0)]}
    assert evaluate(policy, **pausing).success_rate == success
    assert evaluate(policy, **SHORT, commands=[(0.0, 0.0, 0.0)]).success_rate == 1.0 - success, "no such rule here"


@pytest.mark.parametrize(("every", "success"), [(150, 1.0), (100, 0.0)])
def test_a_standing_robot_may_make_one_step_and_not_two(every, success):
    pausing = {"episodes": 1, "seconds": 5.8, "make_env": make_pausing, "commands": [(0.0, 0.0, 0.0)]}
    result = evaluate(lifting(every), **pausing)  # touchdowns from 2 s on: at 3.1 s, or at 2.1 and 4.1 s
    assert result.step_rate == pytest.approx((1 if success else 2) / 3.8) and result.success_rate == success


def test_steps_are_counted_against_the_time_in_which_the_clock_ran():
    def stepping_when_told(action):
        if np.abs(SPEED * action[HIPS]).max() < 0.05:
            action[THIGHS] = 0.0
        return action

    paused = SHORT | {"make_env": make_pausing, "seconds": 10.0, "command_interval": 3.0, "episodes": 1}
    with pytest.MonkeyPatch.context() as patch:
        draws = iter([(9.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.0, 0.0)])  # the first: unused
        patch.setattr("go1_mtl_gym.Task.draw_command", lambda self, rng: np.array(next(draws)))
        result = evaluate(Scripted(spoil=stepping_when_told), **paused, commands=[(0.4, 0.0, 0.0)])
    assert result.success_rate == 1.0
    assert 1.0 < result.step_rate < 2.0, "about half the time at 2.5 steps per second"


def test_drifting_fails_by_velocity():
    result = evaluate(Scripted(spoil=drifting), **SHORT)
    assert result.velocity_error == pytest.approx(0.2, abs=0.02) and result.success_rate == 0.0


def test_one_lame_leg_fails():
    def lame(action):
        action[10] = 0.0
        return action

    result = evaluate(Scripted(spoil=lame), **SHORT)
    assert result.success_rate == 0.0 and result.episodes[0].step_rate[3] == 0.0
    assert result.episodes[0].step_rate[0] > 2.0


def test_falling_at_once():
    result = evaluate(Scripted(spoil=falling), **SHORT)
    assert result.survival_rate == result.success_rate == 0.0 and result.survival_s == pytest.approx(0.02)
    assert math.isnan(result.velocity_error) and math.isnan(result.step_rate)
    assert all(e.fallen for e in result.episodes)
    text = json.dumps(result.as_dict(), allow_nan=False)
    assert json.loads(text)["velocity_error"] is None


def test_falling_late_still_has_figures():
    policy = Scripted()
    policy.spoil = lambda action: falling(action) if policy.calls % 200 == 0 else action
    result = evaluate(policy, **SHORT)
    assert result.survival_s == pytest.approx(4.0) and result.velocity_error < 0.02
    assert result.step_rate == pytest.approx(2.5, rel=0.25) and result.success_rate == 0.0


def test_expert_by_name_and_as_an_object():
    class Expert:
        resets = 0

        def reset(self, state):
            Expert.resets += 1

        def action(self, state):
            return StubEnv().action_map.to_radians(linear_expert(state))

    by_name, as_object = evaluate("expert", **SHORT), evaluate(Expert(), **SHORT)
    assert by_name.success_rate == 1.0 and Expert.resets == 2
    assert by_name.velocity_error == pytest.approx(as_object.velocity_error, abs=1e-5)


def test_same_held_out_commands_for_everybody():
    one, other = evaluate(Scripted(), **SHORT), evaluate(Scripted(spoil=still), **SHORT)
    assert [e.commands for e in one.episodes] == [e.commands for e in other.episodes]
    assert len({e.commands for e in one.episodes}) == 2
    again = evaluate(Scripted(), **SHORT, seed=2)
    assert again.episodes[0].commands != one.episodes[0].commands
    assert evaluate(Scripted(), **{**SHORT, "episodes": 1}).episodes[0] == one.episodes[0]


def test_given_and_redrawn_commands():
    result = evaluate(Scripted(), **SHORT, commands=[(0.3, 0.1, 0.0)])
    assert [e.commands for e in result.episodes] == [((0.3, 0.1, 0.0),)] * 2
    result = evaluate(Scripted(), **SHORT, command_interval=2.5)
    assert [len(e.commands) for e in result.episodes] == [3, 3] and result.success_rate == 1.0


def test_commands_from_corners():
    corners = SHORT | {"episodes": 6, "seconds": 2.0, "corners": True, "command_interval": 0.5}
    result = evaluate(Scripted(), **corners)
    given = np.array([e.commands for e in result.episodes])
    assert given.shape == (6, 4, 3)
    assert (np.abs(given) == TASKS["trot"].command_range).all()
    assert len(np.unique(given[:, 0], axis=0)) > 1 and len(np.unique(given[0], axis=0)) > 1
    again = evaluate(Scripted(spoil=still), **corners | {"episodes": 1})
    assert again.episodes[0].commands == result.episodes[0].commands
    with pytest.raises(InvalidInputError, match="corners"):
        evaluate(Scripted(), **corners, commands=[(0.3, 0.0, 0.0)])


class Remembering(Scripted):
    """Counts the steps of an episode in a state, as a recurrent policy of stable-baselines3 would keep it."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.counts, self.starts = [], []

    def predict(self, obs, state=None, episode_start=None, deterministic=False):
        assert episode_start.shape == (1,)
        count = np.where(episode_start, 0, np.zeros(1) if state is None else state) + 1
        self.counts.append(int(count[0]))
        self.starts.append(bool(episode_start[0]))
        return super().predict(obs, deterministic)[0], count


def test_a_policy_with_a_state_is_given_it_back():
    policy = Remembering()
    assert evaluate(policy, **SHORT | {"seconds": 1.0}).survival_rate == 1.0
    assert policy.counts == [*range(1, 51)] * 2
    assert policy.starts == [i == 0 for i in range(50)] * 2


def test_env_kwargs_come_from_the_policy():
    result = evaluate(Scripted(env_kwargs={"control_hz": 100}), **SHORT)
    assert result.success_rate == 1.0 and result.velocity_error < 0.02
    policy = Scripted(env_kwargs={"control_hz": 100})
    evaluate(policy, **SHORT, control_hz=50)
    assert policy.calls == 2 * 300


def test_processes_give_the_same_result(policy):
    alone = evaluate(policy, **SHORT)
    assert evaluate(policy, **SHORT, n_jobs=2).as_dict() == alone.as_dict()


@pytest.mark.parametrize(
    "kwargs", [{"task": "moonwalk"}, {"episodes": 0}, {"seconds": 0}, {"commands": []}, {"command_interval": 0}]
)
def test_bad_arguments(kwargs):
    with pytest.raises(InvalidInputError):
        evaluate("expert", **{**SHORT, **kwargs})
    with pytest.raises(InvalidInputError, match="predict"):
        evaluate("nonsense", **SHORT)
