"""The frame: what is cached, what is measured again, and what becomes of an interruption."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from experiments import study as frame
from experiments.agents import Agent, PolicyFile
from experiments.results import Results
from experiments.running import run
from experiments.study import Cell, Study
from go1_mtl_gym.errors import InvalidInputError


@dataclass(frozen=True)
class Options:
    """Of the study below."""

    trials: int = 2


@dataclass(frozen=True)
class Noted(Study):
    """A study that leaves a line for every cell that it measures, and is interrupted where it is told."""

    notes: Path = field(default=Path(), kw_only=True)
    stop_at: str = field(default="", kw_only=True)

    name = "noted"
    title = "Noted"
    full = Options()
    quick = Options(1)
    code = ("go1_mtl_gym.errors",)

    def agents(self):
        return [Agent("first"), Agent("second", seed=7)]

    def cells(self, agent):
        return [Cell("trot", "still"), Cell("walk", "pushed", seed=None if agent.seed else 4)]

    def measure(self, agent, cell, seed):
        if cell.task == self.stop_at:
            raise KeyboardInterrupt
        with open(self.notes, "a", encoding="utf-8") as file:
            file.write(f"{agent.name} {cell.task} {seed}\n")
        record = {"trials": self.options.trials, "error": float("nan")}
        return record if cell.task == "trot" else [record, {"task": "jump", **record}]

    def table(self, results):
        return ""


@pytest.fixture
def study(tmp_path) -> Noted:
    return Noted(Noted.full, cache=tmp_path / "cache", notes=tmp_path / "notes")


def measured(study: Noted) -> list[str]:
    return study.notes.read_text(encoding="utf-8").splitlines() if study.notes.is_file() else []


def test_every_cell_becomes_flat_records(study):
    results = run(study, 3, command="python -m experiments run noted")
    heads = [[own[key] for key in ("study", "agent", "task", "condition", "seed")] for own in results.records]
    assert heads == [
        ["noted", "first", "trot", "still", 3],
        ["noted", "first", "walk", "pushed", 4],
        ["noted", "first", "jump", "pushed", 4],
        ["noted", "second", "trot", "still", 7],
        ["noted", "second", "walk", "pushed", 7],
        ["noted", "second", "jump", "pushed", 7],
    ]
    assert all(own["trials"] == 2 and own["error"] is None for own in results.records)
    assert results.options == {"trials": 2} and results.seed == 3 and results.machine["device"] == "cpu"


def test_finished_cells_are_read(study):
    first = run(study, 3)
    assert len(measured(study)) == 4
    assert run(study, 3).records == first.records and len(measured(study)) == 4


def test_an_interrupted_run_goes_on(study):
    with pytest.raises(KeyboardInterrupt):
        run(replace(study, stop_at="walk"), 3)
    assert measured(study) == ["first trot 3"]
    assert len(run(study, 3).records) == 6
    assert sorted(measured(study)) == ["first trot 3", "first walk 3", "second trot 3", "second walk 3"]


def test_processes_change_nothing(study):
    together = run(study, 3, n_jobs=2)
    alone = run(replace(study, cache=study.cache / "other"), 3)
    assert together.records == alone.records and len(measured(study)) == 8


def test_whatever_could_change_a_cell_is_measured_again(study, tmp_path, monkeypatch):
    agent, cell = Agent("first"), Cell("trot", "still")
    base = study.cell_path(agent, cell, 3)
    others = [
        study.cell_path(replace(agent, env_kwargs={"kp": 20.0}), cell, 3),
        study.cell_path(agent, replace(cell, condition="pushed"), 3),
        study.cell_path(agent, replace(cell, seed=1), 3),
        study.cell_path(agent, cell, 4),
        replace(study, options=Options(5)).cell_path(agent, cell, 3),
    ]
    monkeypatch.setattr(frame, "versions", lambda: {"numpy": "1"})
    others.append(study.cell_path(agent, cell, 3))
    monkeypatch.undo()
    monkeypatch.setattr(frame, "sources", lambda name: f"other code of {name}")
    frame.code_digest.cache_clear()
    others.append(study.cell_path(agent, cell, 3))
    assert len({base, *others}) == len(others) + 1
    monkeypatch.undo()
    frame.code_digest.cache_clear()
    assert study.cell_path(agent, cell, 3) == base
    assert len({study.folder, replace(study, options=Options(5)).folder}) == 2


def test_a_policy_is_known_by_its_file_and_not_by_its_place(study, tmp_path):
    for name, content in (("a", b"weights"), ("b", b"weights"), ("c", b"others")):
        (tmp_path / name).write_bytes(content)
    paths = [study.cell_path(PolicyFile("student", path=tmp_path / name), Cell("trot"), 1) for name in "abc"]
    assert paths[0] == paths[1] != paths[2]


def test_only_what_is_named_is_measured(study):
    assert [own["agent"] for own in run(study, 3, only=["second"]).records] == ["second"] * 3
    assert {own["task"] for own in run(study, 3, only=["still"]).records} == {"trot"}
    with pytest.raises(InvalidInputError, match="bound leaves nothing"):
        run(study, 3, only=["bound"])


def test_agents_of_one_origin_are_made_once_and_before_they_are_measured(study, tmp_path):
    @dataclass(frozen=True)
    class Made(Agent):
        origin = "one training"

        def prepare(self):
            (tmp_path / "made").write_text((tmp_path / "made").read_text() + "x" if self.made else "x")
            return 2.5

        @property
        def made(self):
            return (tmp_path / "made").is_file()

    class Training(Noted):
        def agents(self):
            return [Made("first", seed=0), Made("second", seed=0)]

        def measure(self, agent, cell, seed):
            assert agent.made
            return {}

    results = run(Training(Options(), cache=study.cache, notes=study.notes), 1)
    assert (tmp_path / "made").read_text() == "x" and results.seconds["training"] == 2.5


def test_results_are_written_with_one_record_a_line_and_read_again(study, tmp_path):
    results = run(study, 3)
    results.write(tmp_path / "noted.json")
    lines = (tmp_path / "noted.json").read_text(encoding="utf-8").splitlines()
    assert sum('"study": "noted", "agent"' in line for line in lines) == len(results.records)
    assert Results.read(tmp_path / "noted.json") == results
    (tmp_path / "bad.json").write_text('{"records": []}')
    for name, reason in (("missing", "no file of results"), ("bad", "does not hold the results")):
        with pytest.raises(InvalidInputError, match=reason):
            Results.read(tmp_path / f"{name}.json")


def test_records_that_a_run_does_not_replace_are_kept_beside_it(study):
    first = run(study, 3, command="one", only=["first"])
    second = run(replace(study, options=Options(9)), 3, command="two")
    both = second.beside(first, Study.keys)
    assert both.records == second.records and both.command == "one and two"
    assert first.beside(run(study, 8, only=["first"], command="two"), Study.keys).records[0]["seed"] == 8
