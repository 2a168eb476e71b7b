"""The paper's tables: its figures, settings, commands, shards, and a quick run."""

import dataclasses
import json
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

from go1_mtl_gym import TASKS, EstimatorNoise, InvalidInputError

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

import reproduce_paper  # noqa: E402
from paper_report import config as paper_config  # noqa: E402
from paper_report import data as paper_data  # noqa: E402
from paper_report import page as paper_page  # noqa: E402
from paper_report import published as paper_published  # noqa: E402
from paper_report import sums as paper_sums  # noqa: E402

from trainers.utils.report import PAPER_R2  # noqa: E402

TABLE = paper_config.Table(
    "simulation", "simulation", ("trot", "bound"), {"control_hz": 50}, dict.fromkeys(("trot", "bound"), (0.5, 0.2, 0.0))
)
TINY = dataclasses.replace(paper_config.QUICK, seconds=0.4, widths=(8,), steps=12, batch_size=16, curve_rows=5)


# -- What is published -------------------------------------------------------------------------------------------------


def test_the_papers_figures_are_those_of_the_other_table():
    for table, gaits in paper_published.PUBLISHED.items():
        assert set(gaits) == set(paper_config.TABLES[table].gaits) == set(paper_sums.AIMS[table])
    for gait, (multi, single, where) in PAPER_R2.items():
        own = paper_published.PUBLISHED[where][gait]
        assert own["multi_head"]["r2"] == multi and own.get("pooled", {}).get("r2") == single


def test_the_papers_errors_belong_together():
    # MSE / (1 - R2) is the variance of the held-out targets, about the same for both networks of a gait.
    own = paper_published.PUBLISHED["simulation"]
    variance = {gait: [x["mse"] / (1 - x["r2"]) for x in kinds.values()] for gait, kinds in own.items()}
    assert variance["trot"] == pytest.approx([0.00656, 0.00646], abs=1e-5)
    for values in variance.values():
        assert max(values) < 1.12 * min(values)
    assert all(x["mse"] >= x["mae"] ** 2 for kinds in own.values() for x in kinds.values())


# -- Settings ----------------------------------------------------------------------------------------------------------


def test_the_full_settings_are_the_papers():
    full, simulation, hardware = paper_config.FULL, paper_config.SIMULATION, paper_config.HARDWARE
    assert full.train_commands * full.seconds * simulation.env_kwargs["control_hz"] == 600_000
    assert simulation.named == {"trot": (0.7, 0.3, 0.0), "jump": (0.6, 0.3, 0.0), "bound": (0.5, 0.2, 0.0)}
    assert hardware.gaits == ("trot", "walk") and hardware.env_kwargs["control_hz"] == 500
    assert hardware.env_kwargs["estimator_noise"] and not hardware.named
    half = paper_config.HALF_NOISE.env_kwargs.pop("estimator_noise")
    assert half.velocity == 0.5 * EstimatorNoise().velocity
    assert paper_config.HALF_NOISE.student_kwargs == hardware.student_kwargs
    assert hardware.env_kwargs == hardware.student_kwargs | {"estimator_noise": True}
    own = paper_config.ESTIMATOR
    assert own.student_kwargs == hardware.student_kwargs and own.env_kwargs["estimator_noise"] is None
    assert own.env_kwargs["state_estimator"] is True
    assert len(full.seeds) == 5 and full.normalization == "min_max"


@pytest.mark.parametrize("table", paper_config.TABLES.values(), ids=lambda table: table.name)
def test_a_table_goes_to_other_processes_and_its_shards_are_known_again(table):
    assert pickle.loads(pickle.dumps(table)) == table
    job = paper_data.shard_jobs(table, paper_config.FULL)["train"][0]
    assert json.loads(json.dumps(job.as_dict())) == job.as_dict()
    assert json.loads(json.dumps(table.student_kwargs)) == table.student_kwargs | {
        "tasks": [*table.gaits],
        "channels": [],
    }


@pytest.mark.parametrize(
    "change",
    [
        {"train_commands": 0},
        {"unseen_commands": 101},
        {"seconds": 31.0},
        {"seed": -1},
        {"widths": ()},
        {"widths": (8, 8)},
        {"seeds": (-1,)},
        {"steps": 0},
        {"span": (0.8, 0.0)},
        {"gap": -0.1},
        {"space": "degrees"},
        {"precision": "float16"},
        {"curve_rows": 0},
    ],
)
def test_impossible_settings_are_refused(change):
    with pytest.raises(InvalidInputError):
        dataclasses.replace(paper_config.FULL, **change)


def test_a_named_command_beyond_the_limit_is_refused():
    with pytest.raises(InvalidInputError, match="jump"):
        paper_config.Table("a", "simulation", ("jump",), {}, {"jump": (0.6, 0.9, 0.0)})


def test_commands_are_named_for_all_gaits_or_none():
    with pytest.raises(InvalidInputError, match="none or all"):
        paper_config.Table("a", "simulation", ("jump", "trot"), {}, {"jump": (0.6, 0.3, 0.0)})


def test_a_network_of_one_gait_draws_as_many_of_its_rows():
    config = dataclasses.replace(paper_config.FULL, batch_size=900, steps=400, curve_points=40)
    assert [config.bc(3, share).batch_size for share in (1.0, 1 / 3)] == [900, 300]
    assert config.bc(3, 1.0).log_interval == 10 and config.bc(3, 1.0).seed == 3


def test_precisions_are_told_apart():
    asked = [dataclasses.replace(paper_config.FULL, precision=name).bc(0, 1.0) for name in paper_config.PRECISIONS]
    assert [(own.matmul_precision, own.autocast) for own in asked] == [
        ("highest", False),
        ("medium", False),
        ("highest", True),
    ]


def test_commands_are_drawn_within_what_the_expert_survives(passing_tasks):
    assert paper_config.FULL.largest("jump").tolist() == [0.8, 0.5, 0.0]
    wide = dataclasses.replace(paper_config.FULL, span=(0.8, 1.5))
    assert wide.largest("jump").tolist() == [0.8, TASKS["jump"].command_limit[1], 0.0]


# -- Commands and shards -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("table", paper_config.TABLES.values(), ids=lambda table: table.name)
def test_held_out_commands_keep_away_from_all_others(table):
    config = dataclasses.replace(paper_config.FULL, gap=0.12)
    for gait in table.gaits:
        own = paper_data.commands(table, gait, config)
        assert [len(own[use]) for use in ("train", "named", "unseen")] == [20, gait in table.named, 10]
        train, held = np.array(own["train"]), np.array(own["named"] + own["unseen"])
        assert np.linalg.norm(train[:, None] - held, axis=2).min() >= 0.12
        drawn = np.abs([*own["train"], *own["unseen"]])
        assert (drawn <= config.largest(gait)).all() and (drawn[:, :2].max(axis=0) > [0.6, 0.35]).all()


def test_commands_come_from_the_seed():
    first, same = (paper_data.commands(TABLE, "trot", TINY) for _ in range(2))
    other = paper_data.commands(TABLE, "trot", dataclasses.replace(TINY, seed=1))
    assert first == same and first["train"] != other["train"] and first["unseen"] != other["unseen"]
    assert first["train"] != paper_data.commands(TABLE, "bound", TINY)["train"]


def test_more_commands_than_there_is_room_for_are_refused():
    rng = np.random.default_rng(0)
    with pytest.raises(InvalidInputError, match="room"):
        paper_data.draw_apart(rng, 1, np.array([0.1, 0.1, 0.0]), [(0.0, 0.0, 0.0)], 0.2)


def test_no_two_shards_share_a_seed():
    jobs = paper_data.shard_jobs(paper_config.SIMULATION, paper_config.FULL)
    other = paper_data.shard_jobs(paper_config.SIMULATION, dataclasses.replace(paper_config.FULL, seed=1))
    names = [job.name for table in (jobs, other) for own in table.values() for job in own]
    assert len(set(names)) == len(names) == 2 * 3 * (20 + 1 + 10)
    assert all(job.perturbation is None and job.seconds == 30.0 for job in jobs["train"])
    assert [job.command for job in jobs["named"]] == [
        paper_config.SIMULATION.named[gait] for gait in ("trot", "jump", "bound")
    ]


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Demonstrations of `TABLE` at 50 Hz."""
    return paper_data.collect(TABLE, TINY, tmp_path_factory.mktemp("paper"), 1, progress=False)


def test_shards_are_sorted_by_use_and_made_once(data):
    assert {use: len(paths) for use, paths in data.paths.items()} == {"train": 4, "named": 2, "unseen": 2}
    assert data.tests == ("named", "unseen") and list(data.rows("named").per_task()) == ["trot", "bound"]
    assert data.rows("train").obs.shape == (4 * 20, 34 + 2)
    before = {path: path.stat().st_mtime_ns for own in data.paths.values() for path in own}
    assert paper_data.collect(TABLE, TINY, data.folder.parent, 1, progress=False) == data
    assert before == {path: path.stat().st_mtime_ns for path in before}
    more = paper_data.shard_jobs(TABLE, dataclasses.replace(TINY, seconds=0.5))
    assert more != paper_data.shard_jobs(TABLE, TINY)


def test_falls_are_counted(data, tmp_path):
    def shard(name, gait, starts):
        own = data.rows("train").per_task()[gait].take(np.arange(10))
        marks = np.zeros(10, dtype=bool)
        marks[starts] = True
        path = tmp_path / f"{name}.npz"
        dataclasses.replace(own, starts=marks, meta={"job": {"task": gait}}).save(path)
        return path

    paths = {"train": (shard("a", "trot", [0, 4, 9]), shard("b", "trot", [0])), "named": (shard("c", "bound", [0, 1]),)}
    assert paper_data.PaperData(tmp_path, paths).account() == {
        "train": {"trot": {"seconds": pytest.approx(0.4), "falls": 2}},
        "named": {"bound": {"seconds": pytest.approx(0.2), "falls": 1}},
    }


# -- The run -----------------------------------------------------------------------------------------------------------


def run(folder, *arguments):
    folders = ["--parts", str(folder / "parts"), "--out-dir", str(folder / "out")]
    return reproduce_paper.main([*arguments, "--quick", "--n-jobs", "1", *folders])


def test_a_quick_run_writes_both_tables_and_adds_to_them(tmp_path, monkeypatch, capsys):
    world = {"control_hz": 50, "action_delay_s": 0.004, "estimator_noise": EstimatorNoise().scaled(0.5)}
    hardware = dataclasses.replace(TABLE, name="hardware", named={}, gaits=("trot", "walk"), world=world)
    tables = {"simulation": TABLE, "hardware": hardware}
    monkeypatch.setattr(reproduce_paper, "TABLES", tables)
    monkeypatch.setattr(reproduce_paper, "QUICK", TINY)
    assert run(tmp_path, "hardware", "--kinds", "multi_head") == 0
    assert run(tmp_path, "simulation", "--seeds", "0") == 0
    out = tmp_path / "out"
    first = json.loads((out / "paper.json").read_text())["tables"]
    assert list(first) == ["simulation", "hardware"] and len(first["hardware"]["students"]) == 2
    (command,) = {own["command"] for own in first["hardware"]["students"]}
    assert command.startswith("python examples/reproduce_paper.py hardware --kinds multi_head --quick")
    assert "--parts" not in command and first["hardware"]["versions"]["mujoco"]
    pictures = {f"paper_{name}_{what}.png" for name in tables for what in ("loss", "targets", "contacts")}
    assert {path.name for path in out.glob("*.png")} == pictures
    page = (out / "paper.md").read_text()
    assert all(f"({name})" in page for name in pictures) and page == paper_page.paper_page(
        {"tables": first}, sorted(pictures)
    )
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").rglob("*") if path.is_file()}
    assert run(tmp_path, "simulation", "--kinds", "pooled", "--widths", "12", "--seeds", "1") == 0
    second = json.loads((out / "paper.json").read_text())["tables"]
    assert second["hardware"] == first["hardware"]
    assert [(own["width"], own["seed"]) for own in second["simulation"]["students"]] == [(8, 0), (12, 1)]
    assert kept == {path: path.stat().st_mtime_ns for path in kept}
    assert "paper.json" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["simulation", "simulation"], "twice"),
        (["simulation", "--kinds", "pooled", "pooled"], "twice"),
        (["simulation", "--seeds", "1", "1"], "different"),
        (["simulation", "--widths", "0"], "widths"),
        (["simulation", "--steps", "0"], "steps"),
        (["simulation", "--batch-size", "0"], "batch_size"),
        (["simulation", "--device", "tpu"], "device"),
        (["simulation", "--threads", "0"], "threads"),
    ],
)
def test_impossible_arguments_are_refused_before_anything_is_made(arguments, reason, tmp_path, capsys):
    assert run(tmp_path, *arguments) == 2
    assert reason in capsys.readouterr().err and not list(tmp_path.iterdir())
