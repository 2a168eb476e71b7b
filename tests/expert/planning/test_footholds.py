"""Footholds against Raibert's rule worked by hand."""

from dataclasses import replace

import numpy as np
import pytest

from experts.planning.footholds import FootholdRule, next_touchdown
from go1_mtl_gym import GAITS, robot
from go1_mtl_gym.errors import InvalidInputError

COM = np.array([1.0, 2.0, 0.28])
NOW, STILL = np.zeros(4), np.zeros(2)


def test_standing_still_lands_under_the_hips(standing):
    feet = FootholdRule().plan(standing, COM, STILL, NOW)
    np.testing.assert_allclose(feet, COM * [1, 1, 0] + robot.NOMINAL_FOOT_B + [0, 0, 0.023], atol=1e-12)


def test_a_narrow_gait_lands_narrow(standing):
    feet = FootholdRule().plan(replace(standing, gait=GAITS["pace"]), COM, STILL, NOW) - COM
    np.testing.assert_allclose(feet[:, :2], robot.NOMINAL_FOOT_B[:, :2] * [1.0, 0.7], atol=1e-12)


def test_raiberts_numbers_by_hand(standing):
    state = replace(standing, command=np.array([0.5, 0.0, 0.0]))  # trot: .22 s of stance
    feet = FootholdRule(velocity_gain=0.1).plan(state, COM, np.array([0.4, 0.1]), np.array([0.0, 0.1, 0.1, 0.0]))
    half_stance, feedback = np.array([0.4, 0.1]) * 0.11, 0.1 * np.array([-0.1, 0.1])
    step = half_stance + feedback
    np.testing.assert_allclose(feet[0, :2], [1 + 0.1881 + step[0], 2 + 0.12675 + step[1]])
    np.testing.assert_allclose(feet[1, :2], [1.04 + 0.1881 + step[0], 2.01 - 0.12675 + step[1]])
    np.testing.assert_array_equal(feet[:, 2], robot.FOOT_RADIUS)


def test_turning_moves_the_hips_sideways(standing):
    state = replace(standing, command=np.array([0.0, 0.0, 1.0]))
    feet = FootholdRule().plan(state, COM, STILL, np.full(4, 0.2)) - COM
    for foot, arm in zip(feet, robot.NOMINAL_FOOT_B):
        cos, sin = np.cos(0.2), np.sin(0.2)  # the yaw at touchdown
        arm = np.array([cos * arm[0] - sin * arm[1], sin * arm[0] + cos * arm[1]])
        np.testing.assert_allclose(foot[:2], arm + 0.11 * np.array([-arm[1], arm[0]]), atol=1e-12)


def test_commands_follow_the_heading(standing):
    quarter = np.array([np.sqrt(0.5), 0, 0, np.sqrt(0.5)])
    state = replace(standing, command=np.array([0.5, 0.0, 0.0]), quat_wxyz=quarter)
    feet = FootholdRule().plan(state, COM, np.array([0.0, 0.5]), NOW)
    np.testing.assert_allclose(feet[0, :2], [1 - 0.12675, 2 + 0.1881 + 0.055], atol=1e-12)


def test_a_step_is_no_longer_than_the_reach(standing):
    rule = FootholdRule(velocity_gain=0.1, reach=0.22)
    still = rule.plan(standing, COM, STILL, NOW)
    for velocity, length in (((1.0, 0.0), 0.21), ((3.0, 4.0), 0.22), ((-30.0, 40.0), 0.22)):
        step = (rule.plan(standing, COM, np.array(velocity), NOW) - still)[:, :2]
        np.testing.assert_allclose(np.linalg.norm(step, axis=1), length)
        np.testing.assert_allclose(step @ velocity, length * np.linalg.norm(velocity), err_msg="direction")


def test_any_number_of_touchdowns_at_once(standing):
    state = replace(standing, command=np.array([0.3, 0.1, 0.4]))
    times = np.random.default_rng(0).uniform(0, 0.5, (6, 4))
    velocity = np.array([0.2, 0.0])
    together = FootholdRule().plan(state, COM, velocity, times)
    np.testing.assert_array_equal(together, [FootholdRule().plan(state, COM, velocity, row) for row in times])


def test_next_touchdown_by_hand():
    """A trot of .4 s at phase .3: FL and RR stand since .0 and come again at 1.0, FR and RL begin at .5."""
    times = next_touchdown(GAITS["trot"], 0.3, np.array([0.35, 0.6, 1.1]))
    expected = 0.4 * np.array([[-0.3, -0.8, -0.8, -0.3], [-0.3, 0.2, 0.2, -0.3], [0.7, 0.2, 0.2, 0.7]])
    np.testing.assert_allclose(times, expected, atol=1e-12)


@pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))
@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7])
def test_stance_feet_stay_and_later_stances_stand_on_planned_footholds(standing, gait, phase):
    state = replace(standing, gait=gait, phase=phase, command=np.array([0.5, 0.0, 0.2]))
    rule, velocity, feet_now = FootholdRule(), np.array([0.4, 0.0]), np.full((4, 3), 77.0)
    middle = phase + (np.arange(32) + 0.5) / 16  # two cycles
    feet = rule.over_horizon(state, COM, velocity, feet_now, middle)
    stance = gait.stance(middle)
    for leg in range(4):
        touchdowns = set()
        for k in np.flatnonzero(stance[:, leg]):
            began = np.floor(middle[k] + gait.offsets[leg]) - gait.offsets[leg]  # the clock when this stance began
            if began <= phase:
                assert (feet[k, leg] == 77.0).all()
                continue
            time = np.full(4, (began - phase) * gait.period)
            np.testing.assert_allclose(feet[k, leg], rule.plan(state, COM, velocity, time)[leg], atol=1e-9)
            touchdowns.add(round(time[0], 6))
        assert 1 <= len(touchdowns) <= 2, "two cycles hold one or two later stances"


def test_a_standing_robots_feet_stay_for_good(standing):
    feet_now = np.arange(12.0).reshape(4, 3)
    feet = FootholdRule().over_horizon(standing, COM, STILL, feet_now, np.arange(16) / 16)
    np.testing.assert_array_equal(feet, np.tile(feet_now, (16, 1, 1)))


def test_impossible_figures_are_refused():
    for name, value in (("velocity_gain", -1.0), ("reach", 0.0), ("reach", float("nan"))):
        with pytest.raises(InvalidInputError, match=name):
            FootholdRule(**{name: value})
