"""Gaits as data, and the gait clock: when each foot is on the ground, where it stands, how high it swings."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from types import MappingProxyType

import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import Limits, check_numbers, finite_vector, number_in

STAND_COMMAND = (0.02, 0.02, 0.04)
"""A command with smaller |vx|, |vy| [m/s] and |yaw rate| [rad/s] asks for a stand."""
PHASE_SLACK = 1e-9
"""Of the clock [cycles]: fractions of a cycle that are added up end a little below the whole."""
_ALLOWED = {
    "period": Limits(0.15, 3.0, " [s]"),
    "duty": Limits(0.2, 0.95),
    "swing_height": Limits(0.01, 0.2, " [m]"),
    "stance_width": Limits(0.3, 1.5),
    "body_height": Limits(0.6, 1.2),
}


@dataclass(frozen=True)
class Gait:
    """A periodic contact plan.

    The gait clock `phase` counts cycles; leg i is at (phase + offsets[i]) mod 1 of its own cycle, on the ground while
    that is below its `duties` and in the air for the rest.

    Attributes:
        name: what people call it.
        period: duration of a cycle [s].
        duty: share of the cycle that a foot spends on the ground.
        offsets: phase offset of each leg in cycles, order FL, FR, RL, RR.
        swing_height: clearance of a foot in the middle of its swing [m].
        stance_width: sideways distance of the footholds from the middle line, as a factor on the standing robot's.
        body_height: mean height of the centre of mass, as a factor on the standing robot's.
        duty_offsets: what each leg spends on the ground beyond `duty`, order FL, FR, RL, RR; negative for less.

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    name: str
    period: float
    duty: float
    offsets: tuple[float, float, float, float]
    swing_height: float = 0.06
    stance_width: float = 1.0
    body_height: float = 1.0
    duty_offsets: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the numbers, and make them Python's."""
        if not isinstance(self.name, str) or not self.name:
            raise InvalidInputError(f"a gait needs a name, got {self.name!r}")
        check_numbers(self, _ALLOWED, suffix=f" of gait {self.name!r}")
        offsets = finite_vector(self.offsets, 4, f"offsets of gait {self.name!r}")
        object.__setattr__(self, "offsets", tuple(offsets.tolist()))  # a gait can be hashed and compared
        more = finite_vector(self.duty_offsets, 4, f"duty_offsets of gait {self.name!r}")
        object.__setattr__(self, "duty_offsets", tuple(more.tolist()))
        low, high, _ = _ALLOWED["duty"]
        if not ((self.duties >= low) & (self.duties <= high)).all():
            raise InvalidInputError(
                f"duty and duty_offsets of gait {self.name!r} must add up to {low:g} to {high:g} for every leg, got "
                f"{self.duties.tolist()}"
            )

    @cached_property
    def duties(self) -> np.ndarray:
        """Share of its cycle that each leg spends on the ground, shape (4,), read-only."""
        duties = self.duty + np.array(self.duty_offsets)
        duties.flags.writeable = False
        return duties

    @property
    def stance_s(self) -> np.ndarray:
        """Time of each leg on the ground per cycle [s], shape (4,)."""
        return self.duties * self.period

    @property
    def swing_s(self) -> np.ndarray:
        """Time of each leg in the air per cycle [s], shape (4,)."""
        return (1.0 - self.duties) * self.period

    @property
    def step_rate(self) -> float:
        """Touchdowns per leg per second [1/s]."""
        return 1.0 / self.period

    @property
    def can_stand(self) -> bool:
        """Whether all feet are on the ground at phase 0, where the clock may stop."""
        return bool(self.stance(0.0).all())

    @cached_property
    def change_phase(self) -> float | None:
        """Where a robot can leave this gait for another; None if anywhere.

        A gait that throws all feet into the air at once and lands on all is left in the middle of its stance, where the
        body neither rises nor falls.
        """
        flies = not self.stance(np.linspace(0.0, 1.0, 200, endpoint=False)).any(axis=1).all()
        return float((self.duties - self.leg_phase(0.0)).min() / 2) if flies and self.can_stand else None

    @property
    def nominal_feet_b(self) -> np.ndarray:
        """Points of the trunk frame under which the feet stand in this gait [m], shape (4, 3), read-only.

        `robot.NOMINAL_FOOT_B` with y times `stance_width`.
        """
        return _nominal_feet_b(self.stance_width)

    @property
    def numbers(self) -> np.ndarray:
        """Period, duty of each leg, offsets, swing height, stance width and body height in a row, shape (12,)."""
        return np.array(
            [self.period, *self.duties, *self.offsets, self.swing_height, self.stance_width, self.body_height]
        )

    @cached_property
    def _offsets(self) -> np.ndarray:
        return np.array(self.offsets)

    def leg_phase(self, phase: float | np.ndarray) -> np.ndarray:
        """Position of each leg in its own cycle, in [0, 1); shape of `phase` + (4,)."""
        return np.mod(np.asarray(phase, dtype=np.float64)[..., None] + self._offsets, 1.0)

    def stance(self, phase: float | np.ndarray) -> np.ndarray:
        """Which legs should be on the ground; bool, shape of `phase` + (4,)."""
        return self.leg_phase(phase) < self.duties

    def contact_schedule(self, phase: float, dt: float, steps: int) -> np.ndarray:
        """Share of each coming interval that a leg spends on the ground.

        Args:
            phase: the clock now [cycles].
            dt: length of an interval [s].
            steps: number of intervals.

        Returns:
            Shape (steps, 4), in [0, 1]: 1 is on the ground throughout, 0 in the air throughout.
        """
        edges = phase + np.arange(steps + 1) * (dt / self.period)
        turns = edges[:, None] + self._offsets
        ground = np.floor(turns) * self.duties + np.minimum(np.mod(turns, 1.0), self.duties)
        return np.clip(np.diff(ground, axis=0) / (dt / self.period), 0.0, 1.0)


def gait_of(numbers: np.ndarray, name: str) -> Gait:
    """The gait that has these `Gait.numbers`, shape (12,), up to rounding.

    Raises:
        InvalidInputError: if there is none.
    """
    period, *legs, swing_height, stance_width, body_height = finite_vector(numbers, 12, "numbers of a gait").tolist()
    duties = np.array(legs[:4])
    duty = float(duties.mean())
    more = tuple((duties - duty).tolist())
    return Gait(name, period, duty, tuple(legs[4:]), swing_height, stance_width, body_height, more)


@lru_cache(maxsize=64)
def _nominal_feet_b(stance_width: float) -> np.ndarray:
    feet = robot.NOMINAL_FOOT_B * np.array([1.0, stance_width, 1.0])
    feet.flags.writeable = False
    return feet


GAITS = MappingProxyType(
    {
        gait.name: gait
        for gait in (
            Gait("trot", period=0.40, duty=0.55, offsets=(0.0, 0.5, 0.5, 0.0), swing_height=0.06),
            Gait("bound", period=0.32, duty=0.45, offsets=(0.0, 0.0, 0.5, 0.5), swing_height=0.06),
            Gait("jump", period=0.45, duty=0.55, offsets=(0.0, 0.0, 0.0, 0.0), swing_height=0.04),
            Gait("walk", period=0.60, duty=0.78, offsets=(0.25, 0.75, 0.0, 0.5), swing_height=0.06),
            Gait("pace", period=0.32, duty=0.55, offsets=(0.0, 0.5, 0.0, 0.5), swing_height=0.05, stance_width=0.7),
            Gait("gallop", period=0.32, duty=0.50, offsets=(0.0, 0.1, 0.5, 0.6), swing_height=0.06),
        )
    }
)
"""The built-in gaits by name."""


# -- The clock ---------------------------------------------------------------------------------------------------------


def asks_to_stand(gait: Gait, command: np.ndarray) -> bool:
    """Whether the gait can stand and the filtered command, shape (3,), is about zero."""
    return bool((np.abs(command) < STAND_COMMAND).all()) and gait.can_stand


def is_standing(gait: Gait, phase: float, command: np.ndarray) -> bool:
    """Whether the clock rests: at phase 0 of a gait that can stand there, under a command that asks for it."""
    return phase == 0.0 and asks_to_stand(gait, command)


def next_phase(gait: Gait, phase: float, command: np.ndarray, seconds: float) -> float:
    """The clock [cycles], in [0, 1), after some time under one filtered command.

    It gains seconds / period. A command that asks for a stand lets it run on to the next phase 0, where it rests at
    exactly 0.0.
    """
    turns = phase + seconds / gait.period
    if asks_to_stand(gait, command) and (phase == 0.0 or turns >= 1.0 - PHASE_SLACK):
        return 0.0
    return turns % 1.0


def passes(mark: float, before: float, after: float) -> bool:
    """Whether the clock came to, or past, a phase between two readings less than a cycle apart; all in [0, 1)."""
    return (mark - before) % 1.0 <= (after - before) % 1.0


def check_phase(phase: object) -> float:
    """Return a phase of the gait clock [cycles].

    Raises:
        InvalidInputError: if it is no number in [0, 1).
    """
    number = number_in(phase, 0.0, 1.0, "phase [cycles]")
    if number == 1.0:
        raise InvalidInputError("phase [cycles] must lie in [0, 1), got 1")
    return number
