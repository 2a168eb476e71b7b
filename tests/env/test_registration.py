"""Tasks of one's own: named, registered, and known wherever environments are made."""

import dataclasses
import multiprocessing
import pickle

import gymnasium
import numpy as np
import pytest

import go1_mtl_gym
from go1_mtl_gym import BUILT_IN_TASKS, TASKS, Gait, Task, env_id, register_task
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.errors import InvalidInputError
from trainers import CollectJob, Demonstrations, collect_all, evaluate, make_venv

AMBLE = Task("amble", Gait("amble", 0.5, 0.65, (0.25, 0.75, 0.0, 0.5)), command_range=(0.4, 0.2, 0.3))


@pytest.fixture
def amble(passing_tasks) -> Task:
    """A registered task."""
    register_task(AMBLE)
    return AMBLE


def test_a_registered_task_is_everywhere(amble):
    assert list(TASKS)[-1] == "amble" and TASKS["amble"] is amble
    env = gymnasium.make("go1_mtl_gym:Go1Amble-v0")
    observation, info = env.reset(seed=0)
    assert info["task"] == "amble" and env.unwrapped.tasks[-1] == "amble" and observation[-1] == 1.0
    env = Go1Env(None, tasks=tuple(TASKS))
    env.reset(seed=0, options={"task": "amble", "command": (0.4, 0.0, 0.0)})
    assert env.state.gait is amble.gait


def test_environments_made_before_keep_their_tasks(passing_tasks):
    before = len(TASKS)
    old = Go1Env(None, tasks=tuple(TASKS))
    register_task(dataclasses.replace(AMBLE, name="late"))
    assert len(old.tasks) == before and "late" not in pickle.loads(pickle.dumps(old)).tasks
    assert Go1Env("late").tasks == (*BUILT_IN_TASKS, "late") and "late" not in Go1Env("trot").tasks


def test_equal_tasks_may_be_registered_again_and_others_of_the_name_may_not(amble):
    register_task(dataclasses.replace(amble, command_range=[0.4, 0.2, 0.3]))
    assert TASKS["amble"] is amble
    with pytest.raises(InvalidInputError, match=r"'amble' is taken by another task.*period=0.5.*got.*period=0.6"):
        register_task(dataclasses.replace(amble, gait=dataclasses.replace(amble.gait, period=0.6)))
    with pytest.raises(InvalidInputError, match="'trot' is taken"):
        register_task(dataclasses.replace(amble, name="trot"))
    assert TASKS["amble"] is amble


@pytest.mark.parametrize("name", ["", "Amble", "my amble", "amble-2", "_amble", "amble_", "a_1", "ämble", "multi_gait"])
def test_names_that_make_no_id_are_refused(name):
    known = len(TASKS), len(gymnasium.registry)
    with pytest.raises(InvalidInputError, match=f"name must be lower-case words.*got {name!r}"):
        register_task(dataclasses.replace(AMBLE, name=name))
    assert known == (len(TASKS), len(gymnasium.registry))


def test_only_tasks_are_registered_and_the_table_is_read_only():
    with pytest.raises(InvalidInputError, match="a Task was expected, got 'amble'"):
        register_task("amble")
    with pytest.raises(InvalidInputError, match="gait of task 'amble' must be a Gait, got 'amble'"):
        Task("amble", "amble", (0.1, 0.1, 0.1))
    with pytest.raises(TypeError):
        TASKS["amble"] = AMBLE


def test_ids():
    assert env_id("pace") == "go1_mtl_gym:Go1Pace-v0" and env_id(None) == "go1_mtl_gym:Go1MultiGait-v0"
    assert env_id("fast_trot") == "go1_mtl_gym:Go1FastTrot-v0"
    assert {"Go1Pace-v0", "Go1Gallop-v0"} <= set(gymnasium.registry)


def step_in_another_process(pickled: bytes, queue) -> None:
    env = pickle.loads(pickled)
    queue.put((env.step(np.zeros(12))[0], env.tasks, list(go1_mtl_gym.TASKS)))


def test_a_pickled_environment_takes_its_task_to_a_spawned_process(amble):
    env = Go1Env("amble", tasks=("trot", "amble"))
    env.reset(seed=1)
    context = multiprocessing.get_context("spawn")
    queue = context.Queue()
    process = context.Process(target=step_in_another_process, args=(pickle.dumps(env), queue))
    process.start()
    observation, tasks, known = queue.get(timeout=60)
    process.join(60)
    np.testing.assert_array_equal(observation, env.step(np.zeros(12))[0])
    assert tasks == env.tasks and known[-1] == "amble"


def test_worker_processes_of_the_trainers_know_the_task(amble, tmp_path):
    venv = make_venv(("amble",), per_task=2, subproc=True)
    try:
        assert venv.reset()[:, -1].tolist() == [1.0, 1.0] and venv.get_attr("tasks")[0][-1] == "amble"
    finally:
        venv.close()
    paths = collect_all([CollectJob("amble", seed, 0.2) for seed in (0, 1)], tmp_path, n_jobs=2)
    assert [Demonstrations.load(path).tasks[-1] for path in paths] == ["amble", "amble"]
    result = evaluate("expert", "amble", episodes=2, seconds=0.2, n_jobs=2)
    assert result.as_dict() == evaluate("expert", "amble", episodes=2, seconds=0.2).as_dict()
