"""Aggregates by hand, searches, and what tables and legends do with them."""

import math

import pytest

from experiments.results import Group, group
from experiments.searches import climb, scouted
from experiments.stats import Rate, drops, estimate
from experiments.tables import count, estimated, judged, spans

RECORDS = [
    {"agent": "a", "task": "trot", "trials": 10, "succeeded": 9, "error": 0.1},
    {"agent": "a", "task": "walk", "trials": 30, "succeeded": 0, "error": None},
    {"agent": "b", "task": "trot", "trials": 20, "succeeded": 20, "error": 0.3},
    {"agent": "b", "task": "walk"},
]


def test_groups_sum_what_is_there():
    per_agent = group(RECORDS, "agent")
    assert per_agent["a"].rate() == (9, 40) and per_agent["b"].rate() == (20, 20)
    assert per_agent["a"].mean("error") == 0.1 and Group().mean("error") is None
    assert per_agent["a"].largest("error") is None, "an error that there is none of is the worst"
    assert group(RECORDS, "task")["trot"].largest("error") == 0.3
    assert list(group(RECORDS, ["agent", "task"])) == [("a", "trot"), ("a", "walk"), ("b", "trot"), ("b", "walk")]


def test_a_rate_has_the_exact_interval():
    assert Rate(20, 20).interval == pytest.approx((0.025 ** (1 / 20), 1.0))
    assert Rate(1, 2).interval == pytest.approx((1 - math.sqrt(0.975), math.sqrt(0.975)))
    assert math.isnan(Rate(0, 0).value) and math.isnan(Rate(0, 0).interval[0])


def test_students_interval_by_hand():
    # 1, 2, 3: s = 1, t_{.975, 2} = 4.302653
    assert estimate([1.0, 2.0, 3.0]) == pytest.approx((2.0, 4.302653 / math.sqrt(3), 3))
    assert estimate([2.5])[0] == 2.5 and math.isnan(estimate([2.5]).half)


def test_a_drop_is_real_if_it_exceeds_the_interval_of_the_difference():
    # 18/20 and 15/20 differ by 0.15, the interval reaches 0.24 below; 90/100 and 75/100 by as much, with 0.105.
    assert not drops(Rate(18, 20), Rate(15, 20)) and drops(Rate(90, 100), Rate(75, 100))
    assert not drops(Rate(0, 20), Rate(0, 20)) and not drops(Rate(5, 20), Rate(20, 20))


@pytest.mark.parametrize(("falls_above", "largest"), [(0.7, 0.6), (0.2, 0.2), (0.1, 0.0), (9.0, 0.8)])
def test_climbing_stops_below_the_first_failure(falls_above, largest):
    tried = []
    assert climb(0.2, 0.2, 3, lambda level: tried.append(level) or level <= falls_above) == largest
    assert len(tried) == min(4, round(largest / 0.2) + 1)


@pytest.mark.parametrize(("falls_above", "largest"), [(1.23, 1.2), (0.6, 0.6), (0.35, 0.3), (0.0, 0.0), (99.0, 4.6)])
def test_climbing_from_the_middle_comes_down_where_it_must(falls_above, largest):
    assert climb(0.6, 0.1, 40, lambda level: level <= falls_above) == pytest.approx(largest)


@pytest.mark.parametrize(
    ("falls_from", "good_to", "passed", "good"), [(4.5, 2.5, 4.0, 2.0), (9.0, 9.0, 5.0, 5.0), (0.0, 0.0, None, 0.0)]
)
def test_scouts_go_up_and_all_come_down(falls_from, good_to, passed, good):
    levels, below = [1.0, 2.0, 3.0, 4.0, 5.0], [0.5]
    found = scouted(
        levels,
        below,
        scout=lambda level: level < falls_from,
        try_all=lambda level: level if level < falls_from else None,
        good=lambda level: level <= good_to,
    )
    assert found == (None if passed is None else (passed, passed), good)


def test_scouts_that_survive_are_not_enough():
    tried = []
    passed, _ = scouted(
        [1.0, 2.0, 3.0],
        [],
        lambda level: True,
        lambda level: tried.append(level) or (level if level < 2.5 else None),
        bool,
    )
    assert passed == (2.0, 2.0) and tried == [3.0, 2.0]


def test_what_misses_its_target_is_bold():
    assert (count(Rate(19, 20), 0.95), count(Rate(18, 20), 0.95), count(Rate(0, 0))) == ("19/20", "**18/20**", "-")
    assert judged(0.05, 0.05, "lower", ".2f") == "0.05" and judged(0.06, 0.05, "lower", ".2f") == "**0.06**"
    assert judged(0.9, 0.95, "higher", ".0%") == "**90%**" and judged(None, 0.05, "lower", ".2f") == "**-**"
    assert estimated(estimate([1.0]), ".1f") == "1.0" and spans(None) == "-"
    assert spans([1.0, 2.0, 3.0]) == "2.00 (1.00 ... 3.00)"
