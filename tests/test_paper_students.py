"""The paper's tables: students that are taught once, measured on what was held out, and kept."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import trainers
from go1_mtl_gym import InvalidInputError

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

from paper_report import config as paper_config  # noqa: E402
from paper_report import data as paper_data  # noqa: E402
from paper_report import published as paper_published  # noqa: E402
from paper_report import students as paper_students  # noqa: E402

TABLE = paper_config.Table(
    "simulation", "simulation", ("trot", "bound"), {"control_hz": 50}, dict.fromkeys(("trot", "bound"), (0.5, 0.2, 0.0))
)
TINY = dataclasses.replace(paper_config.QUICK, seconds=0.4, widths=(8,), steps=12, batch_size=16, curve_rows=5)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Demonstrations of `TABLE` at 50 Hz."""
    return paper_data.collect(TABLE, TINY, tmp_path_factory.mktemp("paper"), 1, progress=False)


def test_every_network_is_asked_for_once():
    config = dataclasses.replace(TINY, widths=(8, 16), seeds=(3, 4))
    own = paper_students.students(TABLE, ("pooled", "per_gait"), config)
    assert len(own) == len({each.name for each in own}) == 2 * 2 * (1 + 2)
    assert [each.width for each in own] == [8] * 6 + [16] * 6
    assert {each.gait for each in own if each.kind == "per_gait"} == {"trot", "bound"}


@pytest.mark.parametrize(
    "change",
    [{"kind": "a"}, {"gait": "trot"}, {"kind": "per_gait"}, {"width": 0}, {"seed": -1}, {"precision": "a"}],
)
def test_impossible_students_are_refused(change):
    with pytest.raises(InvalidInputError):
        paper_students.Student(**({"kind": "pooled", "width": 8, "seed": 0, "precision": "float32"} | change))


def test_a_folder_is_named_by_what_makes_its_students(data):
    def folder(**change):
        return paper_students.School(TABLE, dataclasses.replace(TINY, **change), data).folder

    for unused in ({"steps": 5}, {"seeds": (7,)}, {"widths": (9,)}, {"curve_points": 1}, {"precision": "float32"}):
        assert folder(**unused) == folder()
    used = ({"batch_size": 32}, {"learning_rate": 1e-3}, {"normalization": "none"}, {"space": "normalized"})
    assert len({folder(), *(folder(**own) for own in used)}) == 5


def test_thinned_rows_are_spread_over_the_gait(data):
    rows = data.rows("train")
    own = paper_students.thinned(rows, 15)
    assert {gait: len(part) for gait, part in own.per_task().items()} == {"trot": 15, "bound": 15}
    assert len(paper_students.thinned(rows, 1000)) == len(rows) == 80
    np.testing.assert_array_equal(own.obs, paper_students.thinned(rows, 15).obs)
    places = [np.flatnonzero((rows.obs == row).all(axis=1))[0] for row in own.per_task()["trot"].obs]
    assert places == sorted(places) and len(set(np.diff(places))) > 2


@pytest.fixture(scope="module")
def school(data):
    """A school whose students of one seed are taught."""
    own = paper_students.School(TABLE, TINY, data)
    threads = torch.get_num_threads()
    for each in paper_students.students(TABLE, tuple(paper_published.KINDS), dataclasses.replace(TINY, seeds=(1,))):
        own.teach(each)
    assert torch.get_num_threads() == threads
    return own


def test_a_student_is_measured_on_what_was_held_out(school, data):
    for own in school.finished(("multi_head", "pooled", "per_gait")):
        known = {each.name: own[each.name] for each in dataclasses.fields(paper_students.Student)}
        path = school.file(paper_students.Student(**known))
        policy = trainers.load(path.with_suffix(".zip"))
        rows = paper_students.thinned(data.rows("unseen"), 10**6)
        found = trainers.offline_metrics(policy, rows)
        gaits = [own["gait"]] if own["gait"] else ["trot", "bound"]
        assert list(own["scores"]["unseen"]) == gaits
        for gait in gaits:
            assert own["scores"]["unseen"][gait] == pytest.approx(found[gait], rel=1e-4)
        assert policy.pooled == (own["kind"] != "multi_head") and policy.width == 8
        rate = own["steps"] * (8 if own["gait"] else 16) / own["seconds"] if own["seconds"] > 1 else None
        assert rate is None or own["samples_per_s"] == pytest.approx(rate, rel=0.1)


def test_the_curve_ends_at_the_error_of_the_finished_student(school, data):
    multi, *_ = school.finished(("multi_head",))
    policy = school.widest("multi_head")
    shown = trainers.Demonstrations.concatenate([data.rows("named"), data.rows("unseen")])
    found = trainers.offline_metrics(policy, paper_students.thinned(shown, TINY.curve_rows))
    assert multi["curve"]["steps"] == [4, 8, 12]
    for gait, values in multi["curve"]["mse"].items():
        assert len(values) == 3 and values[-1] == pytest.approx(found[gait]["mse"], rel=1e-4)


def test_networks_of_one_gait_learn_nothing_of_the_other(school):
    trot = next(own for own in school.finished(("per_gait",)) if own["gait"] == "trot")
    student = paper_students.Student("per_gait", 8, 1, "bfloat16", "trot")
    policy = trainers.load(school.file(student).with_suffix(".zip"))
    rows = school.data.rows("train").per_task()
    low, high = rows["trot"].acts.min(0), rows["trot"].acts.max(0)
    np.testing.assert_allclose(policy.act_normalizer.shift.numpy(), (low + high) / 2, atol=1e-6)
    assert list(trot["curve"]["mse"]) == ["trot"]


def test_students_are_taught_once_and_wider_ones_are_added(school, monkeypatch):
    kept = {path: path.stat().st_mtime_ns for path in school.folder.iterdir()}
    wider = dataclasses.replace(school, config=dataclasses.replace(TINY, widths=(8, 12), seeds=(1,), steps=4))
    assert wider.folder == school.folder
    paper_students.teach_all(wider, [paper_students.Student("pooled", 12, 1, "bfloat16")], 1)
    monkeypatch.setattr(trainers, "train_bc", None)
    paper_students.teach_all(school, [paper_students.Student("pooled", 8, 1, "bfloat16")], 1)
    assert kept == {path: path.stat().st_mtime_ns for path in kept}
    assert [(own["width"], own["steps"]) for own in school.finished(("pooled",))] == [(8, 12), (12, 4)]
    assert school.widest("pooled").width == 12 and school.widest("multi_head").width == 8


@pytest.mark.slow
def test_students_do_not_depend_on_processes(data):
    own = paper_students.School(TABLE, TINY, data)
    two = dataclasses.replace(own, config=dataclasses.replace(TINY, steps=7))
    wanted = [paper_students.Student("multi_head", 8, seed, "bfloat16") for seed in (0, 1)]
    paper_students.teach_all(two, wanted, 2)
    found = [two.file(each) for each in wanted]
    scores = [json.loads(path.read_text())["scores"] for path in found]
    for path in found:
        path.unlink()
    paper_students.teach_all(two, wanted, 1)
    assert scores == [json.loads(path.read_text())["scores"] for path in found] and scores[0] != scores[1]
