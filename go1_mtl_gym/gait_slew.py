"""From any gait to any other."""

from dataclasses import dataclass, replace

import numpy as np

from go1_mtl_gym.gait_space import between
from go1_mtl_gym.gaits import Gait

PHASES = 128
"""At which the clock of a gait that begins at once is looked for."""


@dataclass(frozen=True)
class GaitSlew:
    """A gait that becomes another one bit by bit, its clock running on.

    Offsets go the short way round. By how much all of them together are shifted is of no account to the feet, so the
    way leads to the wanted gait as it would be with another zero of its clock; at the end the clock is set right.

    Attributes:
        first: the gait that it was.
        wanted: the one that it will be.
        since_s: when it began to change, since the reset [s].
        seconds: how long that takes [s].
        shift: what the clock gains at the end, when the wanted gait has its own offsets again [cycles].
    """

    first: Gait
    wanted: Gait
    since_s: float
    seconds: float
    shift: float = 0.0

    def at(self, time_s: float) -> Gait:
        """The gait at a time since the reset [s]."""
        if self.is_over(time_s):
            return self.wanted
        turned = replace(self.wanted, offsets=tuple(np.mod(np.array(self.wanted.offsets) + self.shift, 1.0)))
        return between(self.first, turned, (time_s - self.since_s) / self.seconds)

    def is_over(self, time_s: float) -> bool:
        """Whether the gait is the wanted one, at a time since the reset [s]."""
        return time_s - self.since_s >= self.seconds - 1e-9


def fitting_phase(before: Gait, phase: float, after: Gait) -> float:
    """The clock at which a gait that begins at once asks least of the feet that another one has brought there.

    Every leg has a height in its cycle: in the air, the sine of how far its swing is; on the ground, below zero, the
    sine of how far its stance is. The phase is the one whose heights, and the directions in which they change, are
    nearest.

    Args:
        before: the gait until now.
        phase: its clock [cycles].
        after: the gait from now on.

    Returns:
        Its clock [cycles], in [0, 1).
    """
    grid = np.arange(PHASES) / PHASES
    here = _on_circle(before, np.array([phase]))
    away = np.abs(_on_circle(after, grid) - here) ** 2
    return float(grid[np.argmin(away.sum(axis=1))])


def _on_circle(gait: Gait, phase: np.ndarray) -> np.ndarray:
    """Where each leg is in its cycle, stance and swing drawn as half a circle each, complex, shape (n, 4)."""
    leg = gait.leg_phase(phase)
    half = np.where(leg < gait.duties, leg / gait.duties - 1.0, (leg - gait.duties) / (1.0 - gait.duties))
    return np.exp(1j * np.pi * half)
