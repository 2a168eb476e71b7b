"""What `trainers.certify` finds out, as one value, one JSON file and one page."""

import dataclasses
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import one_of
from trainers.evaluation.cells import Cell, Settings
from trainers.evaluation.certificate_page import page
from trainers.evaluation.stopping import MET
from trainers.utils.files import json_form, read_json

FILE = "certificate.json"


@dataclasses.dataclass(frozen=True)
class Certificate:
    """What is known of a policy, cell by cell, and how it was found out.

    Attributes:
        policy: its "name" and "sha256".
        settings: that all cells have in common.
        versions: of the packages that shape a result.
        cells: in the order of conditions and gaits.
        reference: another policy's "name" and "sha256" that had the same episodes, or None.
    """

    policy: Mapping[str, str]
    settings: Settings
    versions: Mapping[str, str]
    cells: tuple[Cell, ...]
    reference: Mapping[str, str] | None = None

    @property
    def met(self) -> bool:
        """Whether there are cells, and the claims of all are met."""
        return bool(self.cells) and all(cell.verdict == MET for cell in self.cells)

    def cell(self, condition: str, task: str) -> Cell:
        """The cell of a condition and a gait (or "all gaits").

        Raises:
            InvalidInputError: if there is none.
        """
        cells = {cell.name: cell for cell in self.cells}
        return cells[one_of(f"{condition}/{task}", tuple(cells), "cell of the certificate")]

    def markdown(self) -> str:
        """The page."""
        return page(self.policy, self.reference, self.settings, self.versions, self.cells)

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready values."""
        return {
            "policy": dict(self.policy),
            "reference": None if self.reference is None else dict(self.reference),
            "met": self.met,
            "settings": json_form(self.settings, "settings"),
            "versions": dict(self.versions),
            "cells": [cell.as_dict() for cell in self.cells],
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "Certificate":
        """The inverse of `as_dict`.

        Raises:
            InvalidInputError: if the values are no certificate's.
        """
        try:
            settings = Settings(**values["settings"])
            cells = tuple(Cell.from_dict(each) for each in values["cells"])
            policy, reference = _identity(values["policy"]), values["reference"]
            return cls(policy, settings, values["versions"], cells, reference and _identity(reference))
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InvalidInputError(f"a certificate was expected, got something else ({error!r})") from error

    @classmethod
    def read(cls, path: str | PathLike[str]) -> "Certificate":
        """From its JSON file, or the folder that holds it.

        Raises:
            InvalidInputError: if there is no such file, or it holds something else.
        """
        file = Path(path) / FILE if Path(path).is_dir() else Path(path)
        return cls.from_dict(read_json(file, "certificate"))


def _identity(values: Any) -> dict[str, str]:
    """Name and digest of a policy, from JSON."""
    return {name: str(values[name]) for name in ("name", "sha256")}
