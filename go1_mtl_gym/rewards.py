"""Reward terms: pure functions of one control step, itemised in ``info["reward_terms"]``."""

from dataclasses import dataclass, fields

import numpy as np

from go1_mtl_gym import robot


@dataclass(frozen=True)
class RewardWeights:
    """Weights per control step of the terms in `reward_terms`; a term's name is its weight's name."""

    velocity: float = 1.0
    yaw_rate: float = 0.5
    posture: float = 0.5
    effort: float = 0.1
    alive: float = 0.5


def reward_terms(
    weights: RewardWeights,
    command: np.ndarray,
    base_velocity: np.ndarray,
    gravity_b: np.ndarray,
    height: float,
    torque: np.ndarray,
) -> dict[str, float]:
    """The weighted reward terms of one step.

    Args:
        weights: the task's weights.
        command: filtered (vx, vy [m/s], yaw rate [rad/s]), shape (3,).
        base_velocity: measured (vx, vy, yaw rate) in the heading frame, shape (3,).
        gravity_b: unit vector of gravity in the base frame, shape (3,); (0, 0, -1) when level.
        height: of the trunk's origin above the ground [m].
        torque: joint torques [N m], shape (12,).

    Returns:
        velocity: exp(-|v_xy - command_xy|^2 / 0.25); yaw_rate: exp(-(w - command_w)^2 / 0.25);
        posture: minus (squared tilt + squared height error in units of 0.1 m, at most 4); effort: minus the mean
        squared share of the torque limits; alive: 1. Each times its weight.
    """
    error = base_velocity - command
    tilt = gravity_b[0] ** 2 + gravity_b[1] ** 2
    sag = ((height - robot.STANDING_HEIGHT) / 0.1) ** 2
    return {
        "velocity": weights.velocity * float(np.exp(-(error[0] ** 2 + error[1] ** 2) / 0.25)),
        "yaw_rate": weights.yaw_rate * float(np.exp(-(error[2] ** 2) / 0.25)),
        "posture": -weights.posture * float(tilt + min(sag, 4.0)),
        "effort": -weights.effort * float(np.mean((torque / robot.TORQUE_LIMIT) ** 2)),
        "alive": weights.alive,
    }


def no_reward() -> dict[str, float]:
    """The terms where nothing was earned: at a reset, and when the physics has diverged."""
    return dict.fromkeys((weight.name for weight in fields(RewardWeights)), 0.0)
