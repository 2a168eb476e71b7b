"""The cloning loss: the sum over tasks of the mean squared error of the joint targets."""

import contextlib
from collections.abc import Sequence

import numpy as np
import torch

from go1_mtl_gym.errors import InvalidInputError
from trainers.algorithms.config import SPACES
from trainers.policies.multi_head import MultiHeadPolicy


class MultiTaskMetrics:
    """What imitation's BC reads: the attribute `loss`, and every attribute a scalar to log.

    Attributes:
        loss: 0-d tensor to differentiate.
        mse_<task>: mean squared error of that task [rad^2], 0-d tensor without gradient; absent if there are no rows.
    """

    loss: torch.Tensor

    def __init__(self, loss: torch.Tensor, mse: dict[str, torch.Tensor]) -> None:
        self.loss = loss
        for task, value in mse.items():
            setattr(self, f"mse_{task}", value)


class MultiTaskLoss:
    """L = sum_k mean_{n in D_k} mean_j (pi_j(o_n, k) - a_nj)^2, to be set as imitation's ``bc.BC.loss_calculator``.

    D_k are the batch's rows of task k, j counts joints (arXiv 2505.08574 sums over samples; a mean per task makes tasks
    of unequal size count alike). The value network and the exploration noise are not evaluated.

    Args:
        tasks: names in one-hot order, for the log.
        half_range: radians per unit of action, shape (12,) [rad].
        space: "radians" takes the error in joint targets [rad^2]; "normalized" divides each joint's error by the
            policy's action scale, so that joints that move little count as much as the others.
        rows: how many rows of each task every batch holds, sorted by task; None looks them up in each batch, for which
            the CPU waits for a GPU.
        autocast: whether the policy is evaluated in bfloat16 where torch deems that safe; weights and loss stay
            float32.

    Raises:
        InvalidInputError: for another `space`, a half range that is not positive, or one of `rows` that is negative or
            has no task.
    """

    def __init__(
        self,
        tasks: Sequence[str],
        half_range: np.ndarray,
        space: str = "radians",
        rows: Sequence[int] | None = None,
        autocast: bool = False,
    ) -> None:
        if space not in SPACES:
            raise InvalidInputError(f"space must be one of {', '.join(SPACES)}; got {space!r}")
        half_range = np.asarray(half_range, dtype=np.float32)
        if half_range.ndim != 1 or not (half_range > 0).all():
            raise InvalidInputError(f"half_range must be a vector of positive radians, got {half_range!r}")
        if rows is not None and (len(rows) != len(tasks) or min(rows) < 0):
            raise InvalidInputError(f"rows must be {len(tasks)} counts, one per task, got {rows!r}")
        self.tasks = tuple(tasks)
        self.space = space
        self.rows = None if rows is None else tuple(rows)
        self.autocast = autocast
        self._half_range = torch.from_numpy(half_range)
        self._known = None if rows is None else _groups_of(torch.tensor(self.rows))

    def __call__(self, policy: MultiHeadPolicy, obs: torch.Tensor, acts: torch.Tensor) -> MultiTaskMetrics:
        """Loss of a batch.

        Args:
            policy: the student.
            obs: shape (n, D), rows of any tasks in any order, or as `rows` says.
            acts: the expert's actions, shape (n, 12).

        Raises:
            InvalidInputError: if there are more or fewer rows than `rows` says.
        """
        if self.rows is not None and sum(self.rows) != len(obs):
            raise InvalidInputError(f"expected a batch of {sum(self.rows)} rows, {self.rows} per task; got {len(obs)}")
        self._half_range = self._half_range.to(obs.device)
        with torch.autocast(obs.device.type, torch.bfloat16) if self.autocast else contextlib.nullcontext():
            means = policy.mean_actions(obs, self.rows)
        error = means - acts
        squared_rad = (error * self._half_range).square().mean(dim=1)
        task, rows = self._groups(policy, obs)
        mse = per_task_mean(squared_rad, task, rows)
        if self.space == "radians":
            loss = mse.sum()
        else:
            loss = per_task_mean((error / policy.act_normalizer.scale).square().mean(dim=1), task, rows).sum()
        detached = mse.detach()
        counts = rows.tolist() if self.rows is None else self.rows
        return MultiTaskMetrics(loss, {name: detached[k] for k, name in enumerate(self.tasks) if counts[k]})

    def _groups(self, policy: MultiHeadPolicy, obs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """The task of each row, shape (n,), and the rows of each task, shape (K,)."""
        if self._known is None:
            task = policy.task_index(obs)
            return task, torch.bincount(task, minlength=len(self.tasks))
        task, rows = self._known
        self._known = known = task.to(obs.device), rows.to(obs.device)
        return known


def _groups_of(rows: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """The task of each row of a sorted batch, and the rows of each task."""
    return torch.arange(len(rows)).repeat_interleave(rows), rows


def per_task_mean(values: torch.Tensor, task: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
    """Mean of `values` (n,) over the rows of each task, shape (K,); 0 for a task without rows."""
    return values.new_zeros(len(rows)).index_add(0, task, values) / rows.clamp(min=1)
