"""The optimiser and the schedule of everything that is trained here, and how PyTorch computes meanwhile."""

import contextlib
from collections.abc import Iterator, Sequence

import torch


@contextlib.contextmanager
def matmul_precision(precision: str) -> Iterator[None]:
    """Within this context torch multiplies float32 matrices with one of `PRECISIONS`; after it, as it did before."""
    before = torch.get_float32_matmul_precision()
    torch.set_float32_matmul_precision(precision)
    try:
        yield
    finally:
        torch.set_float32_matmul_precision(before)


@contextlib.contextmanager
def torch_threads(count: int) -> Iterator[None]:
    """With so many threads in PyTorch."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def adamw_one_cycle(
    weights: Sequence[torch.nn.Parameter], learning_rate: float, weight_decay: float, steps: int, warmup: float = 0.1
) -> tuple[torch.optim.Optimizer, torch.optim.lr_scheduler.LRScheduler]:
    """AdamW, and a one-cycle schedule to be stepped after each of its steps.

    Args:
        weights: what is trained.
        learning_rate: peak of the schedule.
        weight_decay: of AdamW.
        steps: gradient steps.
        warmup: fraction of the steps before the peak.
    """
    optimizer = torch.optim.AdamW(weights, lr=learning_rate, weight_decay=weight_decay, fused=True)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, learning_rate, total_steps=steps + 1, pct_start=warmup, cycle_momentum=False
    )
    return optimizer, schedule


class WeightAverage:
    """Exponential moving average of a network's weights, with a shorter memory in the first steps."""

    def __init__(self, network: torch.nn.Module, decay: float) -> None:
        self._weights = list(network.parameters())
        self._average = [weight.detach().clone() for weight in self._weights]
        self._decay = decay
        self._updates = 0

    @torch.no_grad()
    def update(self) -> None:
        """Take in the present weights."""
        self._updates += 1
        decay = min(self._decay, (1 + self._updates) / (10 + self._updates))
        for average, weight in zip(self._average, self._weights):
            average.lerp_(weight, 1 - decay)

    @torch.no_grad()
    def copy_to_network(self) -> None:
        """Replace the network's weights by their average."""
        for average, weight in zip(self._average, self._weights):
            weight.copy_(average)
