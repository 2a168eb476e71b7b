"""Episodes: ids, determinism, commands, tasks, and every way in which an episode ends."""

import dataclasses

import gymnasium
import numpy as np
import pytest

import go1_mtl_gym
from go1_mtl_gym import BUILT_IN_TASKS, PAPER_TASKS, TASKS, InvalidInputError, PDGains, env_id, robot
from go1_mtl_gym.env import Go1Env

INFO = {
    "task", "command", "filtered_command", "base_velocity", "contacts", "phase", "gait", "standing", "reward_terms",
    "fallen", "ended",
}  # fmt: skip


def same(a: dict, b: dict) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[key], b[key]) for key in a)


@pytest.mark.parametrize("task", [None, *TASKS])
def test_every_id_is_registered_with_and_without_the_module(task):
    name = env_id(task)
    assert name.startswith("go1_mtl_gym:Go1") and name.endswith("-v0")
    for each in (name, name.split(":")[1]):
        env = gymnasium.make(each)
        observation, info = env.reset(seed=0)
        assert isinstance(env.unwrapped, Go1Env) and info["task"] == (task or info["task"])
        assert env.action_space == gymnasium.spaces.Box(-1, 1, (12,), np.float32)
        assert env.observation_space.contains(observation)


@pytest.mark.parametrize("task", [None, *BUILT_IN_TASKS])
def test_without_arguments_it_is_the_environment_of_the_policy_in_the_package(task):
    env = gymnasium.make(env_id(task)).unwrapped
    drives = BUILT_IN_TASKS
    assert env.tasks == drives and env.layout.channels == ("command", "phase", "last_action", "leg_kinematics")
    assert env.observation_space.shape == (34 + 3 + 2 + 12 + 24 + 2 * 34 + len(drives),)
    assert (env.control_hz, env.gains, env.config.history) == (50, PDGains(50.0, 2.0), 3)


def test_without_channels_it_is_the_papers():
    env = gymnasium.make("go1_mtl_gym:Go1Walk-v0", channels=(), history=1, tasks=PAPER_TASKS)
    assert env.observation_space.shape == (34 + 4,)


def test_the_package_has_a_version_and_exports_what_it_lists():
    assert go1_mtl_gym.__version__[0].isdigit()
    assert all(hasattr(go1_mtl_gym, name) for name in go1_mtl_gym.__all__)


def test_multi_gait_draws_every_task_about_equally():
    env = Go1Env(None)
    drawn = [env.reset(seed=0 if i == 0 else None)[1]["task"] for i in range(240)]
    counts = [drawn.count(name) for name in BUILT_IN_TASKS]
    assert min(counts) > 25 and sum(counts) == 240


@pytest.mark.parametrize("kwargs", [{}, {"noise": True, "history": 2, "channels": ("phase", "gravity")}], ids=str)
def test_one_seed_gives_the_same_bits(kwargs):
    one, two, other = (Go1Env(None, **kwargs) for _ in range(3))
    (a, info_a), (b, info_b), (c, info_c) = one.reset(seed=7), two.reset(seed=7), other.reset(seed=8)
    np.testing.assert_array_equal(a, b)
    assert same(info_a, info_b) and (info_a["command"] != info_c["command"]).all() and (a[6:18] != c[6:18]).all()
    rng = np.random.default_rng(0)
    for _ in range(100):
        action = rng.uniform(-1, 1, 12)
        (a, reward_a, *ends_a, info_a), (b, reward_b, *ends_b, info_b) = one.step(action), two.step(action)
        np.testing.assert_array_equal(a, b)
        assert reward_a == reward_b and ends_a == ends_b and same(info_a, info_b)
        if ends_a[0]:
            a, b = one.reset()[0], two.reset()[0]
            np.testing.assert_array_equal(a, b)


def test_episodes_without_a_seed_differ_from_each_other():
    env = Go1Env("trot")
    commands = [env.reset(seed=0 if i == 0 else None)[1]["command"] for i in range(3)]
    assert len({tuple(command) for command in commands}) == 3


def test_global_random_state_is_left_alone():
    np.random.seed(3)  # noqa: NPY002
    expected = np.random.get_state()[1].copy()  # noqa: NPY002
    env = Go1Env(None, noise=True)
    env.reset(seed=0)
    env.step(np.zeros(12))
    np.testing.assert_array_equal(np.random.get_state()[1], expected)  # noqa: NPY002


def test_reset_options_choose_command_and_task():
    env = Go1Env("trot")
    _, info = env.reset(seed=0, options={"command": (0.5, 0.1, -0.2), "task": "bound"})
    assert info["task"] == "bound" == env.task.name and info["command"].tolist() == [0.5, 0.1, -0.2]
    _, info = env.reset()
    assert info["task"] == "trot", "the option holds for one episode"
    _, info = env.reset(options={"command": None, "task": None})
    assert info["task"] == "trot" and (np.abs(info["command"]) <= TASKS["trot"].command_range).all()


def test_an_episode_starts_standing_at_phase_zero():
    env = Go1Env("walk")
    env.reset(seed=0)
    for _ in range(7):
        env.step(np.zeros(12))
    _, info = env.reset()
    assert info["phase"] == 0.0 and set(info) == INFO and info["ended"] == "" and not info["fallen"]
    assert np.abs(env.state.q - robot.HOME_POSE).max() <= 0.03 and not env.state.v.any()
    assert env.state.rpy.tolist() == [0, 0, 0] and not info["filtered_command"].any()


@pytest.mark.parametrize(
    ("task", "command"), [*((task, (0.0, 0.0, 0.0)) for task in TASKS), ("trot", None), ("bound", None)]
)
def test_zero_action_stands_for_ten_seconds(task, command):
    env = Go1Env(task)
    env.reset(seed=0, options={"command": command})
    for _ in range(500):
        *_, terminated, truncated, info = env.step(np.zeros(12))
        assert not terminated and not truncated
    assert info["contacts"].all() and np.linalg.norm(env.state.position_w[:2]) < 0.05
    assert env.state.position_w[2] == pytest.approx(robot.STANDING_HEIGHT, abs=0.03)


def test_set_task_begins_the_gait_and_keeps_the_command():
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.3, 0.0, 0.1)})
    for _ in range(7):  # the first one still stands: the command has not arrived
        _, _, _, _, info = env.step(env.action_map.from_radians(robot.HOME_POSE))
    env.set_task("walk")
    assert info["phase"] == pytest.approx(0.3) and env.state.phase == 0.0 and env.state.gait.name == "walk"
    observation, _, _, _, info = env.step(env.action_map.from_radians(robot.HOME_POSE))
    assert info["phase"] == pytest.approx(0.02 / 0.6) and info["task"] == "walk"
    assert observation[-6:].tolist() == [0, 0, 0, 1, 0, 0] and info["command"].tolist() == [0.3, 0.0, 0.1]


def test_a_task_and_a_command_that_the_present_one_does_not_allow_come_together():
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": np.multiply((1, 0, 0), TASKS["trot"].command_limit)})
    beyond = np.multiply((1, 0, 0), TASKS["walk"].command_limit) + (0.1, 0, 0)
    with pytest.raises(InvalidInputError, match="walk"):
        env.set_task("walk", command=beyond)
    with pytest.raises(InvalidInputError, match="walk"):
        env.set_task("walk")
    assert env.requested_task.name == "trot" and env.command[0] == TASKS["trot"].command_limit[0]
    env.set_task("walk", command=(0.2, 0.0, 0.1))
    assert env.requested_task.name == "walk" and env.command.tolist() == [0.2, 0.0, 0.1]


def test_set_command_is_seen_through_the_filter():
    env = Go1Env("trot")
    env.reset(seed=0, options={"command": (0.0, 0.0, 0.0)})
    env.set_command((0.4, 0.0, 0.0))
    *_, info = env.step(np.zeros(12))
    assert info["command"].tolist() == [0.4, 0.0, 0.0]
    assert info["filtered_command"][0] == pytest.approx(0.4 * (1 - np.exp(-0.1)))


def test_lying_down_ends_as_a_fall():
    env = Go1Env("trot")
    env.reset(seed=0)
    action = env.action_map.from_radians(np.tile([0.0, 1.4, -2.8], 4))
    for _ in range(100):
        _, _, terminated, truncated, info = env.step(action)
        assert info["fallen"] == terminated == (info["ended"] == "fall") and not truncated
        if terminated:
            break
    assert terminated and env.state.position_w[2] < 0.14


def test_tipping_over_ends_as_a_fall():
    env = Go1Env("trot")
    env.reset(seed=0)
    env.simulation.data.qpos[2] = 1.0
    for degrees, fallen in ((55, False), (65, True)):
        half = np.deg2rad(degrees) / 2
        env.simulation.data.qpos[3:7] = [np.cos(half), np.sin(half), 0, 0]
        env.simulation.data.qvel[:] = 0
        _, _, terminated, _, info = env.step(env.action_map.from_radians(robot.HOME_POSE))
        assert terminated is fallen and info["ended"] == ("fall" if fallen else "")


@pytest.mark.parametrize("control_hz", [50, 100])
def test_time_limit_truncates_and_does_not_terminate(control_hz):
    env = Go1Env("trot", episode_s=0.5, control_hz=control_hz)
    env.reset(seed=0)
    action = env.action_map.from_radians(robot.HOME_POSE)
    ends = [env.step(action)[2:] for _ in range(control_hz // 2)]
    assert not any(terminated or truncated for terminated, truncated, _ in ends[:-1])
    terminated, truncated, info = ends[-1]
    assert not terminated and truncated and info["ended"] == "time" and not info["fallen"]


@pytest.mark.parametrize("bad", [np.nan, 1e10, 1e200])
def test_diverged_physics_terminates_with_a_finite_observation(bad):
    env = Go1Env("trot", channels=("gravity", "phase"), history=3)
    env.reset(seed=0)
    env.simulation.data.qvel[3] = bad
    observation, _, terminated, truncated, info = env.step(np.zeros(12))
    assert terminated and not truncated and info["ended"] == "unstable" and info["fallen"]
    assert np.isfinite(observation).all() and env.observation_space.contains(observation)
    first, _ = env.reset(seed=0)
    np.testing.assert_array_equal(first, Go1Env("trot", channels=("gravity", "phase"), history=3).reset(seed=0)[0])
    assert not env.step(np.zeros(12))[2]


@pytest.mark.parametrize("bad", [np.nan, 1e10])
def test_diverged_physics_gives_a_finite_reward(bad):
    env = Go1Env("trot")
    env.reset(seed=0)
    env.simulation.data.qvel[3] = bad
    _, reward, _, _, info = env.step(np.zeros(12))
    assert info["ended"] == "unstable"
    assert np.isfinite(reward) and np.isfinite(list(info["reward_terms"].values())).all()


def every_array(env: Go1Env, info: dict) -> list[np.ndarray]:
    """Everything that an environment hands out and that can be written to."""
    states = [env.state, env.estimated_state]
    of_states = [getattr(state, each.name) for state in states for each in dataclasses.fields(state)]
    handed_out = [*info.values(), *of_states, *(state.rotation for state in states), env.command]
    return [array for array in handed_out if isinstance(array, np.ndarray)]


@pytest.mark.parametrize("seen", [{}, {"estimator_noise": True}, {"state_estimator": True}], ids=str)
def test_nothing_that_is_handed_out_is_shared_with_the_environment(seen):
    kwargs = {"control_hz": 200, "history": 2, "channels": ("command", "last_action"), **seen}
    env, twin = Go1Env("trot", **kwargs), Go1Env("trot", **kwargs)
    observation, info = env.reset(seed=0)
    twin.reset(seed=0)
    for action in np.random.default_rng(0).uniform(-0.1, 0.1, (5, 12)):
        given = action.copy()
        for array in (observation, *every_array(env, info)):
            array[:] = 9.0 if array.dtype != bool else False
        observation, *_, info = env.step(given)
        given[:] = 9.0
        expected, *_, wanted = twin.step(action)
        np.testing.assert_array_equal(observation, expected)
        assert same(info, wanted)
        np.testing.assert_array_equal(env.estimated_state.q, twin.estimated_state.q)


def test_the_action_map_cannot_be_written_to():
    env = Go1Env("trot")
    for array in (env.action_map.center, env.action_map.half_range):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0.0


@pytest.mark.parametrize(("kwargs", "steps"), [({}, 1500), ({"episode_s": 2.0}, 100), ({"control_hz": 100}, 3000)])
def test_the_spec_tells_the_steps_of_an_episode(kwargs, steps):
    env = gymnasium.make("Go1Trot-v0", **kwargs)
    assert env.spec.max_episode_steps == steps == env.unwrapped.spec.max_episode_steps
    assert gymnasium.make(env.spec).spec.max_episode_steps == steps


@pytest.mark.parametrize(("kwargs", "steps"), [({"episode_s": 0.1}, 5), ({"max_episode_steps": 3}, 3)])
def test_whoever_asks_for_a_length_gets_it(kwargs, steps):
    made = gymnasium.make("Go1Trot-v0", **kwargs)
    for env in (made, gymnasium.make(made.spec)):
        assert env.spec.max_episode_steps == steps
        env.reset(seed=0)
        ends = [env.step(np.zeros(12, np.float32))[2:4] for _ in range(steps)]
        assert ends == [(False, False)] * (steps - 1) + [(False, True)]


def test_an_episode_longer_than_the_default_is_not_cut():
    env = gymnasium.make("Go1Trot-v0", episode_s=31.0, disable_env_checker=True)
    env.reset(seed=0)
    simulation = env.unwrapped.simulation
    simulation.step_and_read = lambda target, steps, early: simulation.read()  # time ends whatever the physics
    rest = np.zeros(12, np.float32)
    assert not any(env.step(rest)[3] for _ in range(1549)) and env.step(rest)[3]


def test_a_seed_may_be_numpys():
    env = Go1Env("trot")
    np.testing.assert_array_equal(env.reset(seed=np.int64(3))[0], env.reset(seed=3)[0])


def test_the_expert_is_told_the_gains_and_the_control_period_and_answers_in_radians():
    told = []

    class Fixed:
        def __init__(self, gains, hold_s):
            told.append((gains.kp, gains.kd, hold_s))

        def reset(self, state):
            told.append(state.phase)

        def action(self, state):
            return robot.HOME_POSE

    env = Go1Env("trot", expert=Fixed, control_hz=250, kp=30.0, kd=1.0)
    env.reset(seed=0)
    np.testing.assert_allclose(env.action_map.to_radians(env.expert_action()), robot.HOME_POSE, atol=1e-6)
    assert told == [(30.0, 1.0, 0.004), 0.0]


@pytest.mark.parametrize(
    ("attributes", "words"),
    [
        ({"gains": PDGains(30.0, 1.0)}, r"made for gains PDGains\(kp=30.0, kd=1.0\), .*has PDGains\(kp=50.0, kd=2.0\)"),
        ({"hold_s": 0.002}, "made for hold_s 0.002, the environment has 0.02"),
    ],
)
def test_an_expert_made_for_another_environment_is_refused(attributes, words):
    class Stubborn:
        def __init__(self, gains, hold_s):
            vars(self).update({"gains": gains, "hold_s": hold_s} | attributes)

        def reset(self, state):
            pass

    env = Go1Env("trot", expert=Stubborn)
    env.reset(seed=0)
    for _ in range(2):
        with pytest.raises(InvalidInputError, match=words):
            env.expert_action()


@pytest.mark.parametrize("task", ["trot", None])
def test_info_has_the_same_keys_types_and_shapes_at_reset_and_step(task):
    env = gymnasium.make(env_id(task))
    infos = [env.reset(seed=0)[1], env.step(np.zeros(12, dtype=np.float32))[4], env.reset()[1]]
    kinds = [{key: kind(value) for key, value in info.items()} for info in infos]
    assert kinds[0] == kinds[1] == kinds[2] and set(kinds[0]) == INFO
    assert set(infos[0]["reward_terms"].values()) == {0.0} and infos[1]["reward_terms"]["alive"] > 0


def kind(value: object) -> object:
    if isinstance(value, dict):
        return {key: kind(entry) for key, entry in value.items()}
    return (value.dtype, value.shape) if isinstance(value, np.ndarray) else type(value)
