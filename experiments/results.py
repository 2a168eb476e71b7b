"""What a study has measured, as flat records, and the file that holds them."""

import json
import os
import platform
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from experiments.stats import Rate
from go1_mtl_gym.errors import InvalidInputError
from trainers.utils.files import json_ready, read_object, write_atomically

Record = dict[str, Any]
"""{"study", "agent", "task", "condition", "seed", metrics ...}."""


class Group(tuple[Record, ...]):
    """Some records, taken together."""

    def where(self, **values: Any) -> "Group":
        """The records that have these values."""
        return Group(record for record in self if all(record.get(name) == value for name, value in values.items()))

    def total(self, key: str) -> int:
        """Sum over the records that have it."""
        return sum(self.values(key))

    def rate(self, key: str = "succeeded") -> Rate:
        """A count of the "trials" of those records that have both."""
        known = [record for record in self if record.get(key) is not None]
        return Rate(sum(record[key] for record in known), sum(record["trials"] for record in known))

    def values(self, key: str) -> list[float]:
        """The values that are there."""
        return [record[key] for record in self if record.get(key) is not None]

    def mean(self, key: str) -> float | None:
        """Mean of the values that are there; None if there are none."""
        known = self.values(key)
        return float(np.mean(known)) if known else None

    def largest(self, key: str) -> float | None:
        """The largest value; None if there is no record, or one without: that would have been the worst."""
        known = self.values(key)
        return max(known) if self and len(known) == len(self) else None


def group(records: Iterable[Record], by: str | Sequence[str]) -> dict[Any, Group]:
    """The records by the values of one key, or by the tuples of values of several; keys that are missing are None."""
    groups: dict[Any, list[Record]] = {}
    for record in records:
        key = record.get(by) if isinstance(by, str) else tuple(record.get(name) for name in by)
        groups.setdefault(key, []).append(record)
    return {key: Group(members) for key, members in groups.items()}


@dataclass(frozen=True)
class Results:
    """Everything in a results file.

    Attributes:
        study: name of the study.
        command: that made it, without the folders that only its machine knows.
        seed: of the command.
        options: settings of the study.
        versions: of the packages that shape a result.
        machine: "processor", "cores" and "device"; None where the run did not note it.
        seconds: that the parts of the run took on one core [s].
        records: one per agent, task, condition and seed.
        policies: name of an agent -> SHA-256 of its file.
        more: whatever else the study needs to be shown.
    """

    study: str
    command: str
    seed: int
    options: Mapping[str, Any]
    versions: Mapping[str, str]
    machine: Mapping[str, Any] | None
    seconds: Mapping[str, float]
    records: tuple[Record, ...]
    policies: Mapping[str, str] = field(default_factory=dict)
    more: Mapping[str, Any] = field(default_factory=dict)

    @property
    def minutes(self) -> float:
        """That the run took on one core [min]."""
        return sum(self.seconds.values()) / 60

    def write(self, path: Path) -> None:
        """Write the file atomically: one line per entry of the head, one per record."""
        head = {name: value for name, value in asdict(self).items() if name != "records"}
        lines = [f"{_text(name)}: {_text(value)}" for name, value in head.items()]
        records = ",\n".join(f"  {_text(record)}" for record in self.records)
        text = "{\n" + ",\n".join(f" {line}" for line in lines) + ',\n "records": [\n' + records + "\n ]\n}\n"
        write_atomically(path, lambda file: file.write(text.encode()))

    @classmethod
    def read(cls, path: Path) -> "Results":
        """Read what `write` wrote.

        Raises:
            InvalidInputError: if the file is missing, no JSON, or holds something else.
        """
        data = read_object(path, "file of results")
        try:
            return cls(**data | {"records": tuple(data["records"])})
        except (KeyError, TypeError) as error:
            raise InvalidInputError(f"{path} does not hold the results of a study: {error}") from error

    def beside(self, earlier: "Results", keys: Sequence[str]) -> "Results":
        """These results, and those records of an earlier run that they do not replace.

        Args:
            earlier: of the same study.
            keys: what tells one record from another.
        """
        names = {tuple(record.get(key) for key in keys) for record in self.records}
        kept = [record for record in earlier.records if tuple(record.get(key) for key in keys) not in names]
        command = " and ".join(dict.fromkeys([earlier.command, self.command]))
        seconds = {name: earlier.seconds.get(name, 0.0) + value for name, value in self.seconds.items()}
        return replace(self, records=(*kept, *self.records), command=command, seconds=seconds)

    def of(self, **values: Any) -> Group:
        """The records that have these values, in their order."""
        return Group(self.records).where(**values)


FOLDERS, CHECKOUTS = ("--out", "--cache"), ("--go2-convex-mpc",)
"""Options that say where files go on this machine, and whose value is a path of this machine."""


def without_folders(command: str) -> str:
    """A command without what only its machine knows."""
    words, kept = iter(shlex.split(command)), []
    for word in words:
        name, given, _ = word.partition("=")
        if name in (*FOLDERS, *CHECKOUTS):
            if not given:
                next(words, None)
            kept += [name, "PATH"] if name in CHECKOUTS else []
        else:
            kept.append(word)
    return shlex.join(kept)


def distinct(records: Iterable[Record], key: str) -> list[Any]:
    """The values that a key takes, in the order of their first records."""
    return list(dict.fromkeys(record[key] for record in records if key in record))


def machine(device: str = "cpu") -> dict[str, Any]:
    """Names of processor and device, and the number of cores.

    Args:
        device: "cpu", or of PyTorch.
    """
    if device != "cpu":
        import torch

        device = torch.cuda.get_device_name(device)
    return {"processor": _processor(), "cores": os.cpu_count(), "device": device}


def _processor() -> str:
    listing = Path("/proc/cpuinfo")
    if listing.is_file():
        for line in listing.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _text(value: Any) -> str:
    return json.dumps(json_ready(value), ensure_ascii=False)
