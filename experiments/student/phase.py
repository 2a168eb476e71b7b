"""The phase that a policy is not told: asked for as two more outputs, and how well it is known."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium import spaces

import trainers
from go1_mtl_gym.sensing.observation import ObservationLayout
from trainers.policies.phase_estimator import phase_distance, unit
from trainers.policies.phase_free import student_layout

PHASE_RAD = 0.1
"""Weight of the asked phase: sine and cosine count in the loss as joints that swing by this much do [rad].

The joint targets themselves deviate from their means by about 0.1 rad, so neither drowns the other.
"""
Estimate = Callable[[trainers.Demonstrations, ObservationLayout], np.ndarray]
"""(rows, their layout) -> sine and cosine of the phase, shape (n, 2)."""


def ask_for_phase(
    policy: trainers.MultiHeadPolicy, rows: trainers.Demonstrations, phase: np.ndarray
) -> tuple[trainers.MultiHeadPolicy, trainers.Demonstrations]:
    """An untrained policy with two more outputs, and rows whose last two actions are what these should be.

    Args:
        policy: an untrained policy.
        rows: that it learns from.
        phase: sine and cosine of their clock, shape (n, 2).
    """
    asked = dataclasses.replace(
        rows,
        acts=np.hstack([rows.acts, phase]),
        center=np.append(rows.center, np.zeros(2)),
        half_range=np.append(rows.half_range, np.full(2, PHASE_RAD)),
    )
    low, high = np.append(policy.action_space.low, [-1, -1]), np.append(policy.action_space.high, [1, 1])
    return _like(policy, spaces.Box(low, high, dtype=np.float32)), asked


def without_asked(policy: trainers.MultiHeadPolicy) -> trainers.MultiHeadPolicy:
    """The trained policy with its two outputs of the phase cut off; the actions stay what they were."""
    n = policy.action_space.shape[0] - 2
    space = spaces.Box(policy.action_space.low[:n], policy.action_space.high[:n], dtype=np.float32)
    small = _like(policy, space)
    weights = policy.state_dict()
    small.load_state_dict({name: weights[name][: len(rows)] for name, rows in small.state_dict().items()})
    small.set_training_mode(False)
    return small


def _like(policy: trainers.MultiHeadPolicy, space: spaces.Box) -> trainers.MultiHeadPolicy:
    seed = 0 if policy.seed is None else policy.seed
    return trainers.MultiHeadPolicy(policy.observation_space, space, seed=seed, **policy.network_kwargs())


# -- Estimates ---------------------------------------------------------------------------------------------------------


def asked_phase(policy: trainers.MultiHeadPolicy) -> Estimate:
    """The estimate of a policy that was asked for the phase, before its outputs are cut."""
    layout = student_layout(policy)

    def estimate(rows: trainers.Demonstrations, have: ObservationLayout) -> np.ndarray:
        return unit(policy.predict(rows.select(have, layout).obs, deterministic=True)[0][:, -2:])

    return estimate


def running_phase(policy: trainers.PhaseFreePolicy) -> Estimate:
    """The clock that a policy keeps while it follows the rows of each episode."""

    def estimate(rows: trainers.Demonstrations, have: ObservationLayout) -> np.ndarray:
        seen, clocks = rows.select(have, policy.estimator.layout), []
        for episode in seen.episodes():
            state: Any = None
            for obs in seen.obs[episode]:
                _, state = policy.predict(obs[None], state, deterministic=True)
                clocks.append(state[0][0])
        return np.array(clocks)

    return estimate


def phase_error(estimate: Estimate, rows: trainers.Demonstrations, layout: ObservationLayout) -> dict[str, float]:
    """Median and 99th percentile ("p99") of the absolute error of the phase over all rows [cycles], at most 0.5.

    Args:
        estimate: of a policy.
        rows: with the phase.
        layout: of the rows.
    """
    error = phase_distance(estimate(rows, layout), rows.obs[:, layout.slices["phase"]])
    return {"median": float(np.median(error)), "p99": float(np.quantile(error, 0.99))}


def with_correction(policy: trainers.PhaseFreePolicy, correction: float) -> trainers.PhaseFreePolicy:
    """The same policy and estimator in the same world, with another correction of the clock."""
    other = trainers.PhaseFreePolicy(policy.student, policy.estimator, correction)
    other.env_kwargs = policy.env_kwargs
    other.set_training_mode(False)
    return other
