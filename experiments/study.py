"""The frame of every study: agents, cells, a cache of finished cells on disk, and a run that goes on where it stopped.

A study is one class: its options with a quick variant, who is measured, in what, how, and how that is shown.
"""

import abc
import hashlib
import importlib.util
import inspect
import json
import os
import re
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import joblib
from matplotlib.figure import Figure
from threadpoolctl import threadpool_limits
from tqdm.auto import tqdm

from experiments.agents import Agent
from experiments.results import Record, Results, machine
from go1_mtl_gym.errors import InvalidInputError
from trainers.algorithms.optimizer import torch_threads
from trainers.data.environments import WithTasks
from trainers.policies.checkpoint import versions
from trainers.utils.files import json_ready, write_json
from trainers.utils.processes import keep_interrupts

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

    @abc.abstractmethod
    def table(self, results: Results) -> str:
        """The results in Markdown."""

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


# -- Running -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Measurement:
    """One cell to be measured; picklable."""

    study: Study
    agent: Agent
    cell: Cell
    seed: int

    def __call__(self) -> dict[str, Any]:
        """{"records", "seconds"}: read if the cell is finished, else measured on one thread and written."""
        path = self.study.cell_path(self.agent, self.cell, self.seed)
        if path.is_file():
            return json.loads(path.read_text(encoding="utf-8"))
        start = time.monotonic()
        with threadpool_limits(1), torch_threads(1):
            metrics = self.study.measure(self.agent, self.cell, self.seed)
        records = [self._head() | each for each in (metrics if isinstance(metrics, list) else [metrics])]
        finished = json_ready({"records": records, "seconds": round(time.monotonic() - start, 2)})
        write_json(path, finished)
        return finished

    def _head(self) -> Record:
        seeds = (self.agent.seed, self.cell.seed, self.seed)
        return {
            "study": self.study.name,
            "agent": self.agent.name,
            "task": self.cell.task,
            "condition": self.cell.condition,
            "seed": next(seed for seed in seeds if seed is not None),
        }


def run(study: Study, seed: int, n_jobs: int = 1, command: str = "", only: Sequence[str] = ()) -> Results:
    """Measure what is not measured yet, in processes side by side, one thread each.

    Args:
        study: which.
        seed: of the evaluation.
        n_jobs: processes.
        command: that this is the answer to.
        only: names of agents, tasks and conditions; a cell is left out if none of its own is among them.

    Raises:
        InvalidInputError: if `only` leaves nothing to measure.
    """
    agents = list(study.agents())
    chosen = [(agent, cell) for agent in agents for cell in study.cells(agent) if _is_in(agent, cell, only)]
    if not chosen:
        raise InvalidInputError(f"{' '.join(only) or 'this'} leaves nothing to measure in {study.name}")
    agents = [agent for agent in agents if any(agent is other for other, _ in chosen)]
    origins = {agent.origin: agent.prepare for agent in agents if agent.origin is not None}
    training_s = _side_by_side([*origins.values()], n_jobs, f"{study.name}: training")
    measurements = [Measurement(study, agent, cell, seed) for agent, cell in chosen]
    paths = [study.cell_path(each.agent, each.cell, seed) for each in measurements]
    if not all(path.is_file() for path in paths):
        study.prepare(n_jobs)
    finished = _side_by_side(measurements, 1 if study.alone else n_jobs, study.name)
    seconds = {"training": sum(training_s), "cells": sum(each["seconds"] for each in finished)}
    return Results(
        study=study.name,
        command=command,
        seed=seed,
        options=study.published_options(),
        versions=versions(),
        machine=machine(getattr(study.options, "device", "cpu")),
        seconds={name: round(value, 1) for name, value in seconds.items() if value},
        records=tuple(record for each in finished for record in each["records"]),
        policies={agent.label: agent.sha256 for agent in agents if hasattr(agent, "sha256")},
        more=json_ready(study.more()),
    )


def _is_in(agent: Agent, cell: Cell, only: Sequence[str]) -> bool:
    if agent.conditions and cell.condition not in agent.conditions:
        return False
    return not only or not {agent.name, cell.task, cell.condition}.isdisjoint(only)


def _side_by_side(calls: Sequence[Any], n_jobs: int, title: str) -> list[Any]:
    if n_jobs == 1 or len(calls) < 2:
        results = (call() for call in calls)
    else:
        parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator")
        with keep_interrupts():
            results = parallel(joblib.delayed(WithTasks(call))() for call in calls)
    return list(tqdm(results, title, len(calls), unit="cell", disable=None if calls else True))


# -- Options -----------------------------------------------------------------------------------------------------------


def option(default: Any, about: str) -> Any:
    """A field of a study's options, and what ``--help`` says of it."""
    return field(default=default, metadata={"about": about})


def with_options(options: Any, given: dict[str, Any]) -> Any:
    """Options with some of their fields replaced; lists become tuples."""
    values = {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}
    return replace(options, **values)


def default_jobs() -> int:
    """As many processes as there are cores."""
    return os.cpu_count() or 1


def summary_line(study: type[Study]) -> str:
    """What a study is about: the first line of its docstring."""
    return (inspect.getdoc(study) or study.title).splitlines()[0]
