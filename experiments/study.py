"""What a study is: its options with a quick variant, who is measured, in what, how, and how that is shown."""

import abc
import hashlib
import importlib.util
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

from matplotlib.figure import Figure

from experiments.agents import Agent
from experiments.results import Record, Results, distinct, group
from experiments.tables import Column, table
from go1_mtl_gym.errors import InvalidInputError
from trainers.policies.checkpoint import versions
from trainers.utils.files import json_ready

CACHE = Path("runs/experiments")
"""Where finished cells, demonstrations and policies are kept."""
ALL_GAITS = "all gaits"
"""Stands for the task where all of an agent's gaits are measured together."""
EVALUATION_CODE = (
    "go1_mtl_gym",
    "experts",
    "trainers.data",
    "trainers.policies",
    "trainers.evaluation",
    "experiments.agents",
    "experiments.student.episodes",
)
"""What the metrics of a finished policy or of the expert depend on."""
TRAINING_CODE = (*EVALUATION_CODE, "trainers.algorithms", "trainers.pipeline")
"""What a policy that a study trains depends on as well."""
Metrics = dict[str, Any] | list[dict[str, Any]]
"""What a cell gives: the metrics of one record, or of several, each of which may name another task or condition."""


@dataclass(frozen=True)
class Cell:
    """One thing that is measured of an agent.

    Attributes:
        task: the gait, or `ALL_GAITS`.
        condition: what is done to the agent.
        seed: of a training that is part of the cell; None if there is none.
    """

    task: str
    condition: str = ""
    seed: int | None = None


@dataclass(frozen=True)
class Study(abc.ABC):
    """One study with its options.

    Attributes:
        options: how much is measured, a frozen dataclass.
        policies: files that were given; empty: the study's own choice.
        cache: folder of everything that is kept.
    """

    options: Any
    policies: tuple[Agent, ...] = ()
    cache: Path = CACHE

    name: ClassVar[str]
    """Of the study, of its results file and of its picture."""
    title: ClassVar[str]
    """Of its section in the pages."""
    note: ClassVar[str] = ""
    """What its table shows."""
    caption: ClassVar[str] = ""
    """What its picture shows; empty if it has none."""
    more_captions: ClassVar[dict[str, str]] = {}
    """End of a file's name -> what that picture shows, see `more_figures`."""
    rows: ClassVar[Mapping[str, str]] = {}
    """Key of the records -> header: what a row of the table is about. Rows are in the order of the first key."""
    columns: ClassVar[Mapping[str, Column]] = {}
    """Header -> what writes the cell of a row's records."""
    keys: ClassVar[tuple[str, ...]] = ("agent", "task", "condition", "seed")
    """What tells one record from another."""
    full: ClassVar[Any]
    quick: ClassVar[Any]
    """Options of a whole run, and of one that measures everything and nothing well."""
    code: ClassVar[tuple[str, ...]] = TRAINING_CODE
    """Packages and modules beside the study's own whose code a cell depends on."""
    alone: ClassVar[bool] = False
    """Whether nothing else may run meanwhile, because time is measured."""
    takes_policies: ClassVar[bool] = False
    """Whether policy files can be given."""

    @abc.abstractmethod
    def agents(self) -> Sequence[Agent]:
        """Who is measured."""

    @abc.abstractmethod
    def cells(self, agent: Agent) -> Sequence[Cell]:
        """What is measured of an agent."""

    @abc.abstractmethod
    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        """Measure one cell; depends on nothing but these arguments and the options.

        Args:
            agent: who.
            cell: what.
            seed: of the evaluation.
        """

    def table(self, results: Results) -> str:
        """The results in Markdown."""
        return self.table_of(results.records)

    def table_of(self, records: Sequence[Record]) -> str:
        """`rows` and `columns` of some records."""
        first = next(iter(self.rows))
        order = distinct(records, first)
        in_order = sorted(records, key=lambda record: order.index(record[first]))
        return table(group(in_order, [*self.rows]), [*self.rows.values()], self.columns)

    def paragraphs(self, results: Results) -> list[str]:
        """The section of a page, between its heading and the picture."""
        return [self.table(results), *filter(None, [self.note])]

    def figure(self, results: Results) -> Figure | None:
        """The results as a picture; None if there is nothing to draw."""
        return None

    def more_figures(self) -> dict[str, Figure]:
        """Pictures of what the cells left in `folder`, by the end of their files' names."""
        return {}

    def prepare(self, n_jobs: int) -> None:  # noqa: B027
        """Make what the cells share."""

    def published_options(self) -> dict[str, Any]:
        """The options as they stand in the results file."""
        return json_ready(asdict(self.options))

    def more(self) -> dict[str, Any]:
        """What is needed to show the results beside the records."""
        return {}

    @property
    def cell_options(self) -> Any:
        """Options that a cell depends on, whichever other cells there are."""
        return self.options

    @property
    def shared_options(self) -> Any:
        """Options that what the cells share depends on."""
        return self.options

    @property
    def folder(self) -> Path:
        """Of what the cells share; its name changes with the options, the code and the versions."""
        return self.cache / f"{self.name}-{self._digest(repr(self.shared_options))}"

    def cell_path(self, agent: Agent, cell: Cell, seed: int) -> Path:
        """File of a finished cell; its name changes with anything that could change its metrics."""
        stem = re.sub(r"[^\w.-]+", "_", "-".join(filter(None, (agent.label, cell.task, cell.condition))))
        words = (agent.identity, repr(cell), str(seed), repr(self.cell_options))
        return self.cache / self.name / f"{stem}-{self._digest(*words)}.json"

    def _digest(self, *words: str) -> str:
        return digest((*words, code_digest((type(self).__module__, *self.code)), repr(versions())))


def option(default: Any, about: str) -> Any:
    """A field of a study's options, and what ``--help`` says of it."""
    return field(default=default, metadata={"about": about})


def digest(words: Iterable[str]) -> str:
    """12 hexadecimal digits that change with any of the words."""
    total = hashlib.sha256()
    for word in words:
        total.update(f"{len(word)}:{word}".encode())
    return total.hexdigest()[:12]


def sources(name: str) -> str:
    """The code of a module, or the code and the robot descriptions of a package.

    Raises:
        InvalidInputError: if there is no module of that name.
    """
    spec = importlib.util.find_spec(name)
    if spec is None or spec.origin is None:
        raise InvalidInputError(f"expected the name of a module, got {name!r}")
    if spec.submodule_search_locations is None:
        return Path(spec.origin).read_text(encoding="utf-8")
    folder = Path(spec.origin).parent
    files = sorted(path for kind in ("*.py", "*.xml") for path in folder.rglob(kind))
    return "\n".join(path.read_text(encoding="utf-8") for path in files)


@cache
def code_digest(names: tuple[str, ...]) -> str:
    """A digest of the `sources` of some modules and packages."""
    return digest(map(sources, names))
