"""Running a study: its cells side by side, from a cache on disk, so that it goes on where it was interrupted."""

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import joblib
from threadpoolctl import threadpool_limits
from tqdm.auto import tqdm

from experiments.agents import Agent
from experiments.results import Record, Results, machine
from experiments.study import Cell, Study
from go1_mtl_gym.errors import InvalidInputError
from trainers.algorithms.optimizer import torch_threads
from trainers.data.environments import WithTasks
from trainers.policies.checkpoint import versions
from trainers.utils.files import json_ready, write_json
from trainers.utils.processes import keep_interrupts


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
