"""The actor's network: one trunk, one head per task, and the routing of each row to its own head."""

import contextlib
from collections.abc import Sequence
from typing import Any

import torch
from torch import nn

OUTPUT_GAIN = 0.01
"""Initial output weights are this much smaller than torch's: an untrained policy stays near the mean action."""
Heads = Sequence[nn.Module] | nn.ModuleList
"""Modules by their index; torch does not call its list of them a sequence."""


class MultiHeadActor(nn.Module):
    """Shared trunk of two hidden layers; per task one hidden layer and one output layer; ELU (arXiv 2505.08574).

    With one head this is the plain network of the same depth.

    Args:
        n_inputs: columns of the input.
        n_outputs: columns of the output.
        n_heads: number of heads.
        width: units of every hidden layer.
    """

    def __init__(self, n_inputs: int, n_outputs: int, n_heads: int, width: int) -> None:
        super().__init__()
        self.trunk: nn.Module = nn.Sequential(nn.Linear(n_inputs, width), nn.ELU(), nn.Linear(width, width), nn.ELU())
        self.heads = nn.ModuleList(_head(width, n_outputs) for _ in range(n_heads))

    def forward(self, x: torch.Tensor, head: torch.Tensor) -> torch.Tensor:
        """Outputs of shape (n, n_outputs) for inputs of shape (n, n_inputs) and head indices of shape (n,)."""
        return route(self.heads, self.trunk(x), head)

    def in_blocks(self, x: torch.Tensor, rows: Sequence[int]) -> torch.Tensor:
        """The same for inputs that come sorted by head.

        Args:
            x: shape (n, n_inputs).
            rows: how many there are of each head; the CPU knows them, so it waits for no GPU.
        """
        features = self.trunk(x)
        return self.heads[0](features) if len(self.heads) == 1 else _by_group(self.heads, features, rows)


def _head(width: int, n_outputs: int) -> nn.Sequential:
    hidden, output = nn.Linear(width, width), nn.Linear(width, n_outputs)
    with torch.no_grad():
        output.weight.mul_(OUTPUT_GAIN)
        output.bias.zero_()
    return nn.Sequential(hidden, nn.ELU(), output)


def route(heads: Heads, features: torch.Tensor, head: torch.Tensor) -> torch.Tensor:
    """Apply to each row the head it names.

    Rows are grouped by head, so each head computes its own rows only and receives gradients from these alone. Rows that
    come sorted by head are not moved.

    Args:
        heads: modules with equal output size.
        features: shape (n, width).
        head: int64 indices, shape (n,).

    Returns:
        shape (n, outputs), in the order of the input rows.
    """
    if len(heads) == 1 or len(features) == 0:
        return heads[0](features)
    if len(features) == 1:
        return heads[int(head)](features)
    counts = torch.bincount(head, minlength=len(heads)).tolist()
    if max(counts) == len(features):
        return heads[counts.index(len(features))](features)
    if bool((head[1:] >= head[:-1]).all()):
        return _by_group(heads, features, counts)
    order = torch.argsort(head, stable=True)
    back = torch.empty_like(order)
    back[order] = torch.arange(len(order), device=order.device)
    return _by_group(heads, features[order], counts)[back]


def _by_group(heads: Heads, features: torch.Tensor, counts: Sequence[int]) -> torch.Tensor:
    groups = zip(heads, features.split(list(counts)))
    return torch.cat([head(rows) for head, rows in groups if len(rows)])


def plain(n_inputs: int, n_outputs: int, width: int) -> nn.Sequential:
    """A network of two hidden layers of `width` units; ELU."""
    return nn.Sequential(
        nn.Linear(n_inputs, width), nn.ELU(), nn.Linear(width, width), nn.ELU(), nn.Linear(width, n_outputs)
    )


def seeded(seed: int | None) -> contextlib.AbstractContextManager[Any]:
    """A context in which torch draws from `seed`, and after which its generator is as it was; None changes nothing."""
    if seed is None:
        return contextlib.nullcontext()
    stack = contextlib.ExitStack()
    stack.enter_context(torch.random.fork_rng(devices=[]))
    torch.manual_seed(seed)
    return stack
