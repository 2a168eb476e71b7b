"""What hands do in an episode."""

import numpy as np
import pytest

from go1_mtl_gym import TASKS, GaitSpace
from go1_mtl_gym.tasks import ANY_GAIT
from trainers.data.operator import MOVES, OperatorConfig
from trainers.data.operator_plan import RELEASED, draw_plan

ALL = tuple(TASKS)[:6]
QUIET = dict.fromkeys(MOVES, 0.0)
LONG_S = 4000.0


def plan(seed=0, seconds=LONG_S, task="trot", tasks=ALL, **settings):
    return draw_plan(OperatorConfig(**settings), task, tasks, seconds, np.random.default_rng(seed))


def only(move, **settings):
    return plan(**QUIET | {move: 1.0}, starts_released=1.0, **settings)


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
    harder = [push for push in plan(hard_push_interval=4.0, hard_push=1.2).pushes if push.hard]
    assert [p.size for p in harder] == pytest.approx([1.2 * p.size for p in hard])
    task = TASKS["bound"]
    assert task.largest_push(0.0) == task.push_limit[0] and task.largest_push(np.pi) == pytest.approx(
        task.push_limit[1]
    )
    assert task.largest_push(np.pi / 2) == task.largest_push(-np.pi / 2) == task.push_limit[2]


def test_a_seed_decides_everything():
    assert plan(7, 60.0) == plan(7, 60.0) and plan(7, 60.0) != plan(8, 60.0)


# -- Any gait ----------------------------------------------------------------------------------------------------------


def test_where_any_gait_can_be_every_change_asks_for_another():
    space = GaitSpace()
    rng = np.random.default_rng(2)
    drawn = draw_plan(OperatorConfig(), ANY_GAIT, (ANY_GAIT,), 400.0, rng, space)
    assert len(drawn.changes) == len(drawn.gaits) > 40
    assert {task for _, task in drawn.changes} == {ANY_GAIT}
    assert all(space.contains(asked.gait) for asked in drawn.gaits)
    assert len({asked.gait for asked in drawn.gaits}) == len(drawn.gaits)
    slews = np.array([asked.slew_s for asked in drawn.gaits])
    assert 0.3 < (slews == 0.0).mean() < 0.7 and 0.0 < slews[slews > 0].min() < slews.max() <= 1.0
    first, second = drawn.changes[0][0], drawn.changes[1][0]
    assert drawn.gaits_in(0.0, first) == [drawn.gaits[0]] and drawn.gaits_in(first, second) == [drawn.gaits[1]]


def test_hands_move_alike_whether_or_not_gaits_are_drawn():
    named = plan(seconds=100.0)
    any_gait = draw_plan(OperatorConfig(), ANY_GAIT, (ANY_GAIT,), 100.0, np.random.default_rng(0), GaitSpace())
    assert named.segments == any_gait.segments and named.pushes == any_gait.pushes and not named.gaits
    calm = OperatorConfig().of_one_gait()
    assert not draw_plan(calm, ANY_GAIT, (ANY_GAIT,), 100.0, np.random.default_rng(0), GaitSpace()).gaits
