"""A student without a clock: it tells the phase of its gait from what it feels."""

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.policies import BasePolicy

from go1_mtl_gym.contract import terms_of
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gaits import STAND_COMMAND
from go1_mtl_gym.sensing.observation import ObservationLayout
from trainers.policies.checkpoint import Checkpoint, SavedPolicy, tensors_of
from trainers.policies.environment import ForEnvironment
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.policies.phase_estimator import PhaseEstimator, unit

PHASE_0 = np.array([0.0, 1.0], dtype=np.float32)
"""Sine and cosine of phase 0."""


class PhaseFreePolicy(SavedPolicy, ForEnvironment, BasePolicy):
    """A student that learned with a gait clock, and an estimator that takes the clock's place.

    Its observation is the student's without the phase, with as many frames of proprioception as the estimator reads.
    The estimate e (sine, cosine) corrects a clock c that the policy keeps as its state:

        c' = unit((1 - correction) R c + correction e),

    where R turns by one control period of the gait. With a correction of 1 there is no memory: the action is a function
    of the observation. Below 1 it is a clock with correction, which stands while the command asks for it and starts at
    phase 0 with an episode and with a change of task.

    Args:
        student: sees the channels "command" and "phase"; its contract names its gaits.
        estimator: of the same tasks, and of the student's channels but for the phase.
        correction: in (0, 1].

    Raises:
        InvalidInputError: if the two do not fit together, or the correction is outside its range.
    """

    kind = "phase_free"
    weight_files = ("weights", "phase")

    def __init__(self, student: MultiHeadPolicy, estimator: PhaseEstimator, correction: float = 1.0) -> None:
        layout = estimator.layout
        clocked = student_layout(student)
        if not {"command", "phase"} <= set(clocked.channels) or clocked.history != 1:
            raise InvalidInputError(f"the student must see command, phase and one frame, got {clocked.channels}")
        if layout.tasks != clocked.tasks or layout.channels != without_phase(clocked.channels):
            raise InvalidInputError(
                f"the estimator must have the tasks {clocked.tasks} and the channels "
                f"{without_phase(clocked.channels)}, got {layout.tasks} and {layout.channels}"
            )
        if not 0 < correction <= 1:
            raise InvalidInputError(f"correction must lie in (0, 1], got {correction!r}")
        super().__init__(spaces.Box(layout.low, layout.high, dtype=np.float32), student.action_space)
        self.student = student
        self.estimator = estimator
        self.correction = float(correction)
        self.n_tasks = layout.n_tasks
        contract = student.named_contract().with_terms(terms_of(layout))
        self.contract = contract
        if estimator.contract is not None:
            self.contract.check(estimator.contract, "the student", "the phase estimator")
        estimator.contract = self.contract
        self.extra_env_kwargs = student.extra_env_kwargs
        gaits = [gait for gait in contract.gaits if gait is not None]
        if len(gaits) < layout.n_tasks:
            raise InvalidInputError("a student whose contract names the gaits of its tasks was expected")
        self._turn = np.array([1.0 / (gait.period * contract.control_hz) for gait in gaits])
        self._can_stand = np.array([gait.can_stand for gait in gaits])
        self._command = layout.slices["command"]
        self._columns = layout.columns(phase_free_layout(student, 1))
        self._phase = clocked.slices["phase"].start

    def predict(  # type: ignore[override]  # flat spaces: never a dict
        self,
        observation: np.ndarray,
        state: tuple[np.ndarray, ...] | None = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = False,
    ) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
        """Actions of one observation (D,) or a batch (n, D), and the state for the next call.

        Args:
            observation: of any mix of tasks.
            state: what the last call returned for the same environments: clocks (n, 2) and task indices (n,); None at
                the beginning.
            episode_start: True where an episode begins, bool, shape (n,); None where none does.
            deterministic: without exploration noise.

        Raises:
            InvalidInputError: if an observation has another size or is not finite, or does not end in a task id; with a
                correction below 1 also if the state is that of another number of environments.
        """
        obs = np.asarray(observation, dtype=np.float32)
        rows = obs.reshape(-1, obs.shape[-1])
        if rows.shape[1] != self.estimator.layout.size or not np.isfinite(rows).all():
            raise InvalidInputError(
                f"observations must hold {self.estimator.layout.size} finite numbers, got {obs.shape} "
                f"with {int((~np.isfinite(rows)).sum())} that are not finite"
            )
        task = rows[:, -self.n_tasks :].argmax(axis=1)
        clock = self.estimator.estimate(rows)
        if self.correction < 1:
            before, anew = _memory(task, state, episode_start)
            later = np.where(anew, 0.0, before + self._turn[task])
            clock = unit((1 - self.correction) * _sine_cosine(later) + self.correction * clock)
            clock[self._rests(rows, task, before, _turns(clock))] = PHASE_0
        actions, _ = self.student.predict(self._with_clock(rows, clock), deterministic=deterministic)
        return actions.reshape(*obs.shape[:-1], actions.shape[-1]), (clock, task)

    def _rests(self, rows: np.ndarray, task: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Where a clock rests at phase 0: the command asks for it, and the clock was there or has come past it."""
        asked = (np.abs(rows[:, self._command]) < STAND_COMMAND).all(axis=1) & self._can_stand[task]
        forward = (after - before) % 1.0 < 0.5
        return asked & ((before == 0.0) | (forward & (after < before)))

    def _with_clock(self, rows: np.ndarray, clock: np.ndarray) -> np.ndarray:
        """The student's observations."""
        before, after = np.split(rows[:, self._columns], [self._phase], axis=1)
        return np.concatenate([before, clock, after], axis=1)

    def _predict(  # type: ignore[override]  # flat spaces: never a dict
        self, observation: torch.Tensor, deterministic: bool = False
    ) -> torch.Tensor:
        actions, _ = self.predict(observation.cpu().numpy(), deterministic=deterministic)
        return torch.as_tensor(actions, device=self.device)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        """All that rebuilds an equal policy, but for the weights."""
        return {"student": self.student, "estimator": self.estimator, "correction": self.correction}

    # -- Files ---------------------------------------------------------------------------------------------------------

    def to_checkpoint(self) -> Checkpoint:
        """All that `from_checkpoint` needs."""
        student = self.student.to_checkpoint()
        phase = {
            "history": self.estimator.layout.history,
            "width": self.estimator.width,
            "correction": self.correction,
        }
        weights = student.weights | {"phase": tensors_of(self.estimator)}
        return Checkpoint(self.kind, {"student": student.policy, "phase": phase}, weights)

    @classmethod
    def from_checkpoint(cls, checkpoint: Checkpoint) -> "PhaseFreePolicy":
        """An equal policy."""
        values = checkpoint.policy
        student = MultiHeadPolicy.from_checkpoint(
            Checkpoint(MultiHeadPolicy.kind, values["student"], checkpoint.weights)
        )
        phase = values["phase"]
        estimator = PhaseEstimator(phase_free_layout(student, phase["history"]), phase["width"])
        estimator.load_state_dict(checkpoint.weights["phase"])
        return cls(student, estimator, phase["correction"])


def without_phase(channels: tuple[str, ...]) -> tuple[str, ...]:
    """The channels but for the phase."""
    return tuple(name for name in channels if name != "phase")


def phase_free_layout(student: MultiHeadPolicy, history: int) -> ObservationLayout:
    """What an estimator for a student sees: its channels but for the phase, and `history` frames."""
    clocked = student_layout(student)
    return ObservationLayout(clocked.tasks, without_phase(clocked.channels), history)


def student_layout(student: MultiHeadPolicy) -> ObservationLayout:
    """The layout of a student's observations.

    Raises:
        InvalidInputError: if it has no contract, or one that is not of a Go1's observation.
    """
    contract = student.contract
    if contract is None:
        raise InvalidInputError("a student with a contract was expected: it says where command and phase stand")
    return contract.layout


def _memory(
    task: np.ndarray, state: tuple[np.ndarray, ...] | None, starts: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """The clocks before this period [cycles], and where they begin anew, at phase 0; each of shape (n,)."""
    if state is None:
        return np.zeros(len(task)), np.ones(len(task), dtype=bool)
    clock, earlier = state
    if len(earlier) != len(task):
        raise InvalidInputError(f"a state of {len(task)} environments was expected, got one of {len(earlier)}")
    anew = task != earlier
    if starts is not None:
        anew |= np.asarray(starts, dtype=bool)
    return np.where(anew, 0.0, _turns(clock)), anew


def _turns(clock: np.ndarray) -> np.ndarray:
    """The phases [cycles] of sines and cosines of shape (n, 2)."""
    return np.arctan2(clock[:, 0], clock[:, 1]) / (2 * np.pi) % 1.0


def _sine_cosine(turns: np.ndarray) -> np.ndarray:
    """Sines and cosines, shape (n, 2), of phases [cycles]."""
    return np.stack([np.sin(2 * np.pi * turns), np.cos(2 * np.pi * turns)], axis=1)
