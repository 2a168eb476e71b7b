"""Swing feet: the arc's derivatives by finite differences, and the law around it."""

from dataclasses import replace

import numpy as np
import pytest

from experts.planning.footholds import FootholdRule
from experts.planning.swing import SwingRule, cubic, hump
from experts.robot_model import Dynamics, RobotModel
from go1_mtl_gym import GAITS, robot
from go1_mtl_gym.sensing.state import RobotState

EVERY = pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))
VELOCITY = np.array([0.5, -0.1])
PRESS, EARLY = 0.003, 0.1


def ahead(h: float) -> np.ndarray:
    """The same look-ahead for every leg."""
    return np.full(4, h)


@pytest.mark.parametrize("curve", [cubic, hump])
def test_curves_return_their_own_derivatives(curve):
    s, step = np.linspace(0.01, 0.99, 50), 1e-5
    (above, slope_above, _), (below, slope_below, _) = curve(s + step), curve(s - step)
    _, slope, bend = curve(s)
    np.testing.assert_allclose((above - below) / (2 * step), slope, atol=1e-6)
    np.testing.assert_allclose((slope_above - slope_below) / (2 * step), bend, atol=1e-6)


def test_cubic_starts_and_lands_at_rest():
    left, rate, _ = cubic(np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(left, [1, 0.5, 0])
    np.testing.assert_allclose(rate, [0, -1.5, 0])


def test_hump_is_one_in_the_middle():
    height, climb, _ = hump(np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(height, [0, 1, 0])
    np.testing.assert_allclose(climb, 0, atol=1e-12)


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


def moving(standing, model, gait, seconds: float, phase: float) -> tuple[RobotState, Dynamics]:
    """State and dynamics of a body that has glided on at the commanded velocity since `phase`."""
    state = replace(standing, gait=gait, phase=phase + seconds / gait.period, command=np.array([*VELOCITY, 0.0]))
    dynamics = model.dynamics(standing)
    return state, replace(dynamics, com_w=dynamics.com_w + np.array([*VELOCITY, 0.0]) * seconds)


def answer(rule: SwingRule, state, dynamics, h=0.0) -> np.ndarray:
    return rule.acceleration(state, ahead(h), dynamics, VELOCITY, FootholdRule())


def arc(state, dynamics: Dynamics, h=0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nominal position, velocity and acceleration, from the law's answers with one gain at a time, foot at zero."""
    still = replace(dynamics, feet_w=np.zeros((4, 3)), feet_velocity_w=np.zeros((4, 3)))

    def one(stiffness, damping):
        return answer(SwingRule(stiffness, damping, PRESS, EARLY), state, still, h)

    forward = one(0.0, 0.0)
    return one(1.0, 0.0) * (1 + h**2 / 2) - forward, one(0.0, 1.0) * (1 + h) - forward, forward


@EVERY
def test_velocity_and_feed_forward_are_derivatives_of_the_position(standing, model, gait):
    step = 1e-5
    for leg in range(4):
        for s in (0.1, 0.4, 0.55, 0.8, 0.95):
            phase = gait.duty + s * (1 - gait.duty) - gait.offsets[leg]
            before, now, after = (arc(*moving(standing, model, gait, t, phase)) for t in (-step, 0.0, step))
            numeric = (after[0] - before[0])[leg] / (2 * step)
            np.testing.assert_allclose(now[1][leg], numeric, atol=1e-5)
            np.testing.assert_allclose(now[2][leg], (after[1] - before[1])[leg] / (2 * step), atol=2e-3)


@EVERY
def test_arc_leads_from_one_stride_behind_to_the_foothold(standing, model, gait):
    leg, rule = 0, FootholdRule()
    ends = {}
    for s in (1e-9, 0.45, 0.9 - 1e-9):  # the last tenth of the swing is spent waiting on the ground
        phase = gait.duty + s * (1 - gait.duty) - gait.offsets[leg]
        state, dynamics = moving(standing, model, gait, 0.0, phase)
        landing = rule.plan(state, dynamics.com_w, VELOCITY, (1 - s) * gait.swing_s)[leg]
        position, velocity, _ = arc(state, dynamics)
        ends[s] = position[leg] - landing, velocity[leg]
    lift_off, middle, touchdown = ends.values()
    np.testing.assert_allclose(lift_off[0][:2], -VELOCITY * gait.period, atol=1e-6)
    np.testing.assert_allclose(middle[0][:2], -VELOCITY * gait.period / 2, atol=1e-9)
    np.testing.assert_allclose(touchdown[0], [0, 0, -PRESS], atol=1e-6)
    assert middle[0][2] == pytest.approx(gait.swing_height - PRESS / 4)
    np.testing.assert_allclose(lift_off[1], 0, atol=1e-6)
    np.testing.assert_allclose(touchdown[1], [0, 0, -2 * PRESS / (0.9 * gait.swing_s[leg])], atol=1e-6)


@EVERY
def test_foot_waits_on_the_ground_at_the_end_of_the_swing(standing, model, gait):
    for s in (0.9 + 1e-9, 0.95, 1 - 1e-9):
        state, dynamics = moving(standing, model, gait, 0.0, gait.duty + s * (1 - gait.duty) - gait.offsets[0])
        position, velocity, forward = arc(state, dynamics)
        landing = FootholdRule().plan(state, dynamics.com_w, VELOCITY, (1 - s) * gait.swing_s)[0]
        np.testing.assert_allclose(position[0], landing - [0, 0, PRESS], atol=1e-9)
        assert not velocity[0].any() and not forward[0].any()


def test_a_turning_body_swings_its_feet_along_a_circle(standing, model):
    """At 1 rad/s on the spot the foothold's arm r is carried i r per second: so is the stride, times the period."""
    gait, s = GAITS["trot"], 1e-9
    state, dynamics = moving(standing, model, gait, 0.0, gait.duty + s * (1 - gait.duty))
    state, still = replace(state, command=np.array([0.0, 0.0, 1.0])), np.zeros(2)
    on_ground = replace(dynamics, feet_w=np.zeros((4, 3)), feet_velocity_w=np.zeros((4, 3)))
    rules = (SwingRule(k, 0.0, PRESS, EARLY) for k in (0.0, 1.0))
    both = [rule.acceleration(state, ahead(0.0), on_ground, still, FootholdRule()) for rule in rules]
    landing = FootholdRule().plan(state, dynamics.com_w, still, (1 - s) * gait.swing_s)[0]
    arm = landing - dynamics.com_w
    stride = landing - (both[1] - both[0])[0]
    np.testing.assert_allclose(stride[:2], gait.period * np.array([-arm[1], arm[0]]), atol=1e-6)


def test_on_the_arc_the_answer_is_the_feed_forward(standing, model):
    state, dynamics = moving(standing, model, GAITS["trot"], 0.0, 0.7)
    position, velocity, forward = arc(state, dynamics)
    on_arc = replace(dynamics, feet_w=position, feet_velocity_w=velocity)
    np.testing.assert_allclose(answer(SwingRule(press=PRESS, early=EARLY), state, on_arc), forward, atol=1e-9)


def test_off_the_arc_it_is_a_pd_law(standing, model):
    state, dynamics = moving(standing, model, GAITS["trot"], 0.0, 0.7)
    position, velocity, forward = arc(state, dynamics)
    off = np.random.default_rng(0).normal(0, 0.02, (2, 4, 3))
    away = replace(dynamics, feet_w=position + off[0], feet_velocity_w=velocity + off[1])
    got = answer(SwingRule(400.0, 40.0, PRESS, EARLY), state, away)
    np.testing.assert_allclose(got, forward - 400 * off[0] - 40 * off[1], atol=1e-9)


@EVERY
@pytest.mark.parametrize("h", [0.002, 0.01])
def test_looking_ahead_the_answer_solves_its_own_equation(standing, model, gait, h):
    """a = a_arc + k (p_arc - p - v h - a h^2/2) + d (v_arc - v - a h), with the arc of a moment h later."""
    k, d = 400.0, 40.0
    state, dynamics = moving(standing, model, gait, 0.0, gait.duty + 0.3 * (1 - gait.duty) - gait.offsets[0])
    later = arc(*moving(standing, model, gait, h, state.phase))
    for here, there in zip(arc(state, dynamics, h), later):
        np.testing.assert_allclose(here[0], there[0], atol=1e-9)
    p, v = dynamics.feet_w, np.random.default_rng(1).normal(0, 0.5, (4, 3))
    a = answer(SwingRule(k, d, PRESS, EARLY), state, replace(dynamics, feet_velocity_w=v), h)
    p_arc, v_arc, a_arc = later
    expected = a_arc + k * (p_arc - p - v * h - a * h**2 / 2) + d * (v_arc - v - a * h)
    np.testing.assert_allclose(a[0], expected[0], atol=1e-6)
    without = answer(SwingRule(k, d, PRESS, EARLY), state, replace(dynamics, feet_velocity_w=v))
    assert np.abs(without - a)[0].max() > 1.0, "looking ahead matters"


def test_feet_clear_the_ground_during_the_swing(standing, model):
    for gait in GAITS.values():
        for s in np.linspace(0.05, 0.8, 10):
            state, dynamics = moving(standing, model, gait, 0.0, gait.duty + s * (1 - gait.duty) - gait.offsets[0])
            assert arc(state, dynamics)[0][0, 2] > robot.FOOT_RADIUS


def test_a_foot_is_lifted_as_much_higher_as_feet_sink_in(standing, model):
    gait = GAITS["trot"]
    state = replace(standing, gait=gait, phase=0.5 * (1.0 + gait.duty))
    rule, dynamics = SwingRule(stiffness=400.0), model.dynamics(standing)
    on_hard, on_soft = answer(rule, state, dynamics), answer(rule, replace(state, foot_sink=0.01), dynamics)
    leg = int(np.argmin(gait.stance(state.phase)))
    s = (gait.leg_phase(state.phase)[leg] - gait.duty) / (1 - gait.duty) / (1 - rule.early)
    lift, climb, bend = hump(np.array([s]))
    time = gait.swing_s * (1 - rule.early)
    expected = 0.01 * (bend / time**2 + rule.damping * climb / time + rule.stiffness * lift)
    assert on_soft[leg, 2] - on_hard[leg, 2] == pytest.approx(expected[0], rel=1e-6)
    np.testing.assert_array_equal(on_soft[:, :2], on_hard[:, :2])
