"""Figures of merit as pure functions: one-step errors, velocity tracking, touchdowns, success intervals and tests."""

import math
from typing import TYPE_CHECKING

import numpy as np
import scipy  # its parts are loaded when they are used: `stats` takes half a second

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
        min_air: samples in the air that make a flight; shorter gaps are bounces. One number, or shape (n, 1) or (n, 4).
        skip: touchdowns before this sample do not count (the flight before one may begin earlier).

    Returns:
        counts, int, shape (4,).
    """
    air = np.zeros(4, dtype=int)
    count = np.zeros(4, dtype=int)
    flights = np.broadcast_to(min_air, (len(contacts), 4))
    for i, on_ground in enumerate(np.asarray(contacts, dtype=bool)):
        count += on_ground & (air >= flights[i]) & (i >= skip)
        air = np.where(on_ground, 0, air + 1)
    return count


def exact_interval(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Clopper and Pearson's (1934) exact interval of a success rate: it holds the rate at least as often as it says.

    Of x successes among n, the lower bound is the (1 - c) / 2 quantile of Beta(x, n - x + 1) and the upper one the
    (1 + c) / 2 quantile of Beta(x + 1, n - x); 0 and 1 where there are none, or no failures.

    Args:
        successes: x.
        trials: n, decided beforehand.
        confidence: c, of both sides together.

    Raises:
        InvalidInputError: if the counts do not fit together.
    """
    if not 0 <= successes <= trials or trials < 1:
        raise InvalidInputError(f"expected 0 <= successes <= trials >= 1, got {successes} of {trials}")
    interval = scipy.stats.binomtest(int(successes), int(trials)).proportion_ci(confidence, "exact")
    return float(interval.low), float(interval.high)


def lower_bound(successes: int, trials: int, confidence: float = 0.95) -> float:
    """The exact lower bound of a success rate that holds by itself: the 1 - c quantile of Beta(x, n - x + 1).

    Args:
        successes: x, of n trials.
        trials: n, decided beforehand.
        confidence: c, of this one side.
    """
    test = scipy.stats.binomtest(int(successes), int(trials), alternative="greater")
    return float(test.proportion_ci(confidence, "exact").low)


def mcnemar(only_first: int, only_second: int) -> float:
    """Exact two-sided p-value of McNemar's test (1947) that two agents succeed equally often on the same episodes.

    Only the episodes in which they differ tell them apart: each of these is a fair coin if the agents are equal.

    Args:
        only_first: episodes in which only the first agent succeeded.
        only_second: only the second.
    """
    differing = only_first + only_second
    return float(scipy.stats.binomtest(only_first, differing).pvalue) if differing else 1.0
