"""The gait clock read from the motion alone: on driven states, on a hand-made one, and what it is good for."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from experts import NMPCExpert
from experts.model import RobotModel
from experts.phase import SAMPLES, PhaseScales, _cycle, fit_phase
from go1_mtl_gym import GAITS, robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.state import RobotState

COMMANDS = {"slow": (0.1, 0.0, 0.0), "middle": (0.4, 0.1, 0.2), "fast": (0.8, 0.1, 0.5)}
EVERY = pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))


def apart(a: float, b: float) -> float:
    """Distance of two phases on the circle [cycles]."""
    return abs((a - b + 0.5) % 1.0 - 0.5)


def walked(task: str, command: tuple[float, ...], settle: int = 50, steps: int = 90) -> list[RobotState]:
    env = Go1Env(task)
    env.reset(seed=3, options={"command": command})
    states = []
    for step in range(settle + steps):
        if step >= settle:
            states.append(env.state)
        env.step(env.expert_action())
    return states


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


@pytest.mark.parametrize("task", GAITS)
@pytest.mark.parametrize("command", COMMANDS.values(), ids=list(COMMANDS))
def test_recovers_the_clock(model, task, command):
    states = walked(task, command)
    error = [apart(fit_phase(state, model).phase, state.phase) for state in states]
    assert np.median(error) < 0.02
    assert np.percentile(error, 95) < (0.075 if (task, command) == ("walk", COMMANDS["fast"]) else 0.06)


def test_fits_what_was_pushed(model, driven):
    """The driven states begin from a stand and are pushed half way; the two seconds in between are no steady gait."""
    error = [apart(fit_phase(state, model).phase, state.phase) for state in driven.states[2:]]
    assert np.median(error) < 0.03


def test_error_tells_the_gait(model):
    for task in GAITS:
        states = walked(task, COMMANDS["middle"], steps=30)
        error = {
            name: np.mean([fit_phase(replace(state, gait=gait), model).error for state in states])
            for name, gait in GAITS.items()
        }
        assert min(error, key=error.get) == task
        assert error[task] < 1.0


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
    cycle = _cycle(gait, 0.1, 0.0, (0.1, 0.3))
    step = gait.period / SAMPLES
    for values, rate, size in ((cycle.height, cycle.climb, 0.12), (cycle.place, cycle.speed - 1.0, 1.0)):
        numeric = (np.roll(values, -1, axis=0) - np.roll(values, 1, axis=0)) / (2 * step)
        assert np.abs(np.diff(values, axis=0, append=values[:1])).max() < size * gait.period
        error = np.abs(numeric - rate)
        assert np.median(error) < 0.02 * np.abs(rate).max()
    assert cycle.ground.min() == 0.0 and cycle.ground.max() == 1.0


def test_stance_foot_goes_from_half_a_stride_before_to_half_behind():
    gait = GAITS["trot"]
    cycle = _cycle(gait, 0.1, 0.003, (0.1, 0.3))
    leg = gait.leg_phase(np.arange(SAMPLES) / SAMPLES)
    stance = leg < gait.duty
    np.testing.assert_allclose(cycle.place[stance], gait.stance_s / 2 - leg[stance] * gait.period, atol=1e-12)
    assert not cycle.speed[stance].any() and not cycle.climb[stance].any()
    np.testing.assert_array_equal(cycle.height[stance], robot.FOOT_RADIUS)
    assert cycle.height.max() == pytest.approx(robot.FOOT_RADIUS + gait.swing_height, abs=2e-3)


def test_scales_matter(model):
    """With everything but the contacts ignored the answer is coarser, but not arbitrary."""
    others = ("height", "climb", "place", "speed", "level", "heave", "tilt", "rate")
    only = PhaseScales(**dict.fromkeys(others, 1e6))
    states = walked("walk", COMMANDS["middle"], steps=60)
    coarse = [apart(fit_phase(state, model, only).phase, state.phase) for state in states]
    fine = [apart(fit_phase(state, model).phase, state.phase) for state in states]
    assert np.mean(fine) < np.mean(coarse) < 0.2
