"""Pre-batched tensors for `imitation`'s behaviour cloning, which otherwise collates sample by sample."""

from collections.abc import Callable, Iterator

import numpy as np
import torch

from go1_mtl_gym.errors import InvalidInputError
from trainers.data.demonstrations import Demonstrations


class TensorBatches:
    """An endlessly re-iterable source of batches ``{"obs": (B, D), "acts": (B, 12)}``.

    Every batch holds equally many rows of every task (up to one), sorted by task, so that each head works on one block.
    Rows of a task are drawn without replacement until all were seen, then shuffled anew; tasks with fewer rows come
    round more often. A row of weight w is drawn w times before its task is shuffled anew. One iteration gives
    floor(n / B) batches; each goes on where the last one ended.

    Rows and their order stay on the device. On a CPU numpy shuffles, elsewhere the device itself: the order for a seed
    is then another one, and no step waits for the CPU.

    Args:
        demonstrations: the rows.
        batch_size: B.
        seed: of the order.
        device: where the rows are kept and batches made.
        weights: of the rows, positive integers, shape (n,); None gives every row the weight 1.

    Attributes:
        batch_size: B.
        rows: of each task in every batch, in the order of the tasks; 0 for a task without rows.

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
        drawn = {k: members for k in range(len(demonstrations.tasks)) if len(members := rows[task[rows] == k])}
        check_batch_size(batch_size, demonstrations)
        self.batch_size = int(batch_size)
        share, left = divmod(self.batch_size, len(drawn))
        self._shares = [share + (i < left) for i in range(len(drawn))]
        shares = dict(zip(drawn, self._shares))
        self.rows = tuple(shares.get(k, 0) for k in range(len(demonstrations.tasks)))
        device = torch.device(device)
        self._obs = torch.from_numpy(demonstrations.obs).to(device)
        self._acts = torch.from_numpy(demonstrations.acts).to(device)
        self._rows_of = [torch.from_numpy(members).to(device) for members in drawn.values()]
        self._shuffled = shuffled_by_numpy(seed) if device.type == "cpu" else shuffled_by_torch(seed, device)
        self._queues = [members[:0] for members in self._rows_of]

    def __len__(self) -> int:
        """Batches per iteration."""
        return len(self._obs) // self.batch_size

    def __iter__(self) -> Iterator[dict[str, torch.Tensor]]:
        for _ in range(len(self)):
            index = torch.cat([self._draw(i, share) for i, share in enumerate(self._shares)])
            yield {"obs": self._obs.index_select(0, index), "acts": self._acts.index_select(0, index)}

    def _draw(self, i: int, count: int) -> torch.Tensor:
        while len(self._queues[i]) < count:
            self._queues[i] = torch.cat([self._queues[i], self._shuffled(self._rows_of[i])])
        drawn, self._queues[i] = self._queues[i][:count], self._queues[i][count:]
        return drawn


def check_batch_size(batch_size: int, demonstrations: Demonstrations) -> None:
    """Refuse batches that cannot be made of some rows.

    Raises:
        InvalidInputError: if there are fewer rows than one batch, or fewer rows in a batch than tasks.
    """
    rows, tasks = len(demonstrations), len(np.unique(demonstrations.task))
    if not 0 < batch_size <= rows or batch_size < tasks:
        raise InvalidInputError(
            f"batch_size must lie between the number of tasks ({tasks}) and the number of rows ({rows}), "
            f"got {batch_size}"
        )


def shuffled_by_numpy(seed: int) -> Callable[[torch.Tensor], torch.Tensor]:
    """A function that gives a CPU's vector in an order drawn by numpy, another one at each call."""
    rng = np.random.default_rng(seed)
    return lambda rows: torch.from_numpy(rng.permutation(rows.numpy()))


def shuffled_by_torch(seed: int, device: torch.device) -> Callable[[torch.Tensor], torch.Tensor]:
    """The same for a vector on a device, drawn there."""
    generator = torch.Generator(device).manual_seed(seed)
    return lambda rows: rows[torch.randperm(len(rows), generator=generator, device=device)]


def _checked_weights(weights: np.ndarray | None, n: int) -> np.ndarray:
    weights = np.ones(n, dtype=np.int64) if weights is None else np.asarray(weights)
    if weights.shape != (n,) or weights.dtype.kind not in "iu" or (weights < 1).any():
        raise InvalidInputError(
            f"weights must be {n} positive integers, got {weights.dtype} of shape {weights.shape}: {weights}"
        )
    return weights
