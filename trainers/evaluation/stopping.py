"""When a claim about a success rate is met: episodes decided beforehand, and errors that are known exactly."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import scipy

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import integer_in
from trainers.evaluation.metrics import exact_interval

MET, REFUTED, OPEN = "met", "refuted", "open"
"""What is known of a claim in the end: it holds, it does not, or neither could be shown."""
ALTERNATIVE = 5.0
"""A claim is tested against a policy that fails so many times as often as it allows."""
FEWEST = 20
"""Episodes before a claim can be refuted, so that the rate and the causes of the failures tell something."""
MANY_FAILURES = 50
"""Largest number of failures that a plan can allow."""


@dataclasses.dataclass(frozen=True)
class Plan:
    """After how many episodes one looks, and how many failures the claim then bears; fixed before the first episode.

    The claim is met at the first look with no more failures than it bears. A policy that only just misses the claim is
    certified with probability `error` at most, which is computed exactly for all looks together, so that looking
    several times does not inflate it. (Looks at 299 and 473 episodes, with 0 and 1 failures, each hold 95 % by
    themselves; together they would certify a policy of exactly 99 % in 7.5 % of the cases.)

    The claim is refuted when Wald's likelihood ratio of a policy that fails `ALTERNATIVE` times as often as the claim
    allows, against one that only just meets it, exceeds 1 / (1 - confidence); after a fixed number of episodes, when
    the exact one-sided upper bound is below the claim. For a policy that deserves the claim either happens with a
    probability of 1 - confidence at most (the first whenever one looks, by Ville's inequality). It takes `FEWEST`
    episodes. A claim that can no longer be met and is not refuted yet goes on to the largest number, and stays open.

    Attributes:
        claim: success rate that is claimed, in (0, 1).
        confidence: with which, in (0.5, 1).
        looks: (episodes, failures that the claim bears), both increasing.
        largest: number of episodes at most.
        early: whether episodes end as soon as the answer is known; otherwise there are always `largest`.

    Raises:
        InvalidInputError: if a rate or a number is outside its range.
    """

    claim: float
    confidence: float
    looks: tuple[tuple[int, int], ...]
    largest: int
    early: bool = True

    def __post_init__(self) -> None:
        """Check the numbers."""
        _check_rates(self.claim, self.confidence)
        integer_in(self.largest, 1, 10**9, "largest number of episodes")

    @classmethod
    def sequential(cls, claim: float, confidence: float, failures: int = 1, largest: int | None = None) -> "Plan":
        """Looks for 0, 1 ... `failures` failures, each of which adds as much to the error as the others.

        Args:
            claim: success rate.
            confidence: of it.
            failures: that the claim bears in the end, at most.
            largest: number of episodes at most; looks beyond are left out. None: the last look's.
        """
        _check_rates(claim, confidence)
        failures = integer_in(failures, 0, MANY_FAILURES, "allowed failures")
        for allowed in range(failures, -1, -1):
            looks = _looks(claim, confidence, allowed)
            if largest is None or looks[-1][0] <= largest:
                return cls(claim, confidence, looks, looks[-1][0] if largest is None else largest)
        return cls(claim, confidence, (), int(largest or 0))

    @classmethod
    def fixed(cls, claim: float, confidence: float, episodes: int) -> "Plan":
        """One look after a fixed number of episodes, whatever happens: 299 bear 0 failures at 99 %, 473 bear 1."""
        _check_rates(claim, confidence)
        tail = scipy.stats.binom.cdf(np.arange(MANY_FAILURES + 1), episodes, 1.0 - claim)
        allowed = int((tail <= 1.0 - confidence).sum()) - 1
        return cls(claim, confidence, ((episodes, allowed),) if allowed >= 0 else (), episodes, early=False)

    @property
    def error(self) -> float:
        """Probability of certifying a policy whose success rate is exactly the claim."""
        certified, before, state = 0.0, 0, np.eye(1, MANY_FAILURES + 2)[0]
        for episodes, failures in self.looks:
            state = _advance(state, episodes - before, 1.0 - self.claim)
            certified += state[: failures + 1].sum()
            state[: failures + 1] = 0.0
            before = episodes
        return float(certified)

    def judge(self, outcomes: Sequence[bool]) -> tuple[str, int]:
        """What some episodes say; a function of their order, not of how many came at a time.

        Args:
            outcomes: success of each, in order.

        Returns:
            One of `MET`, `REFUTED` and `OPEN` with the number of episodes that count for it; "" and the number of all,
            if it takes more.
        """
        looks = dict(self.looks)
        failures = 0
        for count, success in enumerate(outcomes[: self.largest], 1):
            failures += not success
            last = count == self.largest
            if (self.early or last) and failures <= looks.get(count, -1):
                return MET, count
            if (self.early or last) and self._refuted(count, failures):
                return REFUTED, count
            if last:
                return OPEN, count
        return "", len(outcomes)

    def next_stop(self, count: int) -> int:
        """The number of episodes at which the coming decision can fall at the earliest, if nothing fails."""
        stops = [episodes for episodes, _ in self.looks if episodes > count and self.early]
        return min([*stops, self.largest])

    def _refuted(self, count: int, failures: int) -> bool:
        if count < min(FEWEST, self.largest) or (self.looks and failures <= self.looks[-1][1]):
            return False
        if not self.early:
            return exact_interval(count - failures, count, 2.0 * self.confidence - 1.0)[1] < self.claim
        allowed = 1.0 - self.claim
        other = min(ALTERNATIVE * allowed, (1.0 + allowed) / 2.0)
        ratio = failures * math.log(other / allowed) + (count - failures) * math.log((1.0 - other) / self.claim)
        return ratio >= -math.log(1.0 - self.confidence)


def _check_rates(claim: float, confidence: float) -> None:
    for name, value, low in (("claim", claim, 0.0), ("confidence", confidence, 0.5)):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not low < value < 1.0:
            raise InvalidInputError(f"{name} must be a rate between {low:g} and 1, got {value!r}")


def _looks(claim: float, confidence: float, failures: int) -> tuple[tuple[int, int], ...]:
    """The earliest looks that share the error equally.

    Who comes to look r without having been certified has failed r times at least; to be certified there it must have
    failed exactly so often before, and not once since the look before.
    """
    budget = (1.0 - confidence) / (failures + 1)
    looks: list[tuple[int, int]] = []
    spent, before, state = 0.0, 0, np.eye(1, MANY_FAILURES + 2)[0]
    for allowed in range(failures + 1):
        left = budget * (allowed + 1) - spent
        more = max(1, math.ceil(math.log(left / state[allowed]) / math.log(claim) - 1e-9))
        state = _advance(state, more, 1.0 - claim)
        spent += state[allowed]
        state[allowed] = 0.0
        before += more
        looks.append((before, allowed))
    return tuple(looks)


def _advance(state: np.ndarray, episodes: int, failure: float) -> np.ndarray:
    """Distribution of the number of failures some episodes later; the last entry holds all the larger numbers."""
    added = scipy.stats.binom.pmf(np.arange(len(state)), episodes, failure)
    after = np.convolve(state, added)[: len(state)]
    after[-1] += state.sum() - after.sum()
    return after
