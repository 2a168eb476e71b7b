"""Gaits as a space: what is drawn, where it can stand, how far gaits are apart, and what lies between."""

import dataclasses

import numpy as np
import pytest

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gait_space import (
    NAMED,
    SPANS,
    GaitSpace,
    between,
    mirrored,
    offset_distance,
    standing_at_zero,
)
from go1_mtl_gym.gaits import GAITS, Gait

PHASES = np.arange(2000) / 2000


def order(gait: Gait) -> list[str]:
    """Legs in the order in which they come down, from FL on."""
    touchdown = np.mod(-np.array(gait.offsets) + gait.offsets[0], 1.0)
    return [("FL", "FR", "RL", "RR")[leg] for leg in np.argsort(touchdown, kind="stable")]


def turned(gait: Gait, by: float) -> Gait:
    """The same footfalls with another zero of the clock."""
    return dataclasses.replace(gait, offsets=tuple(np.mod(np.array(gait.offsets) + by, 1.0)))


def draws(count: int, space: GaitSpace | None = None) -> list[Gait]:
    rng = np.random.default_rng(0)
    return [(space or GaitSpace()).draw(rng) for _ in range(count)]


def test_textbook_gaits_have_their_footfalls():
    assert order(NAMED["walk"]) == order(NAMED["amble"]) == ["FL", "RR", "FR", "RL"], "lateral sequence"
    assert order(NAMED["transverse_gallop"]) == ["FL", "RR", "RL", "FR"], "fore and hind legs in the same order"
    assert order(NAMED["rotatory_gallop"]) == ["FL", "RL", "RR", "FR"], "in opposite orders"
    assert order(NAMED["canter"])[2:] == ["FR", "RL"], "diagonal pair, leading fore, trailing hind"
    assert NAMED["canter"].offsets[0] == NAMED["canter"].offsets[3]
    assert offset_distance(NAMED["pace"], GAITS["pace"]) < 1e-9 > offset_distance(NAMED["trot"], GAITS["trot"])
    assert NAMED["limp"].duties.argmin() == 0, "the front left leg is spared"


def stands_somewhere(gait: Gait) -> bool:
    """Whether all feet are on the ground for some time, and not for the instant of a change alone."""
    down = gait.stance(PHASES).all(axis=1)
    return bool((down & np.roll(down, 1) & np.roll(down, -1)).any())


@pytest.mark.parametrize("gait", NAMED.values(), ids=lambda gait: gait.name)
def test_textbook_gaits_lie_in_the_space_and_stand_where_they_can(gait):
    assert GaitSpace().contains(gait)
    assert gait.can_stand == stands_somewhere(gait)


def test_draws_fill_the_space_and_nothing_else():
    space, gaits = GaitSpace(), draws(600)
    assert all(space.contains(gait) for gait in gaits)
    for name in SPANS:
        low, high = getattr(space, name)
        values = [getattr(gait, name) for gait in gaits]
        assert low <= min(values) < low + 0.05 * (high - low) and high - 0.05 * (high - low) < max(values) <= high
    uneven = np.mean([any(gait.duty_offsets) for gait in gaits])
    assert abs(uneven - space.uneven) < 0.06
    near = [min(offset_distance(gait, known) for known in NAMED.values()) for gait in draws(300)]
    anywhere = [
        min(offset_distance(gait, known) for known in NAMED.values()) for gait in draws(300, GaitSpace(patterns=0.0))
    ]
    assert np.mean(near) < np.mean(anywhere)


def test_draws_are_the_same_for_the_same_generator_and_count():
    first, second = draws(5), draws(5)
    assert first == second and len(set(first)) == 5


def test_only_so_many_gaits_are_drawn_and_the_first_ones_of_more():
    few, more = (set(draws(300, GaitSpace(count=count))) for count in (5, 20))
    assert (len(few), len(more)) == (5, 20) and few < more


def test_nothing_is_drawn_from_holes():
    space = GaitSpace(holes=tuple(NAMED), patterns=1.0, pattern_spread=0.05)
    for gait in draws(100, space):
        assert min(offset_distance(gait, known) for known in NAMED.values()) > space.hole_radius
    near = [offset_distance(gait, NAMED["trot"]) for gait in draws(200, GaitSpace(patterns=1.0, pattern_spread=0.02))]
    assert min(near) < 0.03


def test_most_gaits_can_stand_where_their_clock_begins():
    gaits = draws(300)
    could = [stands_somewhere(gait) for gait in gaits]
    stands = [gait.can_stand for gait in gaits]
    assert np.mean(stands) > 0.6
    assert sum(a and not b for a, b in zip(could, stands, strict=True)) <= 2, "but for windows narrower than the grid"


def test_standing_at_zero_only_turns_the_clock():
    for gait in draws(40):
        moved = turned(gait, 0.37)
        back = standing_at_zero(moved)
        assert offset_distance(gait, back) < 1e-9
        assert back.can_stand == gait.can_stand
        np.testing.assert_allclose(
            back.contact_schedule(0.0, back.period, 1), gait.contact_schedule(0.0, gait.period, 1)
        )


def test_mirror_is_its_own_inverse_and_keeps_symmetric_gaits():
    for gait in draws(20):
        assert mirrored(mirrored(gait)) == gait
    assert offset_distance(mirrored(NAMED["trot"]), NAMED["trot"]) < 1e-9
    assert offset_distance(mirrored(NAMED["rotatory_gallop"]), NAMED["rotatory_gallop"]) > 0.05


def test_distance_of_offsets():
    trot, bound = NAMED["trot"], NAMED["bound"]
    assert offset_distance(trot, turned(trot, 0.61)) < 1e-9
    assert offset_distance(trot, bound) == pytest.approx(0.25)  # two legs half a cycle off: a quarter each way
    one = dataclasses.replace(trot, offsets=(trot.offsets[0] + 0.1, *trot.offsets[1:]))
    assert offset_distance(trot, one) == offset_distance(one, trot) == pytest.approx(0.05)


def test_between_goes_the_short_way_round():
    first = Gait("first", 0.4, 0.5, (0.95, 0.0, 0.5, 0.2))
    second = Gait("second", 0.6, 0.7, (0.05, 0.0, 0.5, 0.2), body_height=0.9, duty_offsets=(0.1, 0.0, 0.0, 0.0))
    middle = between(first, second, 0.5)
    np.testing.assert_allclose(np.mod(np.array(middle.offsets) + 0.5, 1.0) - 0.5, [0.0, 0.0, -0.0 + 0.5 - 1.0, 0.2])
    assert (middle.period, middle.duty, middle.body_height) == pytest.approx((0.5, 0.6, 0.95))
    assert middle.duty_offsets[0] == pytest.approx(0.05)
    assert between(first, second, 1.0).period == second.period and middle.name == "second"


def test_clipping_brings_a_gait_into_the_space():
    space = GaitSpace()
    outside = Gait("slow", 1.2, 0.9, (0.0, 0.5, 0.5, 0.0), duty_offsets=(0.04, 0.0, 0.0, -0.3))
    assert not space.contains(outside) and space.contains(space.clipped(outside))
    inside = draws(1)[0]
    clipped = space.clipped(inside)
    assert clipped.offsets == inside.offsets
    np.testing.assert_allclose(clipped.duties, inside.duties)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"period": (0.6, 0.3)}, r"period of a GaitSpace must be \(smallest, largest\)"),
        ({"period": (0.01, 0.3)}, "period .* must lie in"),
        ({"duty": 0.5}, "duty of a GaitSpace"),
        ({"patterns": 1.5}, "patterns of a GaitSpace"),
        ({"uneven": "often"}, "uneven of a GaitSpace"),
        ({"duty_offset": -0.1}, "duty_offset of a GaitSpace"),
        ({"body_height": (0.5, 1.0)}, "body_height"),
        ({"count": 0}, "count of a GaitSpace"),
        ({"holes": "trot"}, "holes of a GaitSpace must be names of gaits"),
        ({"holes": ("moonwalk",)}, "hole of a GaitSpace must be one of 'walk'"),
        ({"hole_radius": 0.4}, "hole_radius of a GaitSpace"),
    ],
)
def test_impossible_spaces_are_refused(values, message):
    with pytest.raises(InvalidInputError, match=message):
        GaitSpace(**values)
