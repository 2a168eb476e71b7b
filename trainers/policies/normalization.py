"""Affine normalisation of a network's inputs and outputs, kept as buffers so that it travels with the weights."""

import numpy as np
import torch
from torch import nn

from go1_mtl_gym.errors import InvalidInputError
from trainers.policies.modes import MODES

SMALLEST_SCALE = 1e-3
"""A column that varies less than this is a constant: it is centred but not magnified."""


class Normalizer(nn.Module):
    """x -> (x - shift) / scale per column, the identity until `set` is called.

    Args:
        size: number of columns.
    """

    shift: torch.Tensor
    scale: torch.Tensor

    def __init__(self, size: int) -> None:
        super().__init__()
        self.register_buffer("shift", torch.zeros(size))
        self.register_buffer("scale", torch.ones(size))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Normalise, shape (..., size)."""
        return (x - self.shift) / self.scale

    def inverse(self, y: torch.Tensor) -> torch.Tensor:
        """Undo `forward`, shape (..., size)."""
        return self.shift + self.scale * y

    def set(self, shift: np.ndarray, scale: np.ndarray) -> None:
        """Take over shift and scale, each of shape (size,)."""
        for buffer, value in ((self.shift, shift), (self.scale, scale)):
            buffer.copy_(torch.as_tensor(value, dtype=buffer.dtype, device=buffer.device))


def fit(data: np.ndarray, mode: str, binary: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Shift and scale of each column.

    "mean_std" gives zero mean and unit standard deviation, "min_max" the range [-1, 1] (arXiv 2505.08574), "none" the
    identity. Columns that hold only 0 and 1 (contacts) stay as they are; nearly constant ones keep scale 1.

    Args:
        data: shape (n, columns).
        mode: one of `MODES`.
        binary: bool mask of the columns to leave alone, shape (columns,); None finds them in the data.

    Returns:
        shift and scale, each of shape (columns,), float64.

    Raises:
        InvalidInputError: if the mode is unknown, or the data are empty or not finite.
    """
    if mode not in MODES:
        raise InvalidInputError(f"normalization must be one of {', '.join(MODES)}; got {mode!r}")
    data = np.asarray(data, dtype=np.float64)
    if data.ndim != 2 or not len(data):
        raise InvalidInputError(f"data to normalise must have shape (n > 0, columns), got {data.shape}")
    if not np.isfinite(data).all():
        raise InvalidInputError(f"data to normalise must be finite; column(s) {_bad_columns(data)} are not")
    if mode == "mean_std":
        shift, scale = data.mean(0), data.std(0)
    elif mode == "min_max":
        low, high = data.min(0), data.max(0)
        shift, scale = (low + high) / 2, (high - low) / 2
    else:
        return np.zeros(data.shape[1]), np.ones(data.shape[1])
    if binary is None:
        binary = np.asarray(np.isin(data, (0.0, 1.0)).all(0))
    return np.where(binary, 0.0, shift), np.where(binary | (scale < SMALLEST_SCALE), 1.0, scale)


def _bad_columns(data: np.ndarray) -> list[int]:
    return np.flatnonzero(~np.isfinite(data).all(0)).tolist()
