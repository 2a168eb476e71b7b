"""The gait clock read from the motion alone: on driven states, on a hand-made one, and what it is good for."""

from dataclasses import replace
from functools import lru_cache

import mujoco
import numpy as np
import pytest

from experts import NMPCExpert
from experts.phase_fitting import LAG_S, SAMPLES, TRAIL_S, PhaseScales, _cycle, _residuals, fit_phase
from experts.planning.nominal_motion import nominal_motion
from experts.planning.swing import SwingRule
from experts.robot_model import RobotModel
from go1_mtl_gym import GAITS, robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.sensing.state import RobotState

MIDDLE = (0.4, 0.1, 0.2)
FAST = (0.5, 0.2, 0.5)
SWING, HEIGHT = SwingRule(press=0.003, early=0.1), 0.28
EVERY = pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))


def apart(a: float, b: float) -> float:
    """Distance of two phases on the circle [cycles]."""
    return abs((a - b + 0.5) % 1.0 - 0.5)


@lru_cache
def walked(task: str, command: tuple[float, ...]) -> list[RobotState]:
    """The second and third second, nearly, of an episode."""
    env = Go1Env(task)
    env.reset(seed=3, options={"command": command})
    states = []
    for step in range(140):
        if step >= 50:
            states.append(env.state)
        env.step(env.expert_action())
    return states


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


@pytest.mark.parametrize("task", GAITS)
@pytest.mark.parametrize("fast", [False, True], ids=["middle", "fast"])
def test_recovers_the_clock(model, task, fast):
    states = walked(task, FAST if fast else MIDDLE)
    error = [apart(fit_phase(state, model).phase, state.phase) for state in states]
    assert np.median(error) < 0.02
    assert np.percentile(error, 95) < 0.08


@pytest.mark.parametrize("task", GAITS)
def test_is_less_sure_when_the_robot_hardly_moves(model, task):
    """A slow walk looks much the same a quarter of a cycle later while all its feet are down."""
    states = walked(task, (0.1, 0.0, 0.0))
    error = [apart(fit_phase(state, model).phase, state.phase) for state in states]
    assert np.median(error) < 0.025
    assert np.percentile(error, 80 if task == "walk" else 95) < 0.12


def test_fits_what_was_pushed(model, driven):
    """The driven states begin from a stand and are pushed half way; the two seconds in between are no steady gait."""
    error = [apart(fit_phase(state, model).phase, state.phase) for state in driven.states[2:]]
    assert np.median(error) < 0.03


def test_error_tells_the_gait(model):
    for task in GAITS:
        states = walked(task, MIDDLE)[:30:2]
        error = {
            name: np.mean([fit_phase(replace(state, gait=gait), model).error for state in states])
            for name, gait in GAITS.items()
        }
        assert min(error, key=error.get) == task
        assert error[task] < (1.5 if task == "walk" else 0.8)


def test_the_clock_and_the_place_do_not_matter(model, driven):
    cos, sin = np.cos(2.0), np.sin(2.0)
    turn, quat = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]), np.empty(4)
    for state in driven.states:
        mujoco.mju_mulQuat(quat, np.array([np.cos(1.0), 0, 0, np.sin(1.0)]), state.quat_wxyz)
        elsewhere = replace(
            state,
            phase=(state.phase + 0.37) % 1.0,
            position_w=turn @ state.position_w + [30.0, -20.0, 0.0],
            quat_wxyz=quat.copy(),
            linear_velocity_w=turn @ state.linear_velocity_w,
        )
        here, there = fit_phase(state, model), fit_phase(elsewhere, model)
        assert apart(here.phase, there.phase) < 1e-9
        assert here.error == pytest.approx(there.error, rel=1e-9)


def test_same_state_same_bits(model, driven):
    for state in driven.states:
        assert fit_phase(state, model) == fit_phase(state) == fit_phase(state, RobotModel())


def test_a_wrong_clock_is_put_right(driven):
    """Labels for states whose clock is a quarter of a cycle off: useless as they are, good after a fit."""
    model, expert = RobotModel(), NMPCExpert()
    shifted, fitted = [], []
    for state in driven.states[2:]:
        right = expert.action(state)
        wrong = replace(state, phase=(state.phase + 0.25) % 1.0)
        shifted.append(np.abs(expert.action(wrong) - right).mean())
        fitted.append(np.abs(expert.action(replace(wrong, phase=fit_phase(wrong, model).phase)) - right).mean())
    assert np.median(fitted) < 0.35 * np.median(shifted)


@EVERY
def test_cycle_is_continuous_and_its_velocities_are_derivatives(gait):
    cycle = _cycle(gait, SwingRule(press=0.0), HEIGHT)
    step = gait.period / SAMPLES
    for values, rate, size in ((cycle.height, cycle.climb, 0.12), (cycle.place, cycle.speed - 1.0, 1.0)):
        numeric = (np.roll(values, -1, axis=0) - np.roll(values, 1, axis=0)) / (2 * step)
        assert np.abs(np.diff(values, axis=0, append=values[:1])).max() < size * gait.period
        error = np.abs(numeric - rate)
        assert np.median(error) < 0.02 * np.abs(rate).max()
    assert cycle.ground.min() == 0.0 and cycle.ground.max() == 1.0


def test_stance_foot_goes_from_half_a_stride_before_to_half_behind():
    gait = GAITS["trot"]
    cycle = _cycle(gait, SWING, HEIGHT)
    leg = gait.leg_phase(np.arange(SAMPLES) / SAMPLES - LAG_S / gait.period)
    stance = leg < gait.duty
    where = (gait.stance_s / 2 - leg * gait.period - TRAIL_S)[stance]
    np.testing.assert_allclose(cycle.place[stance], where, atol=1e-12)
    assert not cycle.speed[stance].any() and not cycle.climb[stance].any()
    np.testing.assert_array_equal(cycle.height[stance], robot.FOOT_RADIUS)
    assert cycle.height.min() == robot.FOOT_RADIUS, "a foot does not sink"
    assert cycle.height.max() == pytest.approx(robot.FOOT_RADIUS + gait.swing_height, abs=2e-3)


def test_a_pacing_bodys_feet_are_drawn_aside_by_the_sway():
    """Left feet stand for .176 s while the body, pushed to the right by them, comes back from the left side."""
    gait = GAITS["pace"]
    cycle, motion = _cycle(gait, SWING, HEIGHT), nominal_motion(gait, (0.127, 0.394, 0.423), 0.257)
    assert np.abs(cycle.drawn.imag).max() < np.ptp(motion.position[:, 4]) + 1e-9
    assert np.abs(cycle.drawn.imag).max() > 0.3 * np.ptp(motion.position[:, 4]) > 1e-3
    swinging = ~gait.stance(np.arange(SAMPLES) / SAMPLES - LAG_S / gait.period)
    assert not cycle.drawn[swinging].any()
    np.testing.assert_allclose(cycle.sway.imag, motion.velocity[:, 4], atol=1e-3)


def test_the_sway_explains_where_a_pacing_robots_feet_are(model):
    """Sideways places at the true phase fit better with the sway than without it, and worst with it reversed."""
    cycle, left = _cycle(GAITS["pace"], SwingRule(), HEIGHT), []
    for state in walked("pace", (0.3, 0.0, 0.0)):
        now = round(state.phase * SAMPLES) % SAMPLES
        stance = state.gait.stance(state.phase)
        for sign in (1, 0, -1):
            residuals = _residuals(state, model, replace(cycle, drawn=sign * cycle.drawn), PhaseScales(), HEIGHT)
            left.append(np.square(residuals[now, 16:20][stance]).sum())
    with_sway, without, reversed_sway = np.reshape(left, (-1, 3)).mean(axis=0)
    assert with_sway < without < reversed_sway


def test_the_foot_is_down_when_its_arc_meets_the_ground_by_hand():
    """16 h s^2 (1 - s)^2 = press s^2 at s = 1 - sqrt(press / 16 h): .944 for 3 mm and 60 mm."""
    gait = GAITS["trot"]
    cycle, s = _cycle(gait, SWING, HEIGHT), 1 - np.sqrt(0.003 / 0.96)
    leg = gait.leg_phase(np.arange(SAMPLES) / SAMPLES - LAG_S / gait.period)
    meets = gait.duty + s * 0.9 * (1 - gait.duty)
    for foot in range(4):
        in_air = cycle.height[:, foot] > robot.FOOT_RADIUS
        assert leg[in_air, foot].max() < meets < leg[in_air, foot].max() + 1.001 / SAMPLES
        near = np.abs(leg[:, foot] - meets) < 0.5 / SAMPLES + 1e-9
        np.testing.assert_allclose(cycle.ground[near, foot], 0.5, atol=0.1)


def test_scales_matter(model):
    """With everything but the contacts ignored the answer is coarser, but not arbitrary."""
    others = ("height", "climb", "place", "speed", "level", "heave", "sway", "tilt", "rate")
    only = PhaseScales(**dict.fromkeys(others, 1e6))
    states = walked("walk", MIDDLE)[:60]
    coarse = [apart(fit_phase(state, model, only).phase, state.phase) for state in states]
    fine = [apart(fit_phase(state, model).phase, state.phase) for state in states]
    assert np.mean(fine) < np.mean(coarse) < 0.2


def test_the_old_module_still_answers_and_says_where_to_go():
    with pytest.warns(DeprecationWarning, match=r"experts\.phase_fitting\.fit_phase") as warned:
        from experts.phase import fit_phase as by_its_old_name
    assert by_its_old_name is fit_phase
    assert {warning.filename for warning in warned} == {__file__}, "the line that should change"
    with pytest.raises(ImportError, match="nothing"):
        from experts.phase import nothing  # noqa: F401
