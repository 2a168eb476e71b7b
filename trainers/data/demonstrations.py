"""Demonstrations: what was seen, what the expert would have done, and what is needed to read both."""

import dataclasses
import hashlib
import io
import json
from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from go1_mtl_gym.contract import PolicyContract, terms_of
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout
from trainers.utils.files import write_atomically

if TYPE_CHECKING:
    from imitation.data.types import Trajectory

ARRAYS = ("obs", "acts", "starts")


@dataclasses.dataclass(frozen=True, eq=False)
class Demonstrations:
    """Rows of (observation, expert action) in the order they were visited, episode after episode.

    Attributes:
        obs: observations *before* the step, the task id last, float32, shape (n, D).
        acts: the expert's actions at the same states, in [-1, 1], float32, shape (n, 12).
        starts: True where an episode begins, bool, shape (n,).
        contract: what gives both their meaning, as the environment that was stepped had it.
        meta: JSON-ready description of where the rows come from.

    Raises:
        InvalidInputError: if shapes disagree, with each other or with the contract, or a value is not finite (one NaN
            row would make all weights NaN).
    """

    obs: np.ndarray
    acts: np.ndarray
    starts: np.ndarray
    contract: PolicyContract
    meta: dict[str, Any] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, dtype in (("obs", np.float32), ("acts", np.float32), ("starts", bool)):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=dtype))
        n, size, joints = len(self.obs), self.contract.observation_size, len(self.contract.joints)
        expected = {"obs": (n, size), "acts": (n, joints), "starts": (n,)}
        got = {name: getattr(self, name).shape for name in expected}
        if got != expected:
            raise InvalidInputError(
                f"by their contract {n} rows have the shapes {expected} (the observation: {self.contract.describe()}), "
                f"got {got}"
            )
        for name in ("obs", "acts"):
            if not np.isfinite(getattr(self, name)).all():
                raise InvalidInputError(f"{name} must be finite, got NaN or infinity")
        task_id = self.obs[:, -self.contract.n_tasks :]
        if not (np.isin(task_id, (0.0, 1.0)).all() and (task_id.sum(1) == 1.0).all()):
            raise InvalidInputError(f"every row must end in a one-hot id of the tasks {self.tasks}, not all do")
        if n and not self.starts[0]:
            raise InvalidInputError("the first row must start an episode: starts[0] is False")

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names in one-hot order."""
        return self.contract.tasks

    @property
    def half_range(self) -> np.ndarray:
        """Radians per unit of action, shape (12,)."""
        return np.array(self.contract.action_scale)

    @property
    def control_hz(self) -> float:
        """Rows per second."""
        return self.contract.control_hz

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
        if rows.ndim != 1 or rows.dtype.kind not in "iub" or (rows.dtype == bool and len(rows) != len(self)):
            raise InvalidInputError(
                f"rows must be indices or a mask of {len(self)} entries, got {rows.dtype} of shape {rows.shape}"
            )
        rows = np.flatnonzero(rows) if rows.dtype == bool else rows
        starts = self.starts[rows] | (np.diff(rows, prepend=-2) != 1)
        return dataclasses.replace(self, obs=self.obs[rows], acts=self.acts[rows], starts=starts)

    def per_task(self) -> dict[str, "Demonstrations"]:
        """The rows of each task that has any, in head order."""
        task = self.task
        return {name: self.take(task == k) for k, name in enumerate(self.tasks) if (task == k).any()}

    def select(self, channels: Sequence[str] = (), history: int = 1) -> "Demonstrations":
        """The same rows as seen with fewer channels or a shorter history.

        Args:
            channels: optional terms of the observation that stay.
            history: frames of proprioception that stay; with neither, the first 34 numbers and the task id are left.

        Raises:
            InvalidInputError: if these rows do not have all of that.
        """
        have, want = self.contract.layout, ObservationLayout(self.tasks, channels, history)
        contract = self.contract.with_terms(terms_of(want))
        return dataclasses.replace(self, obs=self.obs[:, have.columns(want)], contract=contract)

    def fitted_to(self, contract: PolicyContract | None, name: str = "the policy") -> "Demonstrations":
        """These rows for whoever has a contract: with its order of tasks and the gaits it names, all else being equal.

        Args:
            contract: of the other side; None where it has none, which is taken to have the rows' own.
            name: of the other side, in messages.

        Raises:
            InvalidInputError: if something else than the tasks differs, or a row's task is unknown to the other side.
        """
        if contract is None or contract == self.contract:
            return self
        contract.check(self.contract, name, "the demonstrations", ignore=("tasks",))
        fitted = self if contract.tasks == self.tasks else self.with_tasks(contract.tasks)
        return dataclasses.replace(fitted, contract=_with_gaits_of(fitted.contract, [contract]))

    def with_tasks(self, tasks: Sequence[str]) -> "Demonstrations":
        """The same rows with the one-hot task id of other tasks.

        Args:
            tasks: different names in one-hot order, those of all rows among them.

        Raises:
            InvalidInputError: if a name comes twice, or that of a row is missing.
        """
        tasks, task = tuple(tasks), self.task
        present = [name for k, name in enumerate(self.tasks) if (task == k).any()]
        if len(set(tasks)) != len(tasks) or not set(present) <= set(tasks):
            raise InvalidInputError(f"tasks must differ from each other and hold {present}, got {tasks}")
        place = np.array([tasks.index(name) if name in tasks else 0 for name in self.tasks])
        task_id = np.eye(len(tasks), dtype=np.float32)[place[task]]
        obs = np.hstack([self.obs[:, : -len(self.tasks)], task_id])
        return dataclasses.replace(self, obs=obs, contract=self.contract.with_tasks(tasks))

    def split(self, fraction: float, seed: int) -> tuple["Demonstrations", "Demonstrations"]:
        """Training and held-out rows; whole episodes are held out, at least one per task.

        Args:
            fraction: part of each task's episodes to hold out, in (0, 1).
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
            candidates = [rows for rows in episodes if task[rows.start] == k]
            if len(candidates) == 1:
                raise InvalidInputError(f"task {name!r} has one episode; two are needed to hold one out")
            count = min(max(1, round(fraction * len(candidates))), len(candidates) - 1) if candidates else 0
            for i in rng.permutation(len(candidates))[:count]:
                held_out[candidates[i]] = True
        return self.take(~held_out), self.take(held_out)

    def fingerprint(self) -> str:
        """A digest of rows and contract: equal for equal demonstrations, whatever their `meta`."""
        digest = hashlib.sha256(json.dumps(self.contract.as_dict()).encode())
        for name in ARRAYS:
            digest.update(getattr(self, name).data)
        return digest.hexdigest()

    @staticmethod
    def concatenate(parts: Sequence["Demonstrations"]) -> "Demonstrations":
        """All rows of several sets; `contract` names every gait that any of theirs does, `meta` what they agree on.

        Raises:
            InvalidInputError: if there are none, or their contracts differ.
        """
        if not parts:
            raise InvalidInputError("nothing to concatenate: the list of demonstrations is empty")
        first = parts[0]
        for i, part in enumerate(parts[1:], start=1):
            first.contract.check(part.contract, "demonstrations 0", f"demonstrations {i}")
        agreed = {key: value for key, value in first.meta.items() if all(p.meta.get(key) == value for p in parts)}
        arrays: dict[str, Any] = {
            name: np.concatenate([getattr(p, name) for p in parts]) for name in ("obs", "acts", "starts")
        }
        contract = _with_gaits_of(first.contract, [part.contract for part in parts])
        return dataclasses.replace(first, **arrays, contract=contract, meta=agreed)

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
        manifest = {"contract": self.contract.as_dict(), "rows": len(self), "meta": self.meta}
        text = np.frombuffer(json.dumps(manifest).encode(), dtype=np.uint8)
        buffer = io.BytesIO()
        arrays = {name: getattr(self, name) for name in ARRAYS}
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
                if "contract" not in manifest:
                    raise InvalidInputError("it was written by version 0.1 and does not say what its numbers mean")
                arrays = {name: archive[name] for name in ARRAYS}
            contract = PolicyContract.from_dict(manifest["contract"])
            shard = Demonstrations(**arrays, contract=contract, meta=manifest["meta"])
        except Exception as error:  # numpy, zip and JSON each raise their own on damage
            raise InvalidInputError(f"{path} is damaged or holds no demonstrations: {error}") from error
        if len(shard) != manifest["rows"]:
            raise InvalidInputError(f"{path} is damaged: {len(shard)} rows, its manifest says {manifest['rows']}")
        return shard


def _with_gaits_of(contract: PolicyContract, others: Sequence[PolicyContract]) -> PolicyContract:
    """A contract, with the gaits that others name for its tasks; they have been checked to agree."""
    named = {name: gait for other in others for name, gait in zip(other.tasks, other.gaits) if gait is not None}
    return contract.with_tasks(contract.tasks, named)
