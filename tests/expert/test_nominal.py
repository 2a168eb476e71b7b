"""The nominal motion of a gait: loads that carry the weight, and the motion under them."""

import numpy as np
import pytest

from experts.model import RobotModel
from experts.nominal import SAMPLES, NominalMotion, nominal_motion
from go1_mtl_gym import GAITS, robot
from go1_mtl_gym.gaits import Gait

INERTIA = (0.127, 0.394)
EVERY = pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))


def motion(gait: Gait) -> NominalMotion:
    return nominal_motion(gait, *INERTIA)


@EVERY
def test_feet_carry_the_weight_on_average_and_nothing_in_the_air(gait):
    load, stance = motion(gait).load, gait.stance(np.arange(SAMPLES) / SAMPLES)
    assert load.sum(axis=1).mean() == pytest.approx(1.0, abs=2e-3)
    assert (load[~stance] == 0).all() and (load >= 0).all()
    supported = stance.any(axis=1)
    np.testing.assert_allclose(load.sum(axis=1), np.where(supported, 1 / supported.mean(), 0), atol=2e-3)


def test_jump_pushes_harder_to_make_up_for_its_flight():
    load = motion(GAITS["jump"]).load
    on_ground = load.sum(axis=1) > 0
    np.testing.assert_allclose(load[on_ground], 0.25 / on_ground.mean(), rtol=1e-3)
    assert on_ground.mean() == pytest.approx(0.55, abs=0.01)


def test_trot_shares_the_load_between_the_diagonal_feet():
    load = motion(GAITS["trot"]).load_at(np.array([0.25, 0.75]))
    np.testing.assert_allclose(load, [[0.5, 0, 0, 0.5], [0, 0.5, 0.5, 0]], atol=1e-4)


@EVERY
def test_velocity_is_the_derivative_of_position(gait):
    nominal = motion(gait)
    dt = gait.period / SAMPLES
    moved = nominal.position - np.roll(nominal.position, 1, axis=0)
    mean = (nominal.velocity + np.roll(nominal.velocity, 1, axis=0)) / 2
    np.testing.assert_allclose(moved, mean * dt, atol=1e-9)


@EVERY
def test_acceleration_is_newtons_and_eulers(gait):
    nominal = motion(gait)
    weight, arm = robot.MASS * robot.GRAVITY, robot.NOMINAL_FOOT_B
    expected = np.stack(
        [
            weight * nominal.load @ arm[:, 1] / INERTIA[0],
            -weight * nominal.load @ arm[:, 0] / INERTIA[1],
            9.81 * (nominal.load.sum(axis=1) - 1),
        ],
        axis=1,
    )
    expected = (expected + np.roll(expected, 1, axis=0)) / 2 - expected.mean(axis=0)
    numeric = (nominal.velocity - np.roll(nominal.velocity, 1, axis=0)) * (SAMPLES / gait.period)
    np.testing.assert_allclose(numeric, expected, atol=1e-8)


@EVERY
def test_motion_is_periodic_about_zero(gait):
    nominal = motion(gait)
    for samples in (nominal.position, nominal.velocity):
        np.testing.assert_allclose(samples.mean(axis=0), 0, atol=1e-12)
    phase = np.random.default_rng(0).uniform(0, 1, 20)
    for a, b in zip(nominal.at(phase), nominal.at(phase + 2)):
        np.testing.assert_allclose(a, b, atol=1e-10)
    before, after = nominal.at(np.array([1 - 1e-9])), nominal.at(np.array([0.0]))
    np.testing.assert_allclose(before[0], after[0], atol=1e-6)


@EVERY
def test_interpolation_passes_through_the_samples(gait):
    nominal = motion(gait)
    position, velocity = nominal.at(np.arange(SAMPLES) / SAMPLES)
    np.testing.assert_allclose(position, nominal.position, atol=1e-12)
    np.testing.assert_allclose(velocity, nominal.velocity, atol=1e-12)
    middle, _ = nominal.at((np.arange(SAMPLES) + 0.5) / SAMPLES)
    np.testing.assert_allclose(middle, (nominal.position + np.roll(nominal.position, -1, axis=0)) / 2, atol=1e-12)


def test_trot_is_level_bound_pitches_and_jump_hops():
    level, bound, jump = (motion(GAITS[name]).position for name in ("trot", "bound", "jump"))
    assert np.abs(level).max() < 1e-3
    assert np.abs(bound[:, 0]).max() < 1e-6 and 0.02 < np.ptp(bound[:, 1]) / 2 < 0.4
    assert np.abs(jump[:, :2]).max() < 1e-6
    flight = 0.45 * 0.45  # s: the share of the cycle in the air times the period
    rise = 9.81 * flight**2 / 8
    z, air = jump[:, 2], ~GAITS["jump"].stance(np.arange(SAMPLES) / SAMPLES)[:, 0]
    assert z[air].max() - z[air][[0, -1]].mean() == pytest.approx(rise, rel=0.1)


def test_bound_lifts_its_nose_while_the_front_feet_push():
    nominal = motion(GAITS["bound"])
    front = nominal.load[:, :2].sum(axis=1) > nominal.load[:, 2:].sum(axis=1)
    pitch_rate = nominal.velocity[:, 1]
    change = (np.roll(pitch_rate, -1) - np.roll(pitch_rate, 1))[front]
    assert np.median(change) < 0, "a positive pitch is nose down"


def test_walk_stays_nearly_level_on_three_feet():
    """By hand: on FL, RL, RR only the diagonal FL-RR passes under the centre, so it carries everything."""
    nominal = motion(GAITS["walk"])
    three = nominal.load_at(np.array([12 / SAMPLES]))[0]  # FR in the air
    assert three[1] == 0 and three[2] == pytest.approx(0, abs=1e-3)
    assert three[0] == pytest.approx(three[3], abs=0.02) and three.sum() == pytest.approx(1, abs=2e-3)
    assert np.abs(nominal.position[:, :2]).max() < 0.03


def test_inertia_scales_the_motion():
    bound = GAITS["bound"]
    light, heavy = nominal_motion(bound, 0.127, 0.394), nominal_motion(bound, 0.127, 2 * 0.394)
    np.testing.assert_allclose(heavy.position[:, 1], light.position[:, 1] / 2, atol=1e-12)
    inertia = np.diag(RobotModel().standing_inertia())
    np.testing.assert_allclose(INERTIA, inertia[:2], atol=2e-3)
