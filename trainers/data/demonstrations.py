"""Demonstrations: what was seen, what the expert would have done, and what is needed to read both."""

import dataclasses
import io
import json
from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import FRAME_SIZE, ObservationLayout
from trainers.utils.files import write_atomically

if TYPE_CHECKING:
    from imitation.data.types import Trajectory


@dataclasses.dataclass(frozen=True, eq=False)
class Demonstrations:
    """Rows of (observation, expert action) in the order they were visited, episode after episode.

    Attributes:
        obs: observations *before* the step, the task id last, float32, shape (n, D).
        acts: the expert's actions at the same states, in [-1, 1], float32, shape (n, 12).
        starts: True where an episode begins, bool, shape (n,).
        tasks: names in one-hot order.
        center: joint target of action 0 [rad], shape (12,).
        half_range: radians per unit of action [rad], shape (12,): target = center + half_range * act.
        control_hz: rows per second.
        meta: JSON-ready description of where the rows come from.

    Raises:
        InvalidInputError: if shapes disagree or a value is not finite (one NaN row would make all weights NaN).
    """

    obs: np.ndarray
    acts: np.ndarray
    starts: np.ndarray
    tasks: tuple[str, ...]
    center: np.ndarray
    half_range: np.ndarray
    control_hz: float
    meta: dict[str, Any] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, dtype in (("obs", np.float32), ("acts", np.float32), ("starts", bool)):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=dtype))
        for name in ("center", "half_range"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        object.__setattr__(self, "tasks", tuple(self.tasks))
        n, k = len(self.obs), len(self.tasks)
        if self.obs.ndim != 2 or self.acts.ndim != 2 or self.obs.shape[1] <= k:
            raise InvalidInputError(
                f"obs must be (n, more than {k}) and acts (n, joints), got {self.obs.shape} and {self.acts.shape}"
            )
        joints = (self.acts.shape[1],)
        if len(self.acts) != n or self.starts.shape != (n,) or not self.center.shape == self.half_range.shape == joints:
            names = ("obs", "acts", "starts", "center", "half_range")
            raise InvalidInputError(
                f"obs, acts, starts must have equal length and center, half_range shape {joints}; got shapes "
                f"{ {name: getattr(self, name).shape for name in names} }"
            )
        for name in ("obs", "acts", "center", "half_range"):
            if not np.isfinite(getattr(self, name)).all():
                raise InvalidInputError(f"{name} must be finite, got NaN or infinity")
        if n and not self.starts[0]:
            raise InvalidInputError("the first row must start an episode: starts[0] is False")

    # -- Reading -------------------------------------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self.obs)

    @property
    def seconds(self) -> float:
        """Duration of all rows [s]."""
        return len(self) / self.control_hz

    @property
    def task(self) -> np.ndarray:
        """Index into `tasks` of every row, read from the one-hot task id, shape (n,)."""
        return self.obs[:, -len(self.tasks) :].argmax(axis=1)

    def episodes(self) -> Iterator[slice]:
        """The rows of each episode."""
        first = np.flatnonzero(self.starts)
        for begin, end in zip(first, np.append(first[1:], len(self))):
            yield slice(int(begin), int(end))

    def take(self, rows: np.ndarray) -> "Demonstrations":
        """A selection of rows, by increasing index or bool mask; an episode with rows cut out falls into several."""
        rows = np.asarray(rows)
        rows = np.flatnonzero(rows) if rows.dtype == bool else rows
        starts = self.starts[rows] | (np.diff(rows, prepend=-2) != 1)
        return dataclasses.replace(self, obs=self.obs[rows], acts=self.acts[rows], starts=starts)

    def per_task(self) -> dict[str, "Demonstrations"]:
        """The rows of each task that has any, in head order."""
        task = self.task
        return {name: self.take(task == k) for k, name in enumerate(self.tasks) if (task == k).any()}

    def proprioceptive(self) -> "Demonstrations":
        """The same rows as seen without channels and history: the first 34 numbers and the task id."""
        size = self.obs.shape[1]
        return self.take_columns(np.r_[:FRAME_SIZE, size - len(self.tasks) : size])

    def select(self, have: ObservationLayout, want: ObservationLayout) -> "Demonstrations":
        """The same rows as seen with fewer channels or a shorter history.

        Args:
            have: the layout of these rows.
            want: the layout to see them in; it holds nothing that `have` does not.

        Raises:
            InvalidInputError: if `have` is not the layout of these rows, or `want` has something that `have` has not.
        """
        if (have.size, have.tasks) != (self.obs.shape[1], self.tasks):
            raise InvalidInputError(
                f"the layout of these rows must have {self.obs.shape[1]} entries and the tasks {self.tasks}, "
                f"got {have.size} and {have.tasks}"
            )
        return self.take_columns(have.columns(want))

    def take_columns(self, columns: np.ndarray) -> "Demonstrations":
        """The same rows with a selection of the observation's entries.

        Args:
            columns: their indices, the task id last and whole, int, shape (size of the new observation,).

        Raises:
            InvalidInputError: if an index is outside [0, D), or the last ones are not the task id's.
        """
        columns, size, k = np.asarray(columns), self.obs.shape[1], len(self.tasks)
        if columns.ndim != 1 or columns.dtype.kind not in "iu" or (columns < 0).any() or (columns >= size).any():
            raise InvalidInputError(f"columns must be a vector of indices from 0 to {size - 1}, got {columns.tolist()}")
        if columns[-k:].tolist() != list(range(size - k, size)):
            raise InvalidInputError(f"columns must end in the task id's, {size - k} ... {size - 1}, got {columns[-k:]}")
        return dataclasses.replace(self, obs=self.obs[:, columns])

    def with_tasks(self, tasks: Sequence[str]) -> "Demonstrations":
        """The same rows with the one-hot task id of other tasks.

        Args:
            tasks: different names in one-hot order, those of all rows among them.

        Raises:
            InvalidInputError: if a name comes twice, or that of a row is missing.
        """
        tasks, own = tuple(tasks), self.task
        present = [name for k, name in enumerate(self.tasks) if (own == k).any()]
        if len(set(tasks)) != len(tasks) or not set(present) <= set(tasks):
            raise InvalidInputError(f"tasks must differ from each other and hold {present}, got {tasks}")
        place = np.array([tasks.index(name) if name in tasks else 0 for name in self.tasks])
        task_id = np.eye(len(tasks), dtype=np.float32)[place[own]]
        return dataclasses.replace(self, obs=np.hstack([self.obs[:, : -len(self.tasks)], task_id]), tasks=tasks)

    def split(self, fraction: float, seed: int) -> tuple["Demonstrations", "Demonstrations"]:
        """Training and held-out rows; whole episodes are held out, at least one per task.

        Args:
            fraction: share of each task's episodes to hold out, in (0, 1).
            seed: decides which.

        Raises:
            InvalidInputError: if a task has fewer than two episodes, or the fraction is outside (0, 1).
        """
        if not 0 < fraction < 1:
            raise InvalidInputError(f"fraction must lie in (0, 1), got {fraction}")
        rng = np.random.default_rng(seed)
        held_out = np.zeros(len(self), dtype=bool)
        episodes, task = list(self.episodes()), self.task
        for k, name in enumerate(self.tasks):
            own = [rows for rows in episodes if task[rows.start] == k]
            if len(own) == 1:
                raise InvalidInputError(f"task {name!r} has one episode; two are needed to hold one out")
            count = min(max(1, round(fraction * len(own))), len(own) - 1) if own else 0
            for i in rng.permutation(len(own))[:count]:
                held_out[own[i]] = True
        return self.take(~held_out), self.take(held_out)

    @staticmethod
    def concatenate(parts: Sequence["Demonstrations"]) -> "Demonstrations":
        """All rows of several sets; `meta` keeps what they agree on.

        Raises:
            InvalidInputError: if there are none, or they differ in layout, tasks, action map or rate.
        """
        if not parts:
            raise InvalidInputError("nothing to concatenate: the list of demonstrations is empty")
        first = parts[0]
        for part in parts[1:]:
            if part._format() != first._format():
                raise InvalidInputError(f"demonstrations differ: {part._format()} against {first._format()}")
        agreed = {key: value for key, value in first.meta.items() if all(p.meta.get(key) == value for p in parts)}
        arrays = {name: np.concatenate([getattr(p, name) for p in parts]) for name in ("obs", "acts", "starts")}
        return dataclasses.replace(first, **arrays, meta=agreed)

    def _format(self) -> tuple[Any, ...]:
        maps = tuple(np.round(np.concatenate([self.center, self.half_range]), 9).tolist())
        return (self.obs.shape[1], self.tasks, float(self.control_hz), maps)

    def to_trajectories(self) -> "list[Trajectory]":
        """Episodes as `imitation` trajectories.

        These want one observation more than actions; the last action of each episode is dropped to serve as that, and
        episodes of a single row are left out.
        """
        from imitation.data.types import Trajectory

        return [
            Trajectory(obs=self.obs[rows], acts=self.acts[rows][:-1], infos=None, terminal=False)
            for rows in self.episodes()
            if rows.stop - rows.start > 1
        ]

    # -- Files ---------------------------------------------------------------------------------------------------------

    def save(self, path: str | PathLike[str]) -> None:
        """Write one ``.npz`` shard that describes itself; a crash leaves no half-written file."""
        manifest = {"tasks": list(self.tasks), "control_hz": self.control_hz, "rows": len(self), "meta": self.meta}
        text = np.frombuffer(json.dumps(manifest).encode(), dtype=np.uint8)
        buffer = io.BytesIO()
        arrays = {name: getattr(self, name) for name in ("obs", "acts", "starts", "center", "half_range")}
        np.savez(buffer, manifest=text, **arrays)
        write_atomically(path, lambda file: file.write(buffer.getbuffer()))

    @staticmethod
    def load(path: str | PathLike[str]) -> "Demonstrations":
        """Read a shard.

        Raises:
            InvalidInputError: if the file is missing, damaged or something else.
        """
        if not Path(path).is_file():
            raise InvalidInputError(f"no demonstrations at {path}: there is no such file")
        try:
            with np.load(path, allow_pickle=False) as archive:
                manifest = json.loads(archive["manifest"].tobytes())
                arrays = {name: archive[name] for name in ("obs", "acts", "starts", "center", "half_range")}
            shard = Demonstrations(
                **arrays,
                tasks=tuple(manifest["tasks"]),
                control_hz=manifest["control_hz"],
                meta=manifest["meta"],
            )
        except Exception as error:  # numpy, zip and JSON each raise their own on damage
            raise InvalidInputError(f"{path} is damaged or holds no demonstrations: {error}") from error
        if len(shard) != manifest["rows"]:
            raise InvalidInputError(f"{path} is damaged: {len(shard)} rows, its manifest says {manifest['rows']}")
        return shard
