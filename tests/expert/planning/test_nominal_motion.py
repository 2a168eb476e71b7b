"""The nominal motion of a gait: loads that carry the weight, and the motion under them."""

import numpy as np
import pytest

from experts.planning.nominal_motion import SAMPLES, SWAY, NominalMotion, nominal_motion, standing_motion
from experts.robot_model import RobotModel
from go1_mtl_gym import GAITS, robot
from go1_mtl_gym.gaits import Gait

INERTIA, HEIGHT = (0.127, 0.394, 0.423), 0.257
PHASES = np.arange(SAMPLES) / SAMPLES
EVERY = pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))


def motion(gait: Gait) -> NominalMotion:
    return nominal_motion(gait, INERTIA, HEIGHT)


@EVERY
def test_feet_carry_the_weight_on_average_and_nothing_in_the_air(gait):
    force, stance = motion(gait).force, gait.stance(PHASES)
    load = force[..., 2]
    assert load.sum(axis=1).mean() == pytest.approx(1.0, abs=2e-3)
    assert (force[~stance] == 0).all() and (load >= 0).all()
    supported = stance.any(axis=1)
    np.testing.assert_allclose(load.sum(axis=1), np.where(supported, 1 / supported.mean(), 0), atol=2e-3)


def test_jump_pushes_harder_to_make_up_for_its_flight():
    load = motion(GAITS["jump"]).force[..., 2]
    on_ground = load.sum(axis=1) > 0
    np.testing.assert_allclose(load[on_ground], 0.25 / on_ground.mean(), rtol=1e-3)
    assert on_ground.mean() == pytest.approx(0.55, abs=0.01)


def test_trot_shares_the_load_between_the_diagonal_feet():
    force = motion(GAITS["trot"]).force_at(np.array([0.25, 0.75, 1.25]))
    np.testing.assert_allclose(force[..., 2], [[0.5, 0, 0, 0.5], [0, 0.5, 0.5, 0], [0.5, 0, 0, 0.5]], atol=1e-4)


@EVERY
def test_velocity_is_the_derivative_of_position(gait):
    nominal = motion(gait)
    moved = nominal.position - np.roll(nominal.position, 1, axis=0)
    mean = (nominal.velocity + np.roll(nominal.velocity, 1, axis=0)) / 2
    np.testing.assert_allclose(moved, mean * gait.period / SAMPLES, atol=1e-9)


@EVERY
def test_acceleration_is_newtons_and_eulers(gait):
    """From the feet's forces alone: total force by Newton, moment about the centre of mass by Euler; less the mean."""
    nominal = motion(gait)
    weight = robot.MASS * robot.GRAVITY
    feet = gait.nominal_feet_b * [1, 1, 0] - [0, 0, HEIGHT]
    moment = weight * np.cross(feet, nominal.force).sum(axis=1)
    total = 9.81 * (nominal.force.sum(axis=1) - [0, 0, 1])
    expected = np.hstack([moment / INERTIA, total])
    expected = (expected + np.roll(expected, 1, axis=0)) / 2 - expected.mean(axis=0)
    numeric = (nominal.velocity - np.roll(nominal.velocity, 1, axis=0)) * (SAMPLES / gait.period)
    np.testing.assert_allclose(numeric, expected, atol=1e-8)


@EVERY
def test_motion_is_periodic_about_zero(gait):
    nominal = motion(gait)
    for samples in (nominal.position, nominal.velocity):
        np.testing.assert_allclose(samples.mean(axis=0), 0, atol=1e-12)
    phase = np.random.default_rng(0).uniform(0, 1, 20)
    np.testing.assert_allclose(nominal.at(phase), nominal.at(phase + 2), atol=1e-10)
    np.testing.assert_allclose(nominal.at(np.array([1 - 1e-9])), nominal.at(np.array([0.0])), atol=1e-6)
    np.testing.assert_array_equal(nominal.at(np.array([np.nextafter(0.0, -1)])), nominal.at(np.array([0.0])))


@EVERY
def test_interpolation_passes_through_the_samples(gait):
    nominal = motion(gait)
    cycle = np.hstack([nominal.position, nominal.velocity])
    np.testing.assert_allclose(nominal.at(PHASES), cycle, atol=1e-12)
    np.testing.assert_allclose(nominal.at(PHASES + 0.5 / SAMPLES), (cycle + np.roll(cycle, -1, axis=0)) / 2, atol=1e-12)


@EVERY
def test_sway_at_one_phase_is_the_interpolated_velocity(gait):
    nominal = motion(gait)
    for phase in np.random.default_rng(1).uniform(-1, 2, 20):
        x, y = nominal.at(np.array([phase]))[0, 9:11]
        assert nominal.sway_velocity(phase) == complex(x, y)


@EVERY
def test_sway_is_limited_and_shared_like_the_load(gait):
    force = motion(gait).force
    assert (np.abs(force[..., :2]) <= SWAY * force[..., 2:] + 1e-12).all()
    total = force.sum(axis=1)
    np.testing.assert_allclose(force[..., :2] * total[:, None, 2:], force[..., 2:] * total[:, None, :2], atol=1e-9)


def test_swaying_keeps_the_paces_body_level_by_hand():
    """Two feet at y = 0.7 (0.04675 + 0.08) m: F_y / F_z = -y / h = -0.345 is more than the sway; what is left rolls."""
    gait = GAITS["pace"]
    nominal, y = motion(gait), 0.7 * 0.12675
    left = nominal.force_at(np.array([0.25]))[0]
    np.testing.assert_allclose(left[[0, 2], 2], 0.5, atol=1e-3)
    np.testing.assert_allclose(left[[0, 2], 1], -SWAY * left[[0, 2], 2], atol=1e-9)
    np.testing.assert_array_equal(left[[1, 3]], 0.0)
    moment = robot.MASS * 9.81 * (y - SWAY * HEIGHT)
    rolling = np.diff(nominal.velocity[[20, 28], 0])[0] / (8 * gait.period / SAMPLES)
    assert rolling == pytest.approx(moment / 0.127, rel=0.02)
    assert np.abs(nominal.position[:, :2]).max() < 0.04, "a few degrees; without sway it would be ten times as much"


def test_a_narrow_pace_is_quite_level():
    narrow = Gait("narrow pace", period=0.32, duty=0.55, offsets=(0.0, 0.5, 0.0, 0.5), stance_width=0.5)
    nominal = motion(narrow)
    assert np.abs(nominal.position[:, :3]).max() < 1e-3
    assert 2e-3 < np.ptp(nominal.position[:, 4]) < 0.02, "it sways instead"
    left = nominal.force_at(np.array([0.25]))[0].sum(axis=0)
    assert left[1] / left[2] == pytest.approx(-0.5 * 0.12675 / HEIGHT, rel=1e-3)


def test_trot_is_level_bound_pitches_and_jump_hops():
    level, bound, jump = (motion(GAITS[name]).position for name in ("trot", "bound", "jump"))
    assert np.abs(level).max() < 1e-3
    assert np.abs(bound[:, [0, 2, 4]]).max() < 1e-6 and 0.01 < np.ptp(bound[:, 1]) / 2 < 0.4
    assert np.abs(jump[:, :5]).max() < 1e-6
    flight = 0.45 * 0.45  # s: the share of the cycle in the air times the period
    rise = 9.81 * flight**2 / 8
    z, air = jump[:, 5], ~GAITS["jump"].stance(PHASES)[:, 0]
    assert z[air].max() - z[air][[0, -1]].mean() == pytest.approx(rise, rel=0.1)


def test_bound_lifts_its_nose_while_the_front_feet_push():
    nominal = motion(GAITS["bound"])
    load = nominal.force[..., 2]
    front = load[:, :2].sum(axis=1) > load[:, 2:].sum(axis=1)
    pitch_rate = nominal.velocity[:, 1]
    change = (np.roll(pitch_rate, -1) - np.roll(pitch_rate, 1))[front]
    assert np.median(change) < 0, "a positive pitch is nose down"


def test_walk_stays_nearly_level_on_three_feet():
    """By hand: on FL, RL, RR only the diagonal FL-RR passes under the centre, so it carries everything."""
    nominal = motion(GAITS["walk"])
    three = nominal.force_at(np.array([12 / SAMPLES]))[0, :, 2]  # FR in the air
    assert three[1] == 0 and three[2] == pytest.approx(0, abs=1e-3)
    assert three[0] == pytest.approx(three[3], abs=0.02) and three.sum() == pytest.approx(1, abs=2e-3)
    assert np.abs(nominal.position[:, :2]).max() < 0.03


def test_inertia_scales_the_turning_and_mass_does_not_matter_to_the_rest():
    bound = GAITS["bound"]
    light, heavy = motion(bound), nominal_motion(bound, (0.127, 2 * 0.394, 0.423), HEIGHT)
    np.testing.assert_allclose(heavy.position[:, 1], light.position[:, 1] / 2, atol=1e-12)
    np.testing.assert_allclose(heavy.position[:, 3:], light.position[:, 3:], atol=1e-12)
    np.testing.assert_allclose(INERTIA, np.diag(RobotModel().standing_inertia()), atol=2e-3)
    # Twice the mass with twice the inertia moves alike.
    twice = nominal_motion(bound, tuple(2 * moment for moment in INERTIA), HEIGHT, 2 * robot.MASS)
    np.testing.assert_allclose(twice.position, light.position, atol=1e-12)


@EVERY
def test_standing_is_the_weight_on_four_feet_and_no_motion(gait):
    standing = standing_motion(gait)
    force = standing.force_at(np.array([0.0, 0.37]))
    np.testing.assert_allclose(force, np.tile([0.0, 0.0, 0.25], (2, 4, 1)), atol=1e-12)
    assert not standing.at(PHASES).any()
