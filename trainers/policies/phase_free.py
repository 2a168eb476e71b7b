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
from go1_mtl_gym.validation import integer_in
from trainers.policies.checkpoint import Checkpoint, SavedPolicy, tensors_of
from trainers.policies.clock_memory import ClockMemory, State
from trainers.policies.environment import ForEnvironment
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.policies.phase_estimator import PhaseEstimator, unit

PHASE_0 = np.array([0.0, 1.0], dtype=np.float32)
"""Sine and cosine of phase 0."""
NO_TASK = -1
"""In a state, for a clock that has not begun."""
CORRECTION = 0.2
"""Share of the estimate in the clock at every step, by default."""


class PhaseFreePolicy(SavedPolicy, ForEnvironment, BasePolicy):
    """A student that learned with a gait clock, and an estimator that takes the clock's place.

    Its observation is the student's without the phase, with as many frames of proprioception as the estimator reads.
    The estimate e (sine, cosine) corrects a clock c that the policy keeps as its state:

        c' = unit((1 - correction) R c + correction e),

    where R turns by one control period of the gait. It is a clock with correction, which stands while the command asks
    for it and starts at phase 0 with an episode and with a change of task. With a correction of 1 there is no memory:
    the action is a function of the observation.

    Who hands no state back need not: the policy remembers the clocks of its last call without one, for one robot or a
    batch of constant size. `reset` or an `episode_start` begins a new episode. Copies and pickles begin anew, files
    hold no memory.

    Args:
        student: sees the channels "command" and "phase"; its contract names its gaits.
        estimator: of the same tasks, and of the student's channels but for the phase.
        correction: in (0, 1].

    Raises:
        InvalidInputError: if the two do not fit together, or the correction is outside its range.
    """

    kind = "phase_free"
    weight_files = ("weights", "phase")

    def __init__(self, student: MultiHeadPolicy, estimator: PhaseEstimator, correction: float = CORRECTION) -> None:
        layout = estimator.layout
        clocked = student_layout(student)
        if not {"command", "phase"} <= set(clocked.channels):
            raise InvalidInputError(f"the student must see command and phase, got {clocked.channels}")
        if clocked.history > layout.history:
            raise InvalidInputError(
                f"the estimator must read at least the student's {clocked.history} frames, got {layout.history}"
            )
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
        self._memory = ClockMemory()
        self._turn = np.array([1.0 / (gait.period * contract.control_hz) for gait in gaits])
        self._can_stand = np.array([gait.can_stand for gait in gaits])
        self._command = layout.slices["command"]
        self._columns = layout.columns(phase_free_layout(student, clocked.history))
        self._phase = clocked.slices["phase"].start

    def predict(  # type: ignore[override]  # flat spaces: never a dict
        self,
        observation: np.ndarray,
        state: State | None = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = False,
    ) -> tuple[np.ndarray, State]:
        """Actions of one observation (D,) or a batch (n, D), and the state for the next call.

        Args:
            observation: of any mix of tasks.
            state: what the last call returned for the same environments: clocks (n, 2) and task indices (n,). None goes
                on from the last call without a state, or begins anew if there is none; if that had another number of
                observations it begins anew too, and warns once. A call with a state leaves alone what is remembered
                for calls without. Whoever keeps states begins with `initial_state`, or with None.
            episode_start: True where an episode begins, one bool or shape (n,); None where none does.
            deterministic: without exploration noise.

        Raises:
            InvalidInputError: if an observation has another size or is not finite, or does not end in a task id, or
                there are not as many entries in `episode_start`; with a correction below 1 also if the state is that of
                another number of environments.
        """
        obs, rows = self._checked(observation)
        starts = _checked_starts(episode_start, len(rows))
        task, clock = rows[:, -self.n_tasks :].argmax(axis=1), self.estimator.estimate(rows)
        if self.correction == 1:
            return self._actions(obs, rows, clock, deterministic), (clock, task)
        before = self._memory.recall(len(rows), starts) if state is None else state
        clock = self._corrected(rows, task, clock, before, starts)
        actions, after = self._actions(obs, rows, clock, deterministic), (clock, task)
        if state is None:
            self._memory.keep(after, began=before is None)
        else:
            self._memory.handed_back(state)
        return actions, after

    def reset(self) -> None:
        """Forget the clocks: the next call without a state begins anew in every row."""
        self._memory.forget()

    def initial_state(self, n: int = 1) -> State:
        """The state that begins anew, for who keeps the states of n environments.

        Raises:
            InvalidInputError: if n is no whole number of at least 0.
        """
        n = integer_in(n, 0, 10**9, "number of environments")
        return np.tile(PHASE_0, (n, 1)), np.full(n, NO_TASK)

    def with_correction(self, correction: float) -> "PhaseFreePolicy":
        """The same student and estimator with another correction, and nothing remembered.

        Args:
            correction: in (0, 1]; 1 is for observations that do not follow one another in time.

        Raises:
            InvalidInputError: if it is outside its range.
        """
        other = PhaseFreePolicy(self.student, self.estimator, correction)
        other.extra_env_kwargs, other.training = self.extra_env_kwargs, self.training
        return other

    def __getstate__(self) -> dict[str, Any]:
        """For copies and pickles: they begin anew."""
        return self.__dict__ | {"_memory": ClockMemory()}

    def _checked(self, observation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Observations as they came, and as rows (n, D)."""
        obs = np.ascontiguousarray(observation, dtype=np.float32)
        rows = obs.reshape(-1, obs.shape[-1])
        if rows.shape[1] != self.estimator.layout.size or not np.isfinite(rows).all():
            raise InvalidInputError(
                f"observations must hold {self.estimator.layout.size} finite numbers, got {obs.shape} "
                f"with {int((~np.isfinite(rows)).sum())} that are not finite"
            )
        return obs, rows

    def _corrected(
        self, rows: np.ndarray, task: np.ndarray, estimate: np.ndarray, state: State | None, starts: np.ndarray
    ) -> np.ndarray:
        """The clocks of this period, shape (n, 2), from the state of the last one."""
        before, anew = _clocks_before(task, state, starts)
        later = np.where(anew, 0.0, before + self._turn[task])
        clock = unit((1 - self.correction) * _sine_cosine(later) + self.correction * estimate)
        clock[self._rests(rows, task, before, _turns(clock))] = PHASE_0
        return clock

    def _rests(self, rows: np.ndarray, task: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Where a clock rests at phase 0: the command asks for it, and the clock was there or has come past it."""
        asked = (np.abs(rows[:, self._command]) < STAND_COMMAND).all(axis=1) & self._can_stand[task]
        forward = (after - before) % 1.0 < 0.5
        return asked & ((before == 0.0) | (forward & (after < before)))

    def _actions(self, obs: np.ndarray, rows: np.ndarray, clock: np.ndarray, deterministic: bool) -> np.ndarray:
        """The student's, in the shape that the observations came in."""
        actions, _ = self.student.predict(self._with_clock(rows, clock), deterministic=deterministic)
        return actions.reshape(*obs.shape[:-1], actions.shape[-1])

    def _with_clock(self, rows: np.ndarray, clock: np.ndarray) -> np.ndarray:
        """The student's observations."""
        before, after = np.split(rows[:, self._columns], [self._phase], axis=1)
        return np.concatenate([before, clock, after], axis=1)

    def _predict(  # type: ignore[override]  # flat spaces: never a dict
        self, observation: torch.Tensor, deterministic: bool = False
    ) -> torch.Tensor:
        """Actions of rows by themselves, shape (n, 12): the phase is as estimated, and nothing is remembered."""
        obs, rows = self._checked(observation.cpu().numpy())
        actions = self._actions(obs, rows, self.estimator.estimate(rows), deterministic)
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


def _checked_starts(episode_start: np.ndarray | None, n: int) -> np.ndarray:
    """Where episodes begin, bool, shape (n,)."""
    starts = np.asarray(False if episode_start is None else episode_start, dtype=bool)
    if starts.shape not in ((), (n,)):
        raise InvalidInputError(f"episode_start must be one bool or {n}, one an observation, got shape {starts.shape}")
    return np.broadcast_to(starts, n)


def _clocks_before(task: np.ndarray, state: State | None, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The clocks before this period [cycles], and where they begin anew, at phase 0; each of shape (n,)."""
    if state is None:
        return np.zeros(len(task)), np.ones(len(task), dtype=bool)
    clock, earlier = state
    if len(earlier) != len(task):
        raise InvalidInputError(f"a state of {len(task)} environments was expected, got one of {len(earlier)}")
    anew = starts | (task != earlier)
    return np.where(anew, 0.0, _turns(clock)), anew


def _turns(clock: np.ndarray) -> np.ndarray:
    """The phases [cycles] of sines and cosines of shape (n, 2)."""
    return np.arctan2(clock[:, 0], clock[:, 1]) / (2 * np.pi) % 1.0


def _sine_cosine(turns: np.ndarray) -> np.ndarray:
    """Sines and cosines, shape (n, 2), of phases [cycles]."""
    return np.stack([np.sin(2 * np.pi * turns), np.cos(2 * np.pi * turns)], axis=1)
