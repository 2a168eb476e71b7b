"""Telling where in its gait cycle a robot is, from what it feels and was told, without its clock."""

from collections.abc import Mapping

import numpy as np
import torch
from torch import nn

from go1_mtl_gym.contract import PolicyContract
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout
from trainers.data.demonstrations import Demonstrations
from trainers.policies import normalization as norm
from trainers.policies.networks import plain, seeded

CLIP_SD = 6.0
"""Normalised inputs are clipped to +- this."""


class PhaseEstimator(nn.Module):
    """A network of two hidden layers from an observation without a clock to the gait's phase.

    It sees the whole observation, task id included: a few frames of proprioception tell the phase, one alone does not.

    Args:
        layout: of its observations; without the channel "phase".
        width: units of each hidden layer.
        seed: of the initial weights, without touching torch's global generator.

    Attributes:
        contract: of what it sees, once it was trained or given to a policy: it knows the rate and the gaits.

    Raises:
        InvalidInputError: if the layout holds the phase, or the width is no positive integer.
    """

    def __init__(self, layout: ObservationLayout, width: int = 256, seed: int = 0) -> None:
        super().__init__()
        if "phase" in layout.channels:
            raise InvalidInputError(f"a layout without the phase was expected, got the channels {layout.channels}")
        if not isinstance(width, (int, np.integer)) or width < 1:
            raise InvalidInputError(f"width must be a positive integer, got {width!r}")
        self.layout = layout
        self.contract: PolicyContract | None = None
        self.width = int(width)
        self.normalizer = norm.Normalizer(layout.size)
        with seeded(seed):
            self.network = plain(layout.size, 2, width)

    def forward(self, obs: torch.Tensor) -> torch.Tensor:
        """(sine, cosine) of the phase, about of unit length, shape (n, 2), for observations of shape (n, D)."""
        return self.network(self.normalizer(obs.float()).clamp(-CLIP_SD, CLIP_SD))

    @torch.no_grad()
    def estimate(self, obs: np.ndarray) -> np.ndarray:
        """(sine, cosine) of the phase, of unit length, float32, shape (n, 2), for observations of shape (n, D)."""
        device = self.normalizer.shift.device
        return unit(self(torch.as_tensor(obs, device=device)).cpu().numpy())


def phase_errors(estimator: PhaseEstimator, rows: Demonstrations) -> Mapping[str, dict[str, float]]:
    """{task: {"median", "p99"}} of the absolute error of the phase [cycles], at most 0.5.

    Args:
        estimator: a trained one.
        rows: that hold the phase and all that the estimator sees.

    Raises:
        InvalidInputError: if the rows do not, or there are none.
    """
    seen, target = inputs_and_phase(estimator, rows)
    error = phase_distance(estimator.estimate(seen.obs), target)
    task = rows.task
    return {
        name: {"median": float(np.median(error[task == k])), "p99": float(np.quantile(error[task == k], 0.99))}
        for k, name in enumerate(rows.tasks)
        if (task == k).any()
    }


def inputs_and_phase(estimator: PhaseEstimator, rows: Demonstrations) -> tuple[Demonstrations, np.ndarray]:
    """Rows as an estimator sees them, and (sine, cosine) of their phase, shape (n, 2).

    Raises:
        InvalidInputError: if the rows hold no phase, lack something that the estimator sees, or there are none.
    """
    contract, layout = rows.contract, estimator.layout
    if "phase" not in contract.channels or not len(rows):
        raise InvalidInputError(f"expected rows with the phase, got {len(rows)} with the channels {contract.channels}")
    if layout.tasks != contract.tasks:
        raise InvalidInputError(f"the estimator knows the tasks {layout.tasks}, the rows have {contract.tasks}")
    seen = rows.select(layout.channels, layout.history)
    if estimator.contract is not None:
        estimator.contract.check(seen.contract, "the phase estimator", "the demonstrations")
    return seen, rows.obs[:, contract.slices["phase"]]


def phase_distance(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Absolute difference of phases [cycles], at most 0.5, shape (n,).

    Args:
        first: (sine, cosine) of each, shape (n, 2).
        second: likewise.
    """
    (sin, cos), (other_sin, other_cos) = first.T, second.T
    turn = np.arctan2(sin * other_cos - cos * other_sin, cos * other_cos + sin * other_sin)
    return np.abs(turn) / (2 * np.pi)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors of unit length in the same directions, shape (n, 2); (0, 1), phase 0, for a zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1.0), np.array([0.0, 1.0])).astype(np.float32)
