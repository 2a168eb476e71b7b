"""Gaits as a space: bounds, draws, names of the textbook gaits in it, neighbors and mirror images."""

from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gaits import Gait
from go1_mtl_gym.validation import finite_vector, integer_in, number_in, one_of

OTHER_SIDE = (1, 0, 3, 2)
"""The leg on the other side of each of FL, FR, RL, RR."""
GRID = 400
"""Phases at which a cycle is looked at."""
Span = tuple[float, float]
"""Smallest and largest value."""
SPANS = ("period", "duty", "swing_height", "stance_width", "body_height")
"""Figures of a gait that a space bounds."""
LARGEST_HOLE = 0.15
"""Larger ones around all named gaits would leave little between them [cycles]."""
_SEQUENCE = 0x6A175
_MIDDLE: dict[str, Any] = {"period": 0.4, "duty": 0.5, "offsets": (0.0, 0.0, 0.0, 0.0)}


def standing_at_zero(gait: Gait) -> Gait:
    """The same footfalls with phase 0 in the middle of the longest time with most feet on the ground.

    There the clock can rest, if all of them are; most gaits drawn at random can stand only so.
    """
    phases = (np.arange(GRID) + 0.5) / GRID
    feet = gait.stance(phases).sum(axis=1)
    most = feet == feet.max()
    if most.all():
        return gait
    begin = int(np.flatnonzero(most & ~np.roll(most, 1))[0])
    turned = np.roll(most, -begin)  # begins with a run, so that no run goes over the end
    edges = np.flatnonzero(np.diff(np.concatenate([[False], turned, [False]]).astype(int)))
    begins, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - begins))
    middle = (begin + (begins[longest] + ends[longest]) / 2) / GRID
    return replace(gait, offsets=_turns(np.array(gait.offsets) + middle))


def _turns(offsets: np.ndarray) -> tuple[float, float, float, float]:
    a, b, c, d = np.mod(offsets, 1.0).tolist()
    return a, b, c, d


NAMED = MappingProxyType(
    {
        gait.name: standing_at_zero(gait)
        for gait in (
            Gait("walk", 0.60, 0.75, (0.75, 0.25, 0.0, 0.5)),
            Gait("amble", 0.46, 0.58, (0.75, 0.25, 0.0, 0.5)),
            Gait("trot", 0.40, 0.55, (0.0, 0.5, 0.5, 0.0)),
            Gait("pace", 0.34, 0.55, (0.0, 0.5, 0.0, 0.5), stance_width=0.7),
            Gait("canter", 0.42, 0.52, (0.0, 0.7, 0.3, 0.0)),
            Gait("transverse_gallop", 0.34, 0.50, (0.0, 0.1, 0.5, 0.6)),
            Gait("rotatory_gallop", 0.34, 0.50, (0.0, 0.1, 0.6, 0.5)),
            Gait("bound", 0.34, 0.50, (0.0, 0.0, 0.5, 0.5)),
            Gait("half_bound", 0.34, 0.50, (0.0, 0.12, 0.5, 0.5)),
            Gait("pronk", 0.45, 0.55, (0.0, 0.0, 0.0, 0.0), swing_height=0.04),
            Gait("limp", 0.44, 0.60, (0.0, 0.5, 0.5, 0.0), duty_offsets=(-0.15, 0.06, 0.05, 0.04)),
        )
    }
)
"""The textbook gaits by name: footfall sequences of Hildebrand, "The quadrupedal gaits of vertebrates" (1989), with
periods and duties of this robot's size, and the clock's zero where they can stand. The built-in tasks have settings of
their own for those of equal name."""


@dataclass(frozen=True)
class GaitSpace:
    """All gaits between bounds, with any four offsets.

    Attributes:
        period: of the cycle [s].
        duty: share of the cycle that a foot spends on the ground.
        duty_offset: largest difference of a leg's share from `duty`, either way.
        swing_height: clearance of a foot [m].
        stance_width: factor on the sideways distance of the footholds.
        body_height: factor on the height of the centre of mass.
        patterns: share of draws whose offsets are near those of a gait of `NAMED`, rather than anywhere.
        pattern_spread: standard deviation of their distance from it, of each leg [cycles].
        uneven: share of draws whose legs have different duties.
        count: only so many gaits are drawn, the same ones by everybody who asks for as many or more; None for any.
        holes: names of gaits of `NAMED` whose neighborhood is never drawn.
        hole_radius: `offset_distance` at which it ends [cycles].

    Raises:
        InvalidInputError: if a bound is none of a `Gait`, or out of order, or another figure is not as described.
    """

    period: Span = (0.30, 0.65)
    duty: Span = (0.45, 0.80)
    duty_offset: float = 0.1
    swing_height: Span = (0.04, 0.08)
    stance_width: Span = (0.7, 1.2)
    body_height: Span = (0.85, 1.05)
    patterns: float = 0.4
    pattern_spread: float = 0.15
    uneven: float = 0.2
    count: int | None = None
    holes: tuple[str, ...] = ()
    hole_radius: float = 0.07

    def __post_init__(self) -> None:
        """Check the bounds, and make tuples of what came."""
        for name in SPANS:
            low, high = finite_vector(getattr(self, name), 2, f"{name} of a GaitSpace")
            if low > high:
                raise InvalidInputError(f"{name} of a GaitSpace must be (smallest, largest), got {(low, high)}")
            object.__setattr__(self, name, (float(low), float(high)))
            for value in (low, high):
                Gait("bound of a GaitSpace", **(_MIDDLE | {name: float(value)}))  # refuses what no gait can have
        number_in(self.duty_offset, 0.0, 0.5, "duty_offset of a GaitSpace")
        number_in(self.pattern_spread, 0.0, 1.0, "pattern_spread of a GaitSpace [cycles]")
        for name in ("patterns", "uneven"):
            number_in(getattr(self, name), 0.0, 1.0, f"{name} of a GaitSpace")
        if self.count is not None:
            integer_in(self.count, 1, 10**9, "count of a GaitSpace")
        if isinstance(self.holes, str):
            raise InvalidInputError(f"holes of a GaitSpace must be names of gaits, got {self.holes!r}")
        object.__setattr__(
            self, "holes", tuple(one_of(name, tuple(NAMED), "hole of a GaitSpace") for name in self.holes)
        )
        number_in(self.hole_radius, 0.0, LARGEST_HOLE, "hole_radius of a GaitSpace [cycles]")

    def draw(self, rng: np.random.Generator) -> Gait:
        """A gait of the space, with its clock's zero where it can stand, if it can.

        Everything is uniform between its bounds, but for offsets that are drawn near a pattern.
        """
        if self.count is not None:
            rng = np.random.default_rng((_SEQUENCE, int(rng.integers(self.count))))
        while True:
            gait = self._drawn(rng)
            if all(offset_distance(gait, NAMED[name]) > self.hole_radius for name in self.holes):
                return gait

    def _drawn(self, rng: np.random.Generator) -> Gait:
        """A draw that may lie in a hole."""
        values = {name: float(rng.uniform(*getattr(self, name))) for name in SPANS}
        offsets = rng.uniform(0.0, 1.0, 4)
        patterned, which, spread = rng.uniform(), int(rng.integers(len(NAMED))), rng.standard_normal(4)
        if patterned < self.patterns:
            offsets = np.array([*NAMED.values()][which].offsets) + self.pattern_spread * spread
        uneven, more = rng.uniform(), rng.uniform(-self.duty_offset, self.duty_offset, 4)
        low, high = (np.array(bound) - values["duty"] for bound in self.duty)
        more = np.clip(more, low, high) if uneven < self.uneven else np.zeros(4)
        return standing_at_zero(Gait("any", **values, offsets=_turns(offsets), duty_offsets=tuple(more)))

    def contains(self, gait: Gait) -> bool:
        """Whether a gait lies between all bounds, each leg's duty included."""
        inside = all(low - 1e-9 <= getattr(gait, name) <= high + 1e-9 for name, (low, high) in self.spans.items())
        low, high = self.duty
        return inside and bool(((gait.duties >= low - 1e-9) & (gait.duties <= high + 1e-9)).all())

    def clipped(self, gait: Gait) -> Gait:
        """The gait between the bounds that is nearest, bound by bound."""
        values: dict[str, Any] = {name: float(np.clip(getattr(gait, name), *span)) for name, span in self.spans.items()}
        more = np.clip(gait.duties, *self.duty) - values["duty"]
        return replace(gait, **values, duty_offsets=tuple(more))

    @property
    def spans(self) -> dict[str, Span]:
        """Bounds by the names of a gait's figures."""
        return {name: getattr(self, name) for name in SPANS}


def mirrored(gait: Gait) -> Gait:
    """The gait with left and right exchanged."""
    offsets, more = (np.array(values)[[*OTHER_SIDE]] for values in (gait.offsets, gait.duty_offsets))
    return replace(gait, offsets=tuple(offsets), duty_offsets=tuple(more))


def offset_distance(first: Gait, second: Gait) -> float:
    """How different two footfall patterns are [cycles]: 0 for equal ones, wherever their clocks have their zero.

    The largest difference of a leg's offset, the short way round, for the turn of one clock that makes it least.

    Returns:
        From 0 to 0.5.
    """
    turns = np.mod(np.array(first.offsets) - np.array(second.offsets), 1.0)
    # the least largest distance leaves out the widest gap between neighbors on the circle
    around = np.sort(turns)
    gaps = np.diff(np.concatenate([around, around[:1] + 1.0]))
    return float((1.0 - gaps.max()) / 2)


def between(first: Gait, second: Gait, share: float) -> Gait:
    """The gait on the way from one to another; offsets go the short way round.

    Args:
        first: where it begins.
        second: where it ends, whose name the gait has.
        share: of the way, from 0 to 1.
    """
    values: dict[str, Any] = {
        name: (1 - share) * getattr(first, name) + share * getattr(second, name) for name in SPANS
    }
    way = np.mod(np.array(second.offsets) - np.array(first.offsets) + 0.5, 1.0) - 0.5
    more = (1 - share) * np.array(first.duty_offsets) + share * np.array(second.duty_offsets)
    offsets = _turns(np.array(first.offsets) + share * way)
    return replace(second, **values, offsets=offsets, duty_offsets=tuple(more))
