"""Gait clocks worked by hand, and the contact schedule against a fine numerical integral."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

from go1_mtl_gym import robot
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gaits import GAITS, STAND_COMMAND, Gait, asks_to_stand, check_phase, is_standing, next_phase

EVERY = pytest.mark.parametrize("gait", GAITS.values(), ids=str)


def touchdown_phases(gait: Gait) -> np.ndarray:
    """Phases at which each leg begins its stance, found on a fine grid, shape (4,)."""
    grid = np.arange(10000) / 10000
    stance = gait.stance(grid)
    began = stance & ~np.roll(stance, 1, axis=0)
    assert (began.sum(axis=0) == 1).all()
    return grid[began.argmax(axis=0)]


def test_trot_by_hand():
    trot = GAITS["trot"]  # duty .55, diagonal pairs half a cycle apart
    np.testing.assert_allclose(trot.leg_phase(0.2), [0.2, 0.7, 0.7, 0.2])
    assert trot.stance(0.2).tolist() == [True, False, False, True]
    assert trot.stance(0.52).tolist() == [True, True, True, True]
    assert trot.stance(0.6).tolist() == [False, True, True, False]
    np.testing.assert_allclose([trot.stance_s, trot.swing_s], [[0.22] * 4, [0.18] * 4])
    assert trot.step_rate == pytest.approx(2.5)


def test_walk_by_hand():
    walk = GAITS["walk"]  # duty .78, offsets FL .25 FR .75 RL 0 RR .5
    np.testing.assert_allclose(walk.leg_phase(0.1), [0.35, 0.85, 0.1, 0.6])
    assert walk.stance(0.1).tolist() == [True, False, True, True]


def test_walk_is_four_beat():
    walk = GAITS["walk"]
    beats = touchdown_phases(walk)
    np.testing.assert_allclose(np.diff(np.sort(beats)), 0.25, atol=1e-3)
    assert np.array(["FL", "FR", "RL", "RR"])[np.argsort(beats)].tolist() == ["RL", "FR", "RR", "FL"] or np.array(
        ["FL", "FR", "RL", "RR"]
    )[np.argsort(beats)].tolist() == ["RL", "FL", "RR", "FR"], "a hind foot is followed by the front foot of a side"
    assert 0.7 <= walk.duty <= 0.8
    assert walk.stance(np.linspace(0, 1, 997)).sum(axis=1).min() >= 3, "never fewer than three feet on the ground"


def test_trot_moves_diagonal_pairs():
    beats = touchdown_phases(GAITS["trot"])
    assert beats[0] == beats[3] and beats[1] == beats[2] and abs(beats[0] - beats[1]) == pytest.approx(0.5)


def test_bound_moves_front_and_hind_pairs():
    beats = touchdown_phases(GAITS["bound"])
    assert beats[0] == beats[1] and beats[2] == beats[3] and abs(beats[0] - beats[2]) == pytest.approx(0.5)


def test_jump_moves_all_feet_together_and_leaves_the_ground():
    jump = GAITS["jump"]
    assert len(set(touchdown_phases(jump))) == 1
    support = jump.stance(np.arange(1000) / 1000).sum(axis=1)
    assert set(support) == {0, 4}
    assert (support == 0).mean() == pytest.approx(1 - jump.duty, abs=2e-3)


def test_pace_moves_the_legs_of_a_side_together():
    pace = GAITS["pace"]
    beats = touchdown_phases(pace)
    assert beats[0] == beats[2] and beats[1] == beats[3] and abs(beats[0] - beats[1]) == pytest.approx(0.5)
    assert (pace.period, pace.duty, pace.stance_width, pace.swing_height) == (0.32, 0.55, 0.7, 0.05)


def test_gallop_lands_its_front_feet_one_after_the_other_and_then_its_hind_feet():
    gallop = GAITS["gallop"]  # leg i touches down when phase + offset is a whole cycle: 0, .9, .5, .4
    np.testing.assert_allclose(touchdown_phases(gallop), [0.0, 0.9, 0.5, 0.4], atol=1e-3)
    assert (gallop.period, gallop.duty, gallop.stance_width, gallop.swing_height) == (0.32, 0.5, 1.0, 0.06)


def test_gaits_that_can_stand_have_all_feet_on_the_ground_at_phase_zero():
    assert {name: gait.can_stand for name, gait in GAITS.items()} == {
        "trot": True, "bound": False, "jump": True, "walk": True, "pace": True, "gallop": False,
    }  # fmt: skip


def test_nominal_feet_are_the_standing_robots_with_the_width_scaled():
    np.testing.assert_array_equal(GAITS["trot"].nominal_feet_b, robot.NOMINAL_FOOT_B)
    feet = GAITS["pace"].nominal_feet_b  # .7 x (.04675 + .08) = .088725 m from the middle line
    np.testing.assert_allclose(feet[:, 1], [0.088725, -0.088725, 0.088725, -0.088725])
    np.testing.assert_array_equal(feet[:, ::2], robot.NOMINAL_FOOT_B[:, ::2])
    assert feet is GAITS["pace"].nominal_feet_b, "computed once"
    for copied in (copy.deepcopy(GAITS["pace"]), pickle.loads(pickle.dumps(GAITS["pace"]))):
        assert copied == GAITS["pace"] and hash(copied) == hash(GAITS["pace"])
        with pytest.raises(ValueError, match="read-only"):
            copied.nominal_feet_b[0, 1] = 9.0


def test_offsets_may_come_as_any_sequence_of_numbers():
    assert dataclasses.replace(GAITS["trot"], offsets=np.array([0, 0.5, 0.5, 0])) == GAITS["trot"]


@EVERY
def test_phase_is_periodic(gait):
    phase = np.random.default_rng(0).uniform(0, 1, 50)
    np.testing.assert_allclose(gait.leg_phase(phase + 3), gait.leg_phase(phase), atol=1e-12)
    np.testing.assert_allclose(gait.leg_phase(phase - 3), gait.leg_phase(phase), atol=1e-12)
    assert gait.leg_phase(phase).shape == (50, 4) and gait.leg_phase(0.3).shape == (4,)


@EVERY
@pytest.mark.parametrize("dt", [0.013, 0.025, 0.05])
def test_contact_schedule_is_the_integral_of_stance(gait, dt):
    for phase in (0.0, 0.1234, 0.77):
        schedule = gait.contact_schedule(phase, dt, 9)
        fine = (np.arange(9 * 2000) + 0.5) / 2000  # midpoints, 2000 in each interval
        integral = gait.stance(phase + fine * dt / gait.period).reshape(9, 2000, 4).mean(axis=1)
        np.testing.assert_allclose(schedule, integral, atol=1.1e-3)
        assert schedule.min() >= 0 and schedule.max() <= 1


@EVERY
def test_contact_schedule_over_a_cycle_has_the_duty_as_mean(gait):
    for phase in np.linspace(0, 1, 7):
        schedule = gait.contact_schedule(phase, gait.period / 16, 16)
        np.testing.assert_allclose(schedule.mean(axis=0), gait.duty, atol=1e-12)


def test_contact_schedule_by_hand():
    schedule = GAITS["trot"].contact_schedule(0.0, 0.04, 10)[:, 0]  # tenths of a cycle; lift-off at .55
    np.testing.assert_allclose(schedule, [1, 1, 1, 1, 1, 0.5, 0, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"name": ""}, "name"),
        ({"period": 0.1}, r"period.*'trot'.*\[0.15, 3\].*0.1"),
        ({"duty": 1.0}, "duty.*got 1"),
        ({"duty": float("nan")}, "duty.*nan"),
        ({"swing_height": 0.0}, "swing_height"),
        ({"stance_width": 0.2}, r"stance_width of gait 'trot' must lie in \[0.3, 1.5\], got 0.2"),
        ({"stance_width": 1.6}, "stance_width.*got 1.6"),
        ({"offsets": (0.0, 0.5)}, r"offsets.*\(4,\).*\(2,\)"),
        ({"offsets": (0.0, 0.5, float("inf"), 0.0)}, "offsets.*finite"),
    ],
)
def test_impossible_gaits_are_refused(change, words):
    with pytest.raises(InvalidInputError, match=words):
        dataclasses.replace(GAITS["trot"], **change)


def test_gaits_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        GAITS["trot"].duty = 0.4
    with pytest.raises(TypeError):
        GAITS["trot"] = GAITS["walk"]


# -- The clock ---------------------------------------------------------------------------------------------------------

TROT, BOUND = GAITS["trot"], GAITS["bound"]
STILL, GOING = np.zeros(3), np.array([0.3, 0.0, 0.0])


def test_the_clock_by_hand():
    assert next_phase(TROT, 0.9, GOING, 0.06) == pytest.approx(0.05)  # .06 s of a period of .4 s are .15 cycles
    assert next_phase(TROT, 0.9, STILL, 0.06) == 0.0, "it stops at the next phase 0, exactly"
    assert next_phase(TROT, 0.8, STILL, 0.06) == pytest.approx(0.95), "and not before"
    assert next_phase(TROT, 0.0, STILL, 0.06) == 0.0
    assert next_phase(TROT, 0.0, GOING, 0.06) == pytest.approx(0.15)
    assert next_phase(BOUND, 0.0, STILL, 0.08) == pytest.approx(0.25), "a bound cannot stand"
    assert next_phase(TROT, 1.0 - 1e-12, STILL, 1e-15) == 0.0, "a sum that ends just below a whole cycle is whole"


def test_the_box_of_commands_that_ask_for_a_stand():
    assert STAND_COMMAND == (0.02, 0.02, 0.04)
    for axis in range(3):
        for sign in (-1, 1):
            command = np.zeros(3)
            command[axis] = sign * (STAND_COMMAND[axis] - 1e-9)
            assert is_standing(TROT, 0.0, command) and not is_standing(BOUND, 0.0, command)
            assert not is_standing(TROT, 1e-9, command)
            command[axis] = sign * STAND_COMMAND[axis]
            assert not asks_to_stand(TROT, command)


def test_a_phase_is_a_number_of_a_cycle():
    assert check_phase(np.float32(0.25)) == 0.25
    for phase in (1.0, -0.1, "late", True):
        with pytest.raises(InvalidInputError, match="phase"):
            check_phase(phase)


def test_legs_may_spend_different_shares_on_the_ground():
    limp = Gait("limp", 0.5, 0.6, (0.0, 0.5, 0.5, 0.0), duty_offsets=(-0.2, 0.0, 0.0, 0.1))
    np.testing.assert_allclose(limp.duties, [0.4, 0.6, 0.6, 0.7])
    np.testing.assert_allclose(limp.stance_s, [0.2, 0.3, 0.3, 0.35])
    assert limp.stance(0.45).tolist() == [False, False, False, True]
    np.testing.assert_allclose(limp.contact_schedule(0.3, 0.5 / 40, 40).mean(axis=0), limp.duties, atol=1e-12)
    with pytest.raises(InvalidInputError, match="duty and duty_offsets of gait 'limp' must add up to 0.2 to 0.95"):
        dataclasses.replace(limp, duty_offsets=(0.0, 0.0, 0.36, 0.0))
    with pytest.raises(InvalidInputError, match="duty_offsets of gait 'limp'"):
        dataclasses.replace(limp, duty_offsets=(0.0, 0.0))
    with pytest.raises(InvalidInputError, match="body_height of gait 'limp'"):
        dataclasses.replace(limp, body_height=0.5)
