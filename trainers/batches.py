"""Pre-batched tensors for `imitation`'s behaviour cloning, which otherwise collates sample by sample."""

from collections.abc import Iterator

import numpy as np
import torch

from go1_mtl_gym.errors import InvalidInputError
from trainers.dataset import Demonstrations


class TensorBatches:
    """An endlessly re-iterable source of batches ``{"obs": (B, D), "acts": (B, 12)}``.

    Every batch holds equally many rows of every task (up to one), sorted by task, so that each head works on one block.
    Rows of a task are drawn without replacement until all were seen, then shuffled anew; tasks with fewer rows come
    round more often. A row of weight w is drawn w times before its task is shuffled anew. One iteration gives
    floor(n / B) batches; each goes on where the last one ended.

    Args:
        demonstrations: the rows.
        batch_size: B.
        seed: of the order.
        device: where the rows are kept and batches made.
        weights: of the rows, positive integers, shape (n,); None gives every row the weight 1.

    Raises:
        InvalidInputError: if there are fewer rows than one batch, fewer rows in a batch than tasks, or the weights are
            not as described.
    """

    def __init__(
        self,
        demonstrations: Demonstrations,
        batch_size: int,
        seed: int,
        device: torch.device | str = "cpu",
        weights: np.ndarray | None = None,
    ) -> None:
        task = demonstrations.task
        rows = np.repeat(np.arange(len(task)), _checked_weights(weights, len(task)))
        self._rows_of = [own for k in range(len(demonstrations.tasks)) if len(own := rows[task[rows] == k])]
        if not 0 < batch_size <= len(demonstrations) or batch_size < len(self._rows_of):
            raise InvalidInputError(
                f"batch_size must lie between the number of tasks ({len(self._rows_of)}) and the number of rows "
                f"({len(demonstrations)}), got {batch_size}"
            )
        self.batch_size = int(batch_size)
        share, left = divmod(self.batch_size, len(self._rows_of))
        self._shares = [share + (k < left) for k in range(len(self._rows_of))]
        self._obs = torch.from_numpy(demonstrations.obs).to(device)
        self._acts = torch.from_numpy(demonstrations.acts).to(device)
        self._rng = np.random.default_rng(seed)
        self._queues = [np.empty(0, dtype=np.int64) for _ in self._rows_of]

    def __len__(self) -> int:
        """Batches per iteration."""
        return len(self._obs) // self.batch_size

    def __iter__(self) -> Iterator[dict[str, torch.Tensor]]:
        for _ in range(len(self)):
            rows = np.concatenate([self._draw(k, share) for k, share in enumerate(self._shares)])
            index = torch.from_numpy(rows).to(self._obs.device)
            yield {"obs": self._obs.index_select(0, index), "acts": self._acts.index_select(0, index)}

    def _draw(self, k: int, count: int) -> np.ndarray:
        while len(self._queues[k]) < count:
            self._queues[k] = np.concatenate([self._queues[k], self._rng.permutation(self._rows_of[k])])
        drawn, self._queues[k] = self._queues[k][:count], self._queues[k][count:]
        return drawn


def _checked_weights(weights: np.ndarray | None, n: int) -> np.ndarray:
    weights = np.ones(n, dtype=np.int64) if weights is None else np.asarray(weights)
    if weights.shape != (n,) or weights.dtype.kind not in "iu" or (weights < 1).any():
        raise InvalidInputError(
            f"weights must be {n} positive integers, got {weights.dtype} of shape {weights.shape}: {weights}"
        )
    return weights
