"""A student without a clock: it tells the phase of its gait from what it feels."""

import math
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.policies import BasePolicy
from tqdm.auto import tqdm

from go1_mtl_gym import TASKS
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gaits import STAND_COMMAND
from go1_mtl_gym.sensing.observation import ObservationLayout
from go1_mtl_gym.validation import one_of
from trainers.data.collection import EPISODE_S, watch
from trainers.data.demonstrations import Demonstrations
from trainers.data.environments import EnvFactory, PerturbationConfig, derive_seed, make_env
from trainers.policies.checkpoint import SavedPolicy
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.policies.phase_estimator import PhaseConfig, PhaseEstimator, train_phase, unit

PHASE_0 = np.array([0.0, 1.0], dtype=np.float32)
"""Sine and cosine of phase 0."""


class PhaseFreePolicy(SavedPolicy, BasePolicy):
    """A student that learned with a gait clock, and an estimator that takes the clock's place.

    Its observation is the student's without the phase, with as many frames of proprioception as the estimator reads.
    The estimate e (sine, cosine) corrects a clock c that the policy keeps as its state:

        c' = unit((1 - correction) R c + correction e),

    where R turns by one control period of the gait. With a correction of 1 there is no memory: the action is a function
    of the observation. Below 1 it is a clock with correction, which stands while the command asks for it and starts at
    phase 0 with an episode and with a change of task.

    Args:
        student: sees the channels "command" and "phase"; its `env_kwargs` name its tasks.
        estimator: of the same tasks, and of the student's channels but for the phase.
        correction: in (0, 1].

    Raises:
        InvalidInputError: if the two do not fit together, a task is not registered, or the correction is outside its
            range.
    """

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
        for name in layout.tasks:
            one_of(name, tuple(TASKS), "task")
        super().__init__(spaces.Box(layout.low, layout.high, dtype=np.float32), student.action_space)
        self.student = student
        self.estimator = estimator
        self.correction = float(correction)
        self.n_tasks = layout.n_tasks
        channels = {"channels": layout.channels, "history": layout.history}
        self.env_kwargs = student.env_kwargs | {"tasks": layout.tasks} | channels
        gaits = [TASKS[name].gait for name in layout.tasks]
        self._turn = np.array([1.0 / (gait.period * self.env_kwargs.get("control_hz", 50)) for gait in gaits])
        self._can_stand = np.array([gait.can_stand for gait in gaits])
        self._command = layout.slices["command"]
        self._columns = layout.columns(phase_free_layout(student, 1))
        self._phase = clocked.slices["phase"].start

    def predict(
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

    def _predict(self, observation: torch.Tensor, deterministic: bool = False) -> torch.Tensor:
        actions, _ = self.predict(observation.cpu().numpy(), deterministic=deterministic)
        return torch.as_tensor(actions, device=self.device)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        """All that rebuilds an equal policy, but for the weights."""
        return {"student": self.student, "estimator": self.estimator, "correction": self.correction}

    # -- Files ---------------------------------------------------------------------------------------------------------


def train_phase_free(
    student: MultiHeadPolicy,
    seconds: float = 240.0,
    history: int = 10,
    *,
    correction: float = 1.0,
    perturbation: PerturbationConfig | None = None,
    config: PhaseConfig | None = None,
    seed: int = 0,
    progress: bool = False,
    make_env: EnvFactory = make_env,
    **env_kwargs: Any,
) -> PhaseFreePolicy:
    """Watch a student walk with its clock, and train an estimator of the phase from what it felt; no expert is asked.

    Args:
        student: a trained one.
        seconds: watched per task [s].
        history: frames of proprioception that the estimator reads.
        correction: of the policy that is returned.
        perturbation: of the walks; None is the default `PerturbationConfig`.
        config: how to train the estimator.
        seed: of the walks and of the initial weights.
        progress: show bars.
        make_env: another environment factory.
        env_kwargs: of the environment; on top of the student's own ``env_kwargs``.

    Raises:
        InvalidInputError: if the student sees no command and phase, or a figure is outside its range.
        CollectionError: if the student keeps falling.
    """
    estimator = PhaseEstimator(phase_free_layout(student, history), seed=seed)
    policy = PhaseFreePolicy(student, estimator, correction)
    shards = max(1, math.ceil(seconds / EPISODE_S))
    walks = [(task, derive_seed("watch", seed, i)) for i in range(shards) for task in estimator.layout.tasks]
    perturbation = perturbation or PerturbationConfig()
    watched = [
        watch(student, task, own, seconds / shards, perturbation, history, make_env=make_env, **env_kwargs)
        for task, own in tqdm(walks, "watch", unit="walk", disable=not progress)
    ]
    rows = Demonstrations.concatenate([rows for rows, _ in watched])
    train_phase(estimator, rows, watched[0][1], config, progress)
    return policy


def without_phase(channels: tuple[str, ...]) -> tuple[str, ...]:
    """The channels but for the phase."""
    return tuple(name for name in channels if name != "phase")


def phase_free_layout(student: MultiHeadPolicy, history: int) -> ObservationLayout:
    """What an estimator for a student sees: its channels but for the phase, and `history` frames."""
    clocked = student_layout(student)
    return ObservationLayout(clocked.tasks, without_phase(clocked.channels), history)


def student_layout(policy: Any) -> ObservationLayout:
    """The layout of a policy's observations, by its `env_kwargs`.

    Raises:
        InvalidInputError: if its observations have another size.
    """
    kwargs = policy.env_kwargs
    layout = ObservationLayout(
        tuple(kwargs.get("tasks") or TASKS), kwargs.get("channels", ()), kwargs.get("history", 1)
    )
    if policy.observation_space.shape != (layout.size,):
        raise InvalidInputError(
            f"by its env_kwargs the policy's observations have {layout.size} entries, its space is "
            f"{policy.observation_space.shape}"
        )
    return layout


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
