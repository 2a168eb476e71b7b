"""What hands do, and an environment in them."""

import dataclasses

import numpy as np
import pytest

import trainers
from go1_mtl_gym import TASKS, InvalidInputError
from trainers.data.operator import MOVES, RELEASED, OperatorConfig, draw_plan
from trainers.data.operator_wrapper import OperatorWrapper

ALL = tuple(TASKS)[:6]
QUIET = dict.fromkeys(MOVES, 0.0)
LONG_S = 4000.0


def plan(seed=0, seconds=LONG_S, task="trot", tasks=ALL, **settings):
    return draw_plan(OperatorConfig(**settings), task, tasks, seconds, np.random.default_rng(seed))


def only(move, **settings):
    return plan(**QUIET | {move: 1.0}, starts_released=1.0, **settings)


def opened(task="trot", config=None, **env_kwargs):
    return OperatorWrapper(trainers.make_env(task, **env_kwargs), config or OperatorConfig())


def test_hands_can_be_left_few_moves():
    config = OperatorConfig(release=2.0, deflection=0.5).of_moves("release", "jerk")
    assert config.weights.tolist() == [0, 0, 0, 0, 0, 0, 0, 1.0, 2.0, 0] and config.deflection == 0.5
    for wrong, message in ((("hop",), "move"), ((), "at least one move")):
        with pytest.raises(InvalidInputError, match=message):
            config.of_moves(*wrong)


# -- The stick ---------------------------------------------------------------------------------------------------------


def test_a_plan_has_no_gaps_and_stays_within_reach():
    segments = plan().segments
    assert segments[0].start_s == 0.0 and segments[-1].end_s >= LONG_S
    for before, after in zip(segments, segments[1:]):
        assert before.end_s == after.start_s and before.after == after.before
    assert np.abs([segment.after for segment in segments]).max() <= 1.0


def test_every_move_is_made_as_often_as_its_weight_says():
    config = OperatorConfig(stand_s=(1.0, 2.0))
    moves = plan(seconds=40_000, stand_s=(1.0, 2.0))
    assert {segment.move for segment in moves.segments} == set(MOVES)
    # these moves are two segments each: on the way, and there
    rests = {"hold", "straight", "sideways", "turn", "corner", "release", "stand"}
    counted = {name: sum(s.move == name for s in moves.segments) / 2 for name in rests}
    weights = {name: getattr(config, name) for name in rests}
    total = sum(counted.values())
    for name in rests:
        assert counted[name] / total == pytest.approx(weights[name] / sum(weights.values()), abs=0.02)


def test_between_two_positions_the_stick_moves_evenly():
    drawn = plan(seed=3)
    ramp = next(segment for segment in drawn.segments if segment.move == "ramp")
    middle = drawn.stick((ramp.start_s + ramp.end_s) / 2)
    assert middle == pytest.approx((np.array(ramp.before) + ramp.after) / 2)
    assert drawn.stick(ramp.start_s + 1e-9) == pytest.approx(ramp.before, abs=1e-6)
    assert drawn.move(ramp.start_s + 1e-9) == "ramp"


@pytest.mark.parametrize(("move", "axes"), [("straight", [0]), ("sideways", [1]), ("turn", [2])])
def test_a_move_along_an_axis_leaves_the_others_alone(move, axes):
    reached = np.array([segment.after for segment in only(move).segments if segment.move == move])
    others = [axis for axis in range(3) if axis not in axes]
    assert np.abs(reached[:, axes]).max() == 1.0 and not reached[:, others].any()


def test_corners_have_every_axis_at_an_end():
    reached = np.array([segment.after for segment in only("corner").segments if segment.move == "corner"])
    assert (np.abs(reached) == 1.0).all() and len(np.unique(reached, axis=0)) == 8


def test_full_deflection_goes_to_one_end_and_the_other_and_back():
    segments = [s for s in only("full_and_back").segments if s.move == "full_and_back"][:6]
    there, other, back = (np.array(segments[i].after) for i in (0, 2, 4))
    assert np.abs(there).sum() == 1.0 and (other == -there).all() and not back.any()


def test_a_jerk_takes_no_time_and_comes_a_few_times_a_second():
    moving = [s for s in only("jerk").segments if s.move == "jerk" and s.before != s.after]
    stays = [s.end_s - s.start_s for s in only("jerk").segments if s.move == "jerk" and s.before == s.after]
    resting = [seconds for seconds in stays if seconds]  # torn to the corner where it is already
    assert all(s.start_s == s.end_s for s in moving) and min(resting) >= 0.1 and max(resting) <= 0.5


def test_a_stick_that_was_let_go_is_in_the_middle():
    released = [s for s in plan().segments if s.move in ("release", "stand") and s.before == s.after]
    assert released and all(s.after == RELEASED for s in released)
    stands = [s.end_s - s.start_s for s in released if s.move == "stand" and s.end_s - s.start_s > 0.2]
    assert stands and min(stands) >= 10.0 and max(stands) <= 60.0


def test_an_episode_may_begin_with_the_stick_let_go_or_held():
    first = [plan(seed, 5.0).segments[0].move for seed in range(300)]
    assert first.count("release") / 300 == pytest.approx(0.3, abs=0.08) and set(first) == {"release", "hold"}


# -- Buttons and pushes ------------------------------------------------------------------------------------------------


def test_gaits_change_to_another_one_at_any_moment_and_twice_within_a_second():
    drawn = plan()
    times, tasks = zip(*drawn.changes)
    assert all(before != after for before, after in zip((drawn.task, *tasks), tasks)) and set(tasks) == set(ALL)
    gaps = np.diff(times)
    assert (gaps >= 0).all() and 0.1 < (gaps < 1.0).mean() < 0.6
    assert {"release", "hold", "ramp", "jerk", "turn"} <= {drawn.move(time_s) for time_s in times}


def test_gaits_change_while_the_robot_brakes():
    drawn = plan(task_interval=(1e5, 1e6), braking_change=1.0)
    let_go = [s.start_s for s in drawn.segments if s.move == "release" and s.before != RELEASED]
    assert len(drawn.changes) >= len([start for start in let_go if start < LONG_S])
    for time_s, _ in drawn.changes:
        assert min(abs(time_s - start - 0.25) for start in let_go) <= 0.25


@pytest.mark.parametrize("settings", [{"task_interval": None}, {"tasks": ("trot",)}])
def test_without_buttons_the_gait_stays(settings):
    assert plan(**settings).changes == ()


def test_pushes_come_as_often_and_as_hard_as_asked_for():
    pushes = plan(push=0.4, push_interval=5.0).pushes
    sizes = np.array([push.size for push in pushes])
    assert len(pushes) == pytest.approx(LONG_S / 5, rel=0.15) and 0.38 < sizes.max() <= 0.4
    assert (sizes**2).mean() == pytest.approx(0.4**2 / 2, rel=0.1)  # uniform in a disc
    assert not plan(push_interval=None).pushes and not any(push.hard for push in pushes)


def test_hard_pushes_are_shares_of_what_the_expert_bears():
    hard = [push for push in plan(hard_push_interval=4.0).pushes if push.hard]
    assert len(hard) == pytest.approx(LONG_S / 4, rel=0.15)
    assert min(p.size for p in hard) >= 0.5 and max(p.size for p in hard) <= 1.0
    task = TASKS["bound"]
    assert task.largest_push(0.0) == task.push_limit[0] and task.largest_push(np.pi) == pytest.approx(
        task.push_limit[1]
    )
    assert task.largest_push(np.pi / 2) == task.largest_push(-np.pi / 2) == task.push_limit[2]


def test_a_seed_decides_everything():
    assert plan(7, 60.0) == plan(7, 60.0) and plan(7, 60.0) != plan(8, 60.0)


# -- Settings ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"hold": -1.0}, "weight of the move 'hold'"),
        (dict(QUIET), "at least one move"),
        ({"starts_released": 1.5}, "starts_released"),
        ({"deflection": -0.1}, "deflection"),
        ({"move_s": (2.0, 1.0)}, "move_s"),
        ({"stand_s": None}, "stand_s must be intervals"),
        ({"push_interval": 0.0}, "push_interval"),
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
