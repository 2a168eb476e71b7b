"""Swing feet: the arc's derivatives by finite differences, and the PD law around it."""

from dataclasses import replace

import numpy as np
import pytest

from experts.footholds import FootholdRule
from experts.model import Dynamics, RobotModel
from experts.swing import SwingRule, _hump, _quintic
from go1_mtl_gym import GAITS, robot

EVERY = pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))
VELOCITY = np.array([0.5, -0.1, 0.0])


@pytest.mark.parametrize("curve", [_quintic, _hump])
def test_curves_return_their_own_derivatives(curve):
    s, step = np.linspace(0.01, 0.99, 50), 1e-5
    (above, slope_above, _), (below, slope_below, _) = curve(s + step), curve(s - step)
    _, slope, bend = curve(s)
    np.testing.assert_allclose((above - below) / (2 * step), slope, atol=1e-6)
    np.testing.assert_allclose((slope_above - slope_below) / (2 * step), bend, atol=1e-6)


def test_quintic_starts_and_lands_at_rest():
    left, rate, bend = _quintic(np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(left, [1, 0.5, 0])
    np.testing.assert_allclose(rate[[0, 2]], 0)
    np.testing.assert_allclose(bend, 0, atol=1e-12)


def test_hump_is_one_in_the_middle():
    height, climb, _ = _hump(np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(height, [0, 1, 0])
    np.testing.assert_allclose(climb, 0, atol=1e-12)


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


def moving(standing, model, gait, seconds: float, phase: float, command=VELOCITY) -> tuple:
    """State and dynamics of a body that has glided on at the commanded velocity since `phase`."""
    state = replace(standing, gait=gait, phase=phase + seconds / gait.period, command=np.array([*command[:2], 0.0]))
    dynamics = replace(model.dynamics(standing), com_velocity_w=VELOCITY.copy())
    return state, replace(dynamics, com_w=dynamics.com_w + VELOCITY * seconds)


def arc(state, dynamics: Dynamics, press=0.003) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The nominal position, velocity and acceleration, from the law's answers with one gain at a time."""
    still = replace(dynamics, feet_w=np.zeros((4, 3)), feet_velocity_w=np.zeros((4, 3)))

    def answer(stiffness, damping):
        return SwingRule(stiffness, damping, press).acceleration(state, still, FootholdRule())

    forward = answer(0.0, 0.0)
    return answer(1.0, 0.0) - forward, answer(0.0, 1.0) - forward, forward


@EVERY
def test_velocity_and_feed_forward_are_derivatives_of_the_position(standing, model, gait):
    step = 1e-4
    for leg in range(4):
        for s in (0.1, 0.4, 0.55, 0.8, 0.95):
            phase = gait.duty + s * (1 - gait.duty) - gait.offsets[leg]
            before, now, after = (arc(*moving(standing, model, gait, t, phase)) for t in (-step, 0.0, step))
            numeric = (after[0] - before[0])[leg] / (2 * step)
            np.testing.assert_allclose(now[1][leg], numeric, atol=1e-4)
            np.testing.assert_allclose(now[2][leg], (after[1] - before[1])[leg] / (2 * step), atol=2e-2)


@EVERY
def test_arc_leads_from_one_stride_behind_to_the_foothold(standing, model, gait):
    leg, rule = 0, FootholdRule()
    ends = {}
    for s in (1e-9, 0.45, 0.9 - 1e-9):  # the last tenth of the swing is spent waiting on the ground
        phase = gait.duty + s * (1 - gait.duty) - gait.offsets[leg]
        state, dynamics = moving(standing, model, gait, 0.0, phase)
        remaining = np.full(4, (1 - s) * gait.swing_s)
        landing = rule.plan(state, dynamics.com_w, dynamics.com_velocity_w, remaining)[leg]
        position, velocity, _ = arc(state, dynamics)
        ends[s] = position[leg] - landing, velocity[leg]
    lift_off, middle, touchdown = ends.values()
    np.testing.assert_allclose(lift_off[0][:2], -VELOCITY[:2] * gait.period, atol=1e-6)
    np.testing.assert_allclose(touchdown[0], [0, 0, -0.003], atol=1e-6)
    assert middle[0][2] == pytest.approx(gait.swing_height - 0.003 / 4)
    np.testing.assert_allclose(lift_off[1], 0, atol=1e-6)
    np.testing.assert_allclose(touchdown[1], [0, 0, -2 * 0.003 / (0.9 * gait.swing_s)], atol=1e-6)


@EVERY
def test_foot_waits_on_the_ground_at_the_end_of_the_swing(standing, model, gait):
    for s in (0.9 + 1e-9, 0.95, 1 - 1e-9):
        state, dynamics = moving(standing, model, gait, 0.0, gait.duty + s * (1 - gait.duty) - gait.offsets[0])
        position, velocity, forward = arc(state, dynamics)
        landing = FootholdRule().plan(state, dynamics.com_w, VELOCITY, np.full(4, (1 - s) * gait.swing_s))[0]
        np.testing.assert_allclose(position[0], landing - [0, 0, 0.003], atol=1e-9)
        assert not velocity[0].any() and not forward[0].any()


def test_on_the_arc_the_answer_is_the_feed_forward(standing, model):
    state, dynamics = moving(standing, model, GAITS["trot"], 0.0, 0.7)
    position, velocity, forward = arc(state, dynamics)
    on_arc = replace(dynamics, feet_w=position, feet_velocity_w=velocity)
    np.testing.assert_allclose(SwingRule().acceleration(state, on_arc, FootholdRule()), forward, atol=1e-9)


def test_off_the_arc_it_is_a_pd_law(standing, model):
    state, dynamics = moving(standing, model, GAITS["trot"], 0.0, 0.7)
    position, velocity, forward = arc(state, dynamics)
    off = np.random.default_rng(0).normal(0, 0.02, (2, 4, 3))
    away = replace(dynamics, feet_w=position + off[0], feet_velocity_w=velocity + off[1])
    answer = SwingRule(400.0, 40.0).acceleration(state, away, FootholdRule())
    np.testing.assert_allclose(answer, forward - 400 * off[0] - 40 * off[1], atol=1e-9)


def test_feet_clear_the_ground_during_the_swing(standing, model):
    for gait in GAITS.values():
        for s in np.linspace(0.05, 0.8, 10):
            state, dynamics = moving(standing, model, gait, 0.0, gait.duty + s * (1 - gait.duty) - gait.offsets[0])
            assert arc(state, dynamics)[0][0, 2] > robot.FOOT_RADIUS
