"""Telling where in its gait cycle a robot is, from what it feels and was told, without its clock."""

import dataclasses
from collections.abc import Mapping

import numpy as np
import torch
from torch import nn
from tqdm.auto import tqdm

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout
from trainers.algorithms.optimizer import adamw_one_cycle
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


@dataclasses.dataclass(frozen=True)
class PhaseConfig:
    """How to train a `PhaseEstimator`.

    Attributes:
        steps: gradient steps.
        batch_size: rows per step.
        learning_rate: peak of the one-cycle schedule.
        weight_decay: of AdamW.
        seed: of the order of the rows.

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    steps: int = 4000
    batch_size: int = 1024
    learning_rate: float = 2e-3
    weight_decay: float = 1e-4
    seed: int = 0

    def __post_init__(self) -> None:
        if not (self.steps > 0 and self.batch_size > 0 and self.learning_rate > 0 and self.weight_decay >= 0):
            raise InvalidInputError(f"steps, batch_size and learning_rate must be > 0, weight_decay >= 0; got {self}")


def train_phase(
    estimator: PhaseEstimator,
    rows: Demonstrations,
    layout: ObservationLayout,
    config: PhaseConfig | None = None,
    progress: bool = False,
) -> None:
    """Fit normalisation and network to rows that hold the phase; the loss is the squared distance of (sine, cosine).

    Args:
        estimator: trained in place.
        rows: of any driver; whoever drove, the clock that drove it is what is learned.
        layout: of the rows; with the channel "phase" and all that the estimator's layout has.
        config: how to train.
        progress: show a bar.

    Raises:
        InvalidInputError: if the layouts do not fit, or there are no rows.
    """
    config = config or PhaseConfig()
    seen, target = _inputs_and_phase(estimator, rows, layout)
    device = estimator.normalizer.shift.device
    estimator.normalizer.set(*norm.fit(seen, "mean_std"))
    inputs, target = torch.as_tensor(seen, device=device), torch.as_tensor(target, device=device)
    weights = list(estimator.network.parameters())
    optimizer, schedule = adamw_one_cycle(weights, config.learning_rate, config.weight_decay, config.steps)
    rng = np.random.default_rng(config.seed)
    for _ in tqdm(range(config.steps), "phase", unit="step", disable=not progress):
        batch = torch.from_numpy(rng.integers(len(seen), size=min(config.batch_size, len(seen)))).to(device)
        loss = (estimator(inputs[batch]) - target[batch]).square().sum(dim=1).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()


def phase_errors(
    estimator: PhaseEstimator, rows: Demonstrations, layout: ObservationLayout
) -> Mapping[str, dict[str, float]]:
    """{task: {"median", "p99"}} of the absolute error of the phase [cycles], at most 0.5.

    Args:
        estimator: a trained one.
        rows, layout: as in `train_phase`.

    Raises:
        InvalidInputError: if the layouts do not fit, or there are no rows.
    """
    seen, target = _inputs_and_phase(estimator, rows, layout)
    error = phase_distance(estimator.estimate(seen), target)
    task = rows.task
    return {
        name: {"median": float(np.median(error[task == k])), "p99": float(np.quantile(error[task == k], 0.99))}
        for k, name in enumerate(rows.tasks)
        if (task == k).any()
    }


def _inputs_and_phase(
    estimator: PhaseEstimator, rows: Demonstrations, layout: ObservationLayout
) -> tuple[np.ndarray, np.ndarray]:
    if "phase" not in layout.channels or not len(rows):
        raise InvalidInputError(f"expected rows with the phase, got {len(rows)} with the channels {layout.channels}")
    return rows.select(layout, estimator.layout).obs, rows.obs[:, layout.slices["phase"]]


def phase_distance(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Absolute difference of phases [cycles], at most 0.5, shape (n,).

    Args:
        first, second: (sine, cosine) of each, shape (n, 2).
    """
    (sin, cos), (other_sin, other_cos) = first.T, second.T
    turn = np.arctan2(sin * other_cos - cos * other_sin, cos * other_cos + sin * other_sin)
    return np.abs(turn) / (2 * np.pi)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors of unit length in the same directions, shape (n, 2); (0, 1), phase 0, for a zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1.0), np.array([0.0, 1.0])).astype(np.float32)
