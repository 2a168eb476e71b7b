"""Changes of gait on scripted environments: what is scored, and when it fails."""

import numpy as np
import pytest

from go1_mtl_gym import PAPER_TASKS, TASKS
from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import HIPS, SPEED, THIGHS, StubEnv, make_stub
from trainers import evaluate_transition
from trainers.data.environments import ExpertAccess

SHORT = {"trials": 2, "after_s": 4.0, "make_env": make_stub}


class Both:
    """Steps in the gait that the task id names; `spoil(action, task, step)` changes what it does."""

    env_kwargs = {"tasks": PAPER_TASKS}

    def __init__(self, spoil=lambda action, task, step: action) -> None:
        self.spoil, self.step = spoil, 0

    def predict(self, obs, state=None, episode_start=None, deterministic=True):
        self.step = 0 if episode_start[0] else self.step + 1
        task = PAPER_TASKS[obs[-4:].argmax()]
        turn = np.arctan2(*obs[37:39]) / (2 * np.pi) + np.array(TASKS[task].gait.offsets)
        action = np.zeros(12)
        action[HIPS], action[THIGHS] = obs[34:37] / SPEED, 0.9 * np.sin(2 * np.pi * turn)
        return self.spoil(action, task, self.step).astype(np.float32), state


def falls_in(task, after=0):
    def spoil(action, present, step):
        action[2] = 1.0 if present == task and step >= after else action[2]
        return action

    return spoil


@pytest.mark.parametrize(("first", "second"), [("trot", "walk"), ("walk", "bound"), ("trot", "trot")])
def test_walking_on_in_the_new_gait_is_success(first, second):
    result = evaluate_transition(Both(), first, second, **SHORT)
    assert result.task == f"{first} to {second}" and result.seconds == result.survival_s == 4.0
    assert result.success_rate == result.survival_rate == 1.0 and result.velocity_error < 0.02
    assert result.step_rate == pytest.approx(1 / TASKS[second].gait.period, rel=0.2)


def test_stepping_on_in_the_old_gait_is_none():
    class Stubborn(StubEnv):
        def set_task(self, task):
            assert task == "bound"

    result = evaluate_transition(
        Both(), "walk", "bound", **SHORT | {"make_env": lambda *a, **k: ExpertAccess(Stubborn(a[0], **k))}
    )
    assert result.survival_rate == 1.0 and result.success_rate == 0.0
    assert result.step_rate == pytest.approx(1 / TASKS["walk"].gait.period, rel=0.2)


def test_falls_before_and_after_the_change():
    before = evaluate_transition(Both(falls_in("trot", 30)), "trot", "walk", **SHORT)
    assert before.survival_rate == before.success_rate == before.survival_s == 0.0
    assert np.isnan(before.velocity_error) and np.isnan(before.step_rate)
    after = evaluate_transition(Both(falls_in("walk")), "trot", "walk", **SHORT)
    assert after.survival_rate == after.success_rate == 0.0 and after.survival_s == pytest.approx(0.04)


def test_the_change_comes_somewhere_in_a_period():
    last = {}

    def note(action, task, step):
        last[task] = step
        if task == "walk" and last["trot"] == step - 1:
            changes.append(step)
        return action

    changes = []
    evaluate_transition(Both(note), "trot", "walk", **SHORT | {"trials": 8}, before_s=1.0)
    assert len(changes) == 8 and 51 <= min(changes) < max(changes) <= 71, "1 s and up to 0.4 s, seen one step later"
    assert len(set(changes)) > 3


def test_trials_depend_on_gaits_seed_and_number_alone():
    result = evaluate_transition(Both(), "trot", "walk", **SHORT | {"trials": 3})
    first = evaluate_transition(Both(falls_in("walk")), "trot", "walk", **SHORT | {"trials": 1})
    assert first.episodes[0].commands == result.episodes[0].commands
    assert evaluate_transition(Both(), "trot", "walk", **SHORT).episodes == result.episodes[:2]
    others = [("walk", "trot", 1), ("trot", "walk", 2)]
    commands = {evaluate_transition(Both(), a, b, seed=s, **SHORT).episodes[0].commands for a, b, s in others}
    assert len({e.commands for e in result.episodes} | commands) == 5
    drawn = np.abs([e.commands[0] for e in result.episodes])
    assert (drawn <= np.minimum(TASKS["trot"].command_range, TASKS["walk"].command_range)).all()


def test_processes_give_the_same_result():
    alone = evaluate_transition("expert", "trot", "walk", **SHORT)
    assert evaluate_transition("expert", "trot", "walk", **SHORT, n_jobs=2).as_dict() == alone.as_dict()
    assert alone.success_rate == 1.0


@pytest.mark.parametrize(
    "kwargs",
    [{"second": "moonwalk"}, {"second": "pace"}, {"trials": 0}, {"before_s": -1.0}, {"after_s": 0.0}],
)
def test_bad_arguments(kwargs):
    with pytest.raises(InvalidInputError):
        evaluate_transition(Both(), **{"first": "trot", "second": "walk", **SHORT, **kwargs})
    with pytest.raises(InvalidInputError, match="predict"):
        evaluate_transition("nonsense", "trot", "walk", **SHORT)
