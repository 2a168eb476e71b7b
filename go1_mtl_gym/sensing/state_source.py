"""Where an expert gets its state from: the physics, an estimator, or the physics with an estimator's errors."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from go1_mtl_gym.sensing.state import RobotState


class StateSource(Protocol):
    """What an episode asks of the place that its expert's state comes from."""

    def begin(self, state: RobotState, readings: Mapping[str, np.ndarray]) -> None:
        """Begin an episode.

        Args:
            state: the true one.
            readings: "accelerometer", "gyroscope", "q", "dq" and "contacts", as in the observation; not to be changed.
        """

    def advance(self, readings: Mapping[str, np.ndarray], seconds: float) -> None:
        """Let a control period pass.

        Args:
            readings: as of `begin`, after the period.
            seconds: its length [s].
        """

    def estimate(self, state: RobotState) -> RobotState:
        """What an expert is told when this is the true state; changes nothing."""


class TrueState:
    """The state as the physics has it."""

    def begin(self, state: RobotState, readings: Mapping[str, np.ndarray]) -> None:
        """Nothing has to be known beforehand."""

    def advance(self, readings: Mapping[str, np.ndarray], seconds: float) -> None:
        """Nothing has to be remembered."""

    def estimate(self, state: RobotState) -> RobotState:
        """The state itself."""
        return state
