"""The phase that a policy is not told: asked for as two more outputs, and how well it is known."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium import spaces

import trainers
from go1_mtl_gym.contract import PolicyContract
from trainers.policies.phase_estimator import phase_distance, unit

PHASE_RAD = 0.1
"""Weight of the asked phase: sine and cosine count in the loss as joints that swing by this much do [rad].

The joint targets themselves deviate from their means by about 0.1 rad, so neither drowns the other.
"""
Estimate = Callable[[trainers.Demonstrations], np.ndarray]
"""Sine and cosine of the phase at every row, shape (n, 2)."""


def ask_for_phase(
    policy: trainers.MultiHeadPolicy, rows: trainers.Demonstrations, phase: np.ndarray
) -> tuple[trainers.MultiHeadPolicy, trainers.Demonstrations]:
    """An untrained policy with two more outputs, and rows whose last two actions are what these should be.

    Args:
        policy: an untrained policy.
        rows: that it learns from.
        phase: sine and cosine of their clock, shape (n, 2).
    """
    old = rows.contract
    contract = dataclasses.replace(
        old,
        joints=(*old.joints, "sine of phase", "cosine of phase"),
        default_q=(*old.default_q, 0.0, 0.0),
        action_scale=(*old.action_scale, PHASE_RAD, PHASE_RAD),
    )
    asked = dataclasses.replace(rows, acts=np.hstack([rows.acts, phase]), contract=contract)
    low, high = np.append(policy.action_space.low, [-1, -1]), np.append(policy.action_space.high, [1, 1])
    return _like(policy, spaces.Box(low, high, dtype=np.float32), contract), asked


def without_asked(policy: trainers.MultiHeadPolicy) -> trainers.MultiHeadPolicy:
    """The trained policy with its two outputs of the phase cut off; the actions stay what they were."""
    n = policy.action_space.shape[0] - 2
    space = spaces.Box(policy.action_space.low[:n], policy.action_space.high[:n], dtype=np.float32)
    old = policy.contract
    joints, default_q, scale = (getattr(old, name)[:n] for name in ("joints", "default_q", "action_scale"))
    small = _like(policy, space, dataclasses.replace(old, joints=joints, default_q=default_q, action_scale=scale))
    weights = policy.state_dict()
    small.load_state_dict({name: weights[name][: len(rows)] for name, rows in small.state_dict().items()})
    small.set_training_mode(False)
    return small


def _like(policy: trainers.MultiHeadPolicy, space: spaces.Box, contract: PolicyContract) -> trainers.MultiHeadPolicy:
    seed = 0 if policy.seed is None else policy.seed
    network = policy.network_kwargs() | {"contract": contract}
    return trainers.MultiHeadPolicy(policy.observation_space, space, seed=seed, **network)


# -- Estimates ---------------------------------------------------------------------------------------------------------


def asked_phase(policy: trainers.MultiHeadPolicy) -> Estimate:
    """The estimate of a policy that was asked for the phase, before its outputs are cut."""

    def estimate(rows: trainers.Demonstrations) -> np.ndarray:
        return unit(policy.predict(_seen(rows, policy).obs, deterministic=True)[0][:, -2:])

    return estimate


def running_phase(policy: trainers.PhaseFreePolicy) -> Estimate:
    """The clock that a policy keeps while it follows the rows of each episode."""

    def estimate(rows: trainers.Demonstrations) -> np.ndarray:
        seen, clocks = _seen(rows, policy), []
        for episode in seen.episodes():
            state = policy.initial_state()
            for obs in seen.obs[episode]:
                _, state = policy.predict(obs[None], state, deterministic=True)
                clocks.append(state[0][0])
        return np.array(clocks)

    return estimate


def _seen(rows: trainers.Demonstrations, policy: Any) -> trainers.Demonstrations:
    """The rows as a policy sees them."""
    return rows.select(policy.contract.channels, policy.contract.history).with_tasks(policy.tasks)


def phase_of(rows: trainers.Demonstrations) -> np.ndarray:
    """Sine and cosine of the clock at every row, shape (n, 2)."""
    contract = rows.contract
    return rows.obs[:, contract.slices["phase"]]


def phase_error(estimate: Estimate, rows: trainers.Demonstrations) -> dict[str, float]:
    """Median and 99th percentile ("p99") of the absolute error of the phase over all rows [cycles], at most 0.5.

    Args:
        estimate: of a policy.
        rows: with the phase.
    """
    error = phase_distance(estimate(rows), phase_of(rows))
    return {"median": float(np.median(error)), "p99": float(np.quantile(error, 0.99))}
