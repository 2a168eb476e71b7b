"""When a claim is met, refuted or open, and how often that is wrong."""

import math

import numpy as np
import pytest

from go1_mtl_gym.errors import InvalidInputError
from trainers.evaluation.stopping import FEWEST, Plan

GOOD, BAD = True, False


@pytest.mark.parametrize(
    ("claim", "episodes", "looks"),
    [
        (0.99, 298, ()),
        (0.99, 299, ((299, 0),)),
        (0.99, 472, ((472, 0),)),
        (0.99, 473, ((473, 1),)),
        (0.95, 59, ((59, 0),)),
    ],
)
def test_a_fixed_number_of_episodes_bears_so_many_failures(claim, episodes, looks):
    assert Plan.fixed(claim, 0.95, episodes).looks == looks


def test_one_look_is_the_textbook_one_and_several_share_the_error():
    assert Plan.sequential(0.99, 0.95, 0).looks == ((299, 0),)
    assert math.log(0.05) / math.log(0.99) == pytest.approx(298.07, abs=0.01)
    two = Plan.sequential(0.99, 0.95, 1)
    assert two.looks[0] == (math.ceil(math.log(0.025) / math.log(0.99)), 0) and two.looks[1][1] == 1
    assert two.largest == two.looks[1][0] and 0.049 < two.error <= 0.05


def test_the_error_of_a_plan_by_hand():
    # certified: 0 of 299 fail, or exactly 1 does and none of the 174 after
    by_hand = 0.99**299 + 299 * 0.01 * 0.99**298 * 0.99**174
    assert Plan(0.99, 0.95, ((299, 0), (473, 1)), 473).error == pytest.approx(by_hand)
    assert by_hand > 0.07, "two looks of 95 % each are no 95 % together"


@pytest.mark.parametrize(("claim", "failures"), [(0.99, 1), (0.95, 2), (0.9, 0)])
def test_who_only_just_misses_a_claim_is_wrongly_judged_as_seldom_as_promised(claim, failures):
    plan, rng = Plan.sequential(claim, 0.95, failures), np.random.default_rng(1)
    verdicts = [plan.judge((rng.uniform(size=plan.largest) < claim).tolist())[0] for _ in range(400)]
    assert verdicts.count("met") <= 0.05 * 400 + 2 * math.sqrt(400 * 0.05)
    assert verdicts.count("refuted") <= 0.05 * 400 + 2 * math.sqrt(400 * 0.05)


def test_a_policy_that_never_fails_stops_at_the_first_look():
    plan = Plan.sequential(0.99, 0.95, 1)
    first, last = plan.looks[0][0], plan.looks[1][0]
    assert plan.judge([GOOD] * (first - 1)) == ("", first - 1)
    assert plan.judge([GOOD] * 900) == ("met", first), "what comes later does not count"
    assert plan.judge([BAD] + [GOOD] * (last - 2)) == ("", last - 1)
    assert plan.judge([BAD] + [GOOD] * 900) == ("met", last)
    assert plan.judge([BAD] * 2 + [GOOD] * 900)[0] != "met"


def test_a_policy_that_often_fails_is_done_early_and_one_that_nearly_holds_is_not():
    plan = Plan.sequential(0.99, 0.95, 1)
    assert plan.judge([BAD] * 90) == ("refuted", FEWEST) and plan.judge([BAD] * 9) == ("", 9)
    late = [GOOD] * 30 + [BAD] * 9
    # 3 failures in 33 episodes: 125 (0.95 / 0.99)^30 = 36; 2 in 32: 7
    assert plan.judge(late) == ("refuted", 33)
    rare = ([GOOD] * 99 + [BAD]) * 5
    assert plan.judge(rare) == ("open", plan.largest), "1 in 100 is neither shown nor refuted"


def test_without_early_stops_all_episodes_are_done():
    plan = Plan.fixed(0.9, 0.95, 60)
    assert plan.judge([BAD] * 59) == ("", 59) and plan.judge([BAD] * 60) == ("refuted", 60)
    allowed = plan.looks[0][1]
    assert plan.judge([BAD] * allowed + [GOOD] * (60 - allowed)) == ("met", 60)
    assert plan.judge([BAD] * (allowed + 1) + [GOOD] * (59 - allowed)) == ("open", 60)


def test_too_few_episodes_meet_nothing():
    plan = Plan.sequential(0.99, 0.95, 1, largest=100)
    assert plan.looks == () and plan.error == 0.0 and plan.judge([GOOD] * 100) == ("open", 100)
    assert Plan.sequential(0.99, 0.95, 1, largest=400).looks == ((299, 0),)


@pytest.mark.parametrize("wrong", [{"claim": 1.0}, {"claim": 0.0}, {"confidence": 0.4}, {"failures": -1}])
def test_what_cannot_be_claimed_is_refused(wrong):
    with pytest.raises(InvalidInputError):
        Plan.sequential(**{"claim": 0.99, "confidence": 0.95} | wrong)
