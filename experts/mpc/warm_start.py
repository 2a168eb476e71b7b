"""Trajectories that the MPC predicted, and the two options of the expert that remember them."""

from dataclasses import dataclass

import numpy as np

from experts.mpc.frame import WORLD, Frame
from experts.mpc.srbd import FORCE_UNIT
from go1_mtl_gym.gaits import Gait
from go1_mtl_gym.sensing.state import RobotState

LEAST_CONTACT = 0.25
"""A force is raised at most to that of a foot that stands during this fraction of an interval."""


@dataclass(frozen=True)
class Trajectory:
    """What one solve predicted.

    Attributes:
        time_s: when it begins, in the episode's time [s].
        gait: the contact plan that it was made for.
        dt: interval [s].
        states: x at the N + 1 ends of the intervals, shape (N + 1, 12).
        inputs: u during the intervals, in units of `FORCE_UNIT`, shape (N, 12).
        contact: fraction of its interval over which each force is the mean, and on the rest of which its foot is in the
            air, shape (N, 4).
        frame: that states and inputs are in.
    """

    time_s: float
    gait: Gait
    dt: float
    states: np.ndarray
    inputs: np.ndarray
    contact: np.ndarray
    frame: Frame = WORLD

    def shifted(
        self, time_s: float, frame: Frame, reference: np.ndarray, nominal: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """States and inputs of the same trajectory on a grid that begins later; the reference beyond its end.

        Args:
            time_s: beginning of the grid [s].
            frame: of the answer, the reference and the nominal inputs.
            reference: states of the reference on that grid, shape (N + 1, 12).
            nominal: its inputs, shape (N, 12).
        """
        steps = len(self.inputs)
        # Places on the old grid, in intervals: states lie at its ends, and inputs act in the middles.
        where = (time_s - self.time_s) / self.dt + np.arange(steps + 1)
        low = np.clip(where.astype(int), 0, steps - 1)
        fraction = (where - low)[:, None]
        states = frame.states((1 - fraction) * self.states[low] + fraction * self.states[low + 1], self.frame)
        beyond = where > steps + 1e-9
        states[beyond] = reference[beyond]
        middle = (where[:-1] + 0.5).astype(int)
        forces = self.inputs[np.minimum(middle, steps - 1)].reshape(steps, 4, 3)
        forces = frame.vectors(forces @ self.frame.rotation.T).reshape(steps, 12)
        return states, np.where((middle < steps)[:, None], forces, nominal)

    def forces_w(self, time_s: float) -> np.ndarray:
        """Ground forces planned for a time within the horizon, world [N], shape (4, 3).

        Planned are means over whole intervals; a foot that stands during a part of one has to push harder then.
        """
        k = int((time_s - self.time_s) / self.dt + 1e-9)  # rounding must not throw the beginning back by one
        k = min(max(k, 0), len(self.inputs) - 1)
        forces = self.inputs[k].reshape(4, 3) * FORCE_UNIT / np.maximum(self.contact[k], LEAST_CONTACT)[:, None]
        return forces @ self.frame.rotation.T


class Recall:
    """The last trajectory and the one before it; asking again at the same time changes nothing."""

    def __init__(self) -> None:
        self._last: Trajectory | None = None
        self._before: Trajectory | None = None

    def before(self, state: RobotState) -> Trajectory | None:
        """The newest trajectory of this gait that began earlier than now; None if it is useless by now."""
        for trajectory in (self._last, self._before):
            if trajectory is not None and trajectory.gait == state.gait:
                age = state.time_s - trajectory.time_s
                if 0 < age < state.gait.period:
                    return trajectory
        return None

    def at(self, state: RobotState, period_s: float) -> Trajectory | None:
        """The last trajectory of this gait if it is younger than a period [s]; one that begins now is younger."""
        last = self._last
        if last is None or last.gait != state.gait or not -1e-9 < state.time_s - last.time_s < period_s - 1e-9:
            return None
        return last

    def store(self, trajectory: Trajectory) -> None:
        """Remember one; it replaces another of the same time."""
        # Asked twice at one time, the expert must start from the same earlier trajectory both times.
        if self._last is not None and self._last.time_s < trajectory.time_s:
            self._before = self._last
        self._last = trajectory
