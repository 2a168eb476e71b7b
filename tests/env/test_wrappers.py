"""Noise, pushes and changing commands, and labels that stay clean under them."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from experts import NMPCExpert
from go1_mtl_gym import BUILT_IN_TASKS, GAITS, PAPER_TASKS, TASKS, PerturbationWrapper, Task, register_task, robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.sensor_faults import Reading
from go1_mtl_gym.wrappers import NOISE_CORRELATION_S

QUIET = {"noise_rad": 0.0, "push": 0.0, "command_interval": None}


def wrapped(**kwargs) -> PerturbationWrapper:
    return PerturbationWrapper(Go1Env("trot"), **(QUIET | kwargs))


def home(env: PerturbationWrapper) -> np.ndarray:
    return env.unwrapped.action_map.from_radians(robot.HOME_POSE).astype(np.float32)


def no_physics(env: PerturbationWrapper) -> Callable[[np.ndarray, int, int], Reading]:
    """In the place of `Simulation.step_and_read`: time passes and nothing moves."""
    return lambda target, steps, early: env.unwrapped.simulation.read()


def test_without_disturbances_it_is_the_environment():
    env, bare = wrapped(), Go1Env("trot")
    np.testing.assert_array_equal(env.reset(seed=0)[0], bare.reset(seed=0)[0])
    for _ in range(20):
        (a, *_, info), (b, *_) = env.step(home(env)), bare.step(home(env))
        np.testing.assert_array_equal(a, b)
        np.testing.assert_array_equal(info["executed_action"], home(env))


def test_one_seed_gives_the_same_disturbances_and_another_others():
    runs = []
    for seed in (1, 1, 2):
        env = PerturbationWrapper(Go1Env("trot"), push_interval=0.1, command_interval=(0.1, 0.3))
        env.reset(seed=seed, options={"command": (0.1, 0, 0)})
        steps = [env.step(home(env)) for _ in range(60)]
        runs.append([np.concatenate([step[0], step[4]["executed_action"], step[4]["command"]]) for step in steps])
    np.testing.assert_array_equal(runs[0], runs[1])
    noise = slice(-15, -3)  # of the executed action
    assert (np.array(runs[0])[:, noise] != np.array(runs[2])[:, noise]).all()


def test_noise_is_autoregressive_with_a_sigma_drawn_per_episode():
    env = wrapped(noise_rad=0.06)
    env.reset(seed=0)
    sigmas, lags = [], []
    for _ in range(60):
        env.reset()
        env.unwrapped.simulation.step_and_read = no_physics(env)  # the noise does not depend on the physics
        noise = np.array([env.step(home(env))[4]["executed_action"] for _ in range(150)]) - home(env)
        noise *= env.unwrapped.action_map.half_range
        sigmas.append(noise.std())
        lags.append(np.mean(noise[1:] * noise[:-1]) / np.mean(noise**2))
        assert np.ptp(noise.std(axis=0)) < 1.2 * noise.std(), "the same in radians for every joint"
        del env.unwrapped.simulation.step_and_read
    assert max(sigmas) < 0.06 * 1.15 and min(sigmas) < 0.01
    assert np.mean(sigmas) == pytest.approx(0.03, abs=0.008)  # uniform in (0, .06)
    assert np.mean(lags) == pytest.approx(np.exp(-0.02 / NOISE_CORRELATION_S), abs=0.03)


def pushes(env: PerturbationWrapper, steps: int, monkeypatch) -> np.ndarray:
    """Every velocity passed to `push` in a run, shape (n, 3)."""
    pushes: list[np.ndarray] = []
    monkeypatch.setattr(env.unwrapped, "push", lambda delta: pushes.append(np.array(delta)))
    monkeypatch.setattr(env.unwrapped.simulation, "step_and_read", no_physics(env))
    for _ in range(steps):
        env.step(home(env))
    return np.array(pushes)


def test_kicks_are_uniform_in_a_disc_and_come_at_the_mean_interval(monkeypatch):
    env = wrapped(push=0.2, push_interval=0.5)
    env.reset(seed=0)
    pushed = pushes(env, 10_000, monkeypatch)  # 200 s
    assert len(pushed) == pytest.approx(200 / 0.51, rel=0.2)  # each interval is rounded up to a step of .02 s
    size = np.linalg.norm(pushed[:, :2], axis=1)
    assert size.max() <= 0.2 and not pushed[:, 2].any()
    assert np.mean(size**2) == pytest.approx(0.2**2 / 2, rel=0.15)
    assert np.abs(pushed.mean(axis=0)).max() < 4 * 0.1 / np.sqrt(len(pushed))


def test_a_kick_changes_the_velocity_of_the_trunk_by_at_most_its_size():
    env = wrapped(push=0.3, push_interval=0.05)
    env.reset(seed=0)
    data, changes = env.unwrapped.simulation.data, []
    push = env.unwrapped.simulation.push

    def watched(delta):
        before = data.qvel.copy()
        push(delta)
        changes.append(data.qvel - before)

    env.unwrapped.simulation.push = watched
    for _ in range(50):
        env.step(home(env))
    changes = np.array(changes)
    assert len(changes) > 10 and (np.linalg.norm(changes[:, :3], axis=1) <= 0.3 + 1e-12).all()
    assert np.abs(changes[:, :2]).max() > 0.1 and not changes[:, 3:].any()


def test_commands_change_within_their_interval_and_range():
    env = wrapped(command_interval=(0.2, 0.4))
    _, info = env.reset(seed=0)
    changed, last = [], info["command"]
    for step in range(1, 301):
        *_, info = env.step(home(env))
        if (info["command"] != last).any():
            changed.append(step * 0.02)
            last = info["command"]
            assert (np.abs(last) <= env.unwrapped.task.command_range).all()
    gaps = np.diff([0.0, *changed])
    assert len(gaps) > 14 and gaps.min() >= 0.2 - 1e-9 and gaps.max() <= 0.42 + 1e-9


# -- Corners and changes of task ---------------------------------------------------------------------------------------


def multi_gait(**kwargs) -> PerturbationWrapper:
    return PerturbationWrapper(Go1Env("trot"), **(QUIET | kwargs))


def commands(env: PerturbationWrapper, steps: int, monkeypatch) -> np.ndarray:
    """Every redrawn command of a run without physics, shape (n, 3)."""
    monkeypatch.setattr(env.unwrapped.simulation, "step_and_read", no_physics(env))
    seen = [env.reset(seed=0)[1]["command"]]
    for _ in range(steps):
        command = env.step(home(env))[4]["command"]
        if (command != seen[-1]).any():
            seen.append(command)
    return np.array(seen[1:])


def test_a_share_of_the_commands_are_corners(monkeypatch):
    env = wrapped(command_interval=(0.02, 0.02), corner_fraction=0.3)
    levels = commands(env, 1400, monkeypatch) / np.array(TASKS["trot"].command_range)
    corners = (np.abs(levels) == 1.0).all(axis=1)
    assert corners.mean() == pytest.approx(0.3, abs=0.05)
    assert len(np.unique(levels[corners], axis=0)) == 8, "all of them"
    assert (np.abs(levels[~corners]) < 1.0).all() and np.std(levels[~corners]) == pytest.approx(3**-0.5, rel=0.05)


def test_every_command_can_be_a_corner(monkeypatch):
    levels = commands(wrapped(command_interval=(0.02, 0.02), corner_fraction=1.0), 50, monkeypatch)
    assert (np.abs(levels) == TASKS["trot"].command_range).all()


def changes(env: PerturbationWrapper, steps: int, monkeypatch, seed: int = 0) -> list[tuple[int, str]]:
    """What tasks are asked for in a run without physics, and in which steps."""
    monkeypatch.setattr(env.unwrapped.simulation, "step_and_read", no_physics(env))
    env.reset(seed=seed)
    set_task, step, asked = env.unwrapped.set_task, 0, []
    monkeypatch.setattr(env.unwrapped, "set_task", lambda name: (asked.append((step, name)), set_task(name)))
    for step in range(1, steps + 1):  # noqa: B007 - the lambda reads it
        env.step(home(env))
    return asked


def test_tasks_change_within_their_interval_to_any_other(monkeypatch):
    asked = changes(multi_gait(task_interval=(0.2, 0.4)), 3000, monkeypatch)
    steps, names = zip(*asked)
    gaps = np.diff((0, *steps))
    assert gaps.min() >= 10 and gaps.max() <= 21 and len(asked) > 150
    assert all(one != other for one, other in zip(("trot", *names), names))
    counts = np.array([names.count(name) for name in BUILT_IN_TASKS])
    assert counts.min() > 0.6 * len(names) / len(BUILT_IN_TASKS)


def test_one_seed_changes_the_same_tasks_and_another_others(monkeypatch):
    runs = [changes(multi_gait(task_interval=(0.2, 0.4)), 300, monkeypatch, seed) for seed in (1, 1, 2)]
    assert runs[0] == runs[1] != runs[2]


def test_a_command_beyond_the_new_tasks_range_goes_to_its_border(monkeypatch):
    env = multi_gait(task_interval=(0.1, 0.1))
    monkeypatch.setattr(env.unwrapped.simulation, "step_and_read", no_physics(env))
    env.reset(seed=0, options={"command": (1.9, -1.0, 0.4)})  # walk accepts 1.1, -0.9
    for _ in range(5):
        *_, info = env.step(home(env))
        assert (info["command"] == (1.9, -1.0, 0.4)).all() == (info["task"] == "trot")
    span = TASKS[info["task"]].command_range
    assert info["task"] != "trot" and info["command"].tolist() == [span[0], -span[1], 0.4]


def test_commands_come_from_the_range_of_the_task_asked_for(monkeypatch, passing_tasks):
    register_task(Task("creep", GAITS["walk"], command_range=(0.1, 0.0, 0.0), command_limit=(0.1, 0.0, 0.0)))
    env = PerturbationWrapper(
        Go1Env("jump", tasks=("jump", "creep", "trot")),
        **(QUIET | {"task_interval": (0.06, 0.3), "command_interval": (0.04, 0.1)}),
    )
    monkeypatch.setattr(env.unwrapped.simulation, "step_and_read", no_physics(env))
    env.reset(seed=0)
    waited, largest = False, 0.0
    for _ in range(600):
        env.step(home(env))
        command, asked = env.unwrapped.command, env.unwrapped.requested_task
        assert (np.abs(command) <= asked.command_range).all()
        waited |= asked.name == "creep" and env.unwrapped.task.name == "jump"
        largest = max(largest, abs(command[0]))
    assert waited, "the jump was not left at once"
    assert largest > 0.7, "the trot's own range is drawn from"


def test_without_corners_and_changes_of_task_the_stream_of_draws_is_this():
    env = wrapped(command_interval=(0.1, 0.2))
    env.reset(seed=4)
    rng = np.random.default_rng([4, 0x9E3779B9])
    rng.uniform(), rng.standard_normal(12), rng.exponential()  # size of the noise, its beginning, the first push
    steps = int(np.ceil(rng.uniform(0.1, 0.2) / 0.02))
    for _ in range(steps):
        rng.standard_normal(12)
        *_, info = env.step(home(env))
    rng.uniform()  # the time of the next command
    np.testing.assert_array_equal(info["command"], TASKS["trot"].draw_command(rng))


def test_the_expert_survives_changes_of_task_and_corners():
    changing = {"task_interval": (0.3, 0.8), "command_interval": (0.3, 0.8), "corner_fraction": 0.5}
    env = PerturbationWrapper(Go1Env(None, tasks=PAPER_TASKS), **changing)
    _, info = env.reset(seed=0)
    seen = {info["task"]}
    for _ in range(400):  # a robot slows down before it changes its gait
        *_, terminated, _, info = env.step(env.unwrapped.expert_action())
        assert not terminated
        seen.add(info["task"])
    assert len(seen) >= 4


def test_one_task_cannot_change():
    with pytest.raises(InvalidInputError, match=r"task_interval must be None for an environment of one task.*\(1, 2\)"):
        PerturbationWrapper(Go1Env("trot", tasks=("trot",)), task_interval=(1, 2))


def test_labels_are_the_experts_answer_for_the_true_state():
    env = PerturbationWrapper(Go1Env("trot"), noise_rad=0.06, push=0.2, push_interval=0.1)
    env.reset(seed=5)
    for _ in range(8):
        expert = NMPCExpert(env.unwrapped.gains)
        expert.reset(env.unwrapped.state)
        label = env.unwrapped.expert_action()
        expected = env.unwrapped.action_map.from_radians(expert.action(dataclasses.replace(env.unwrapped.state)))
        np.testing.assert_array_equal(label, expected.astype(np.float32))
        *_, info = env.step(label)
        assert (info["executed_action"] != label).any()


def test_executed_actions_stay_in_the_action_space():
    env = PerturbationWrapper(Go1Env("trot"), noise_rad=1.0)
    env.reset(seed=0)
    executed = env.step(np.ones(12, np.float32))[4]["executed_action"]
    assert env.action_space.contains(executed) and (executed < 1).any() and (executed == 1).any()


@pytest.mark.parametrize(
    ("figures", "words"),
    [
        ({"noise_rad": -0.1}, r"noise_rad.*\[0, 1\].*-0.1"),
        ({"push": float("nan")}, "push.*nan"),
        ({"push_interval": 0.0}, "push_interval.*got 0"),
        ({"command_interval": (2.0, 1.0)}, "command_interval.*shortest"),
        ({"command_interval": (0.0, 1.0)}, "command_interval"),
        ({"command_interval": (1.0,)}, r"command_interval.*shape \(2,\)"),
        ({"command_interval": (1.0, float("inf"))}, "command_interval.*finite"),
        ({"corner_fraction": 1.5}, r"corner_fraction must lie in \[0, 1\], got 1.5"),
        ({"task_interval": (2.0, 1.0)}, "task_interval must be 0 < shortest <= longest, got"),
        ({"task_interval": (-1.0, 1.0)}, "task_interval"),
    ],
)
def test_impossible_figures_are_refused(figures, words):
    with pytest.raises(InvalidInputError, match=words):
        wrapped(**figures)


def test_a_malformed_action_is_refused():
    env = wrapped(noise_rad=0.05)
    env.reset(seed=0)
    for action in (np.full(12, np.nan), np.zeros((2, 12)), np.zeros(12)[:, None]):
        with pytest.raises(InvalidInputError, match="action"):
            env.step(action)


@pytest.mark.parametrize("action", [0.0, np.zeros(1)], ids=["scalar", "one"])
def test_an_action_that_would_broadcast_is_refused(action):
    env = wrapped()
    env.reset(seed=0)
    with pytest.raises(InvalidInputError, match="action"):
        env.step(action)


def test_the_executed_action_is_told_from_the_reset_on():
    env = wrapped(noise_rad=0.1)
    began, (*_, info) = env.reset(seed=0)[1], env.step(home(env))
    assert began.keys() == info.keys() and not began["executed_action"].any() and info["executed_action"].any()
    assert began["executed_action"].dtype == info["executed_action"].dtype
