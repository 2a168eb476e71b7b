"""The pieces of a hold between contact changes."""

from dataclasses import replace

import numpy as np
import pytest

from experts.planning.contact_timing import SHORTEST_PIECE_S, contact_pieces
from go1_mtl_gym import GAITS


def pieces(standing, gait: str, phase: float, hold_s: float) -> list:
    return contact_pieces(replace(standing, gait=GAITS[gait], phase=phase), hold_s)


def test_a_hold_without_a_change_is_one_piece(standing):
    assert pieces(standing, "trot", 0.2, 0.02) == [(pytest.approx(0.01), pytest.approx(1.0))]
    for phase in np.arange(0, 1, 0.0025):
        for gait in GAITS:
            assert pieces(standing, gait, phase, 0.001) == [(0.0005, 1.0)], "one kilohertz"
    assert pieces(standing, "trot", 0.2, 0.0) == [(0.0, 1.0)]


def test_a_trots_lift_off_by_hand(standing):
    """FR and RL lift off at phase .05 of .4 s; from .03 on that is after 8 ms of 20."""
    (first, share), (second, rest) = pieces(standing, "trot", 0.03, 0.02)
    assert (first, second) == (pytest.approx(0.004), pytest.approx(0.014))
    assert (share, rest) == (pytest.approx(0.4), pytest.approx(0.6))


def test_a_gallops_changes_by_hand(standing):
    """Period .32 s, duty .5: at .88 legs touch down at .9 (FR) and 1.0 (FL); RR, at .48 of its own, lifts off at .9."""
    got = pieces(standing, "gallop", 0.88, 0.04)
    edges = 0.32 * np.array([0.0, 0.02, 0.12, 0.125])
    np.testing.assert_allclose([middle for middle, _ in got], (edges[:-1] + edges[1:]) / 2)
    np.testing.assert_allclose([share for _, share in got], np.diff(edges) / 0.04)


@pytest.mark.parametrize("gait", GAITS)
@pytest.mark.parametrize("hold_s", [0.002, 0.01, 0.02, 0.05])
def test_shares_sum_to_one_and_no_change_lies_inside_a_piece(standing, gait, hold_s):
    for phase in np.random.default_rng(0).uniform(0, 1, 50):
        got = pieces(standing, gait, phase, hold_s)
        assert sum(share for _, share in got) == pytest.approx(1.0)
        begin = 0.0
        for middle, share in got:
            end = begin + share * hold_s
            assert middle == pytest.approx((begin + end) / 2)
            inside = np.linspace(begin + SHORTEST_PIECE_S, end - SHORTEST_PIECE_S, 9)
            if end - begin > 2 * SHORTEST_PIECE_S:
                stance = GAITS[gait].stance(phase + inside / GAITS[gait].period)
                assert (stance == stance[0]).all()
            begin = end
