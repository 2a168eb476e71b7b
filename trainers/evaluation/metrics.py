"""Figures of merit as pure functions of arrays: one-step errors, velocity tracking, touchdowns, success intervals."""

import math
from typing import TYPE_CHECKING

import numpy as np

from go1_mtl_gym.errors import InvalidInputError
from trainers.data.demonstrations import Demonstrations
from trainers.data.stateful import act_on_rows

if TYPE_CHECKING:
    from stable_baselines3.common.policies import BasePolicy

BATCH = 8192


def offline_metrics(
    policy: "BasePolicy", demonstrations: Demonstrations, half_range: np.ndarray | None = None
) -> dict[str, dict[str, float]]:
    """One-step errors of the joint targets on demonstrations, per task; see `regression_metrics` for the definitions.

    Args:
        policy: anything with ``predict(obs, deterministic=True) -> (acts, state)`` on batches; where it has a
            `contract`, the rows are brought into its order of tasks. Each row is asked for by itself: a
            `trainers.PhaseFreePolicy` goes by its estimate of the phase alone.
        demonstrations: held-out rows.
        half_range: radians per unit of action, shape (12,); None takes the demonstrations' own.

    Returns:
        task -> {"mse" [rad^2], "mae" [rad], "r2", "r2_joint_mean"}, for the tasks that have rows.

    Raises:
        InvalidInputError: if the rows do not belong to the policy's contract.
    """
    demonstrations = demonstrations.fitted_to(getattr(policy, "contract", None))
    scale = demonstrations.half_range if half_range is None else np.asarray(half_range, dtype=np.float64)
    scores = {}
    for name, rows in demonstrations.per_task().items():
        chunks = range(0, len(rows), BATCH)
        predicted = np.concatenate([act_on_rows(policy, rows.obs[i : i + BATCH]) for i in chunks])
        scores[name] = regression_metrics(scale * predicted, scale * rows.acts)
    return scores


def regression_metrics(predicted: np.ndarray, target: np.ndarray) -> dict[str, float]:
    """Errors of predicted joint targets.

    mse and mae are means over rows and joints. "r2" flattens the joints: 1 - sum_nj (p - t)^2 / sum_nj (t - mean_j)^2,
    with each joint's own mean; one mean for all joints would count the constant offsets between hip, thigh and knee as
    explained variance (the paper's MSE and R2 of trot, .000528 and .9195, imply a variance of .0066 rad^2: that of
    joints about their own means). "r2_joint_mean" is the mean of the joints' own R2, over joints that move.

    Args:
        predicted: shape (n, joints) [rad].
        target: shape (n, joints) [rad].

    Raises:
        InvalidInputError: if the shapes differ or there are no rows.
    """
    if predicted.shape != target.shape or target.ndim != 2 or not len(target):
        shapes = f"{predicted.shape} and {target.shape}"
        raise InvalidInputError(f"expected two arrays of one shape (n > 0, joints), got {shapes}")
    residual = predicted.astype(np.float64) - target
    unexplained = (residual**2).sum(0)
    total = ((target - target.mean(0, dtype=np.float64)) ** 2).sum(0)
    moving = total > 1e-12 * len(target)
    flat = 1 - unexplained.sum() / total.sum() if moving.any() else math.nan
    joints = 1 - unexplained[moving] / total[moving]
    return {
        "mse": float((residual**2).mean()),
        "mae": float(np.abs(residual).mean()),
        "r2": float(flat),
        "r2_joint_mean": float(joints.mean()) if moving.any() else math.nan,
    }


def tracking_error(measured: np.ndarray, wanted: np.ndarray, window: int, skip: int) -> tuple[float, float]:
    """How far the velocity is from the command, within-stride oscillation averaged out.

    Both series are averaged over every window of `window` successive samples that starts at or after sample `skip`. The
    velocity error is the mean over windows of the Euclidean norm of the difference in (vx, vy); the yaw rate error the
    mean of its absolute difference.

    Args:
        measured: (vx [m/s], vy [m/s], yaw rate [rad/s]), shape (n, 3).
        wanted: the filtered command, shape (n, 3).
        window: samples per gait period.
        skip: samples at the start that do not count.

    Returns:
        velocity error [m/s] and yaw rate error [rad/s]; NaN if no window fits.
    """
    difference = (np.asarray(measured, dtype=np.float64) - wanted)[skip:]
    if len(difference) < window:
        return math.nan, math.nan
    sums = np.cumsum(np.vstack([np.zeros(3), difference]), axis=0)
    mean = (sums[window:] - sums[:-window]) / window
    return float(np.linalg.norm(mean[:, :2], axis=1).mean()), float(np.abs(mean[:, 2]).mean())


def touchdowns(contacts: np.ndarray, min_air: int | np.ndarray, skip: int) -> np.ndarray:
    """Touchdowns of each leg: contact after at least `min_air` samples without.

    Args:
        contacts: shape (n, 4), true on the ground.
        min_air: samples in the air that make a flight, one number or one per sample; shorter gaps are bounces.
        skip: touchdowns before this sample do not count (the flight before one may begin earlier).

    Returns:
        counts, int, shape (4,).
    """
    air = np.zeros(4, dtype=int)
    count = np.zeros(4, dtype=int)
    flights = np.broadcast_to(min_air, len(contacts))
    for i, on_ground in enumerate(np.asarray(contacts, dtype=bool)):
        count += on_ground & (air >= flights[i]) & (i >= skip)
        air = np.where(on_ground, 0, air + 1)
    return count


def wilson_interval(successes: int, trials: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson's score interval of a success rate (z = 1.96: 95 %), which stays sensible at 0 and 1 (Wilson, 1927).

    centre = (p + z^2/2n) / (1 + z^2/n), half width = z sqrt(p(1-p)/n + z^2/4n^2) / (1 + z^2/n).
    """
    if not 0 <= successes <= trials or trials < 1:
        raise InvalidInputError(f"expected 0 <= successes <= trials >= 1, got {successes} of {trials}")
    p = successes / trials
    shrink = 1 + z * z / trials
    centre = (p + z * z / (2 * trials)) / shrink
    half = z * math.sqrt(p * (1 - p) / trials + z * z / (4 * trials * trials)) / shrink
    return max(0.0, centre - half), min(1.0, centre + half)
