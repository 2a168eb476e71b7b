"""DAgger against cloning: budgets, real drops, table and figure by hand, and tiny lessons in one gait."""

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

import report_student  # noqa: E402
from main_job.students import new_policy  # noqa: E402
from student_report import budget as student_budget  # noqa: E402
from student_report import lessons as student_lessons  # noqa: E402
from student_report import lessons_page as student_lessons_page  # noqa: E402
from student_report import parts as student_parts  # noqa: E402

TINY = dataclasses.replace(
    student_budget.QUICK,
    job=dataclasses.replace(student_budget.QUICK.job, tasks=("trot",), shard_s=1.0, clone_steps=5, episode_s=0.5),
    budgets_s=(1.0, 2.0, 4.0),
)


def pooled(succeeded, survived=20, trials=20, error=0.1):
    rate = succeeded / trials
    interval = trainers.evaluation.metrics.wilson_interval(succeeded, trials)
    counts = {"succeeded": succeeded, "survived": survived, "trials": trials, "velocity_error": error}
    return counts | {"success_rate": rate, "success_interval": interval}


def levels(*successes, falls=(0, 2, 5), share=0.5):
    return [
        {"seconds": 15.0 * 2**i, "falls": falls[i], "learner_fraction": share, "pooled": pooled(own)}
        for i, own in enumerate(successes)
    ]


def lessons(name, folder, seed=0):
    return student_budget.Lessons(student_budget.METHODS[name], TINY, seed, folder, name)


# -- Budgets and drops -------------------------------------------------------------------------------------------------


def test_a_drop_is_real_if_it_exceeds_the_interval_of_the_difference():
    # 18/20 and 15/20 differ by 0.15, the interval reaches 0.24 below; 90/100 and 75/100 by as much, with 0.105.
    assert student_budget.drops([pooled(18), pooled(15)]) == []
    assert student_budget.drops([pooled(90, trials=100), pooled(75, trials=100)]) == [1]
    assert student_budget.drops([pooled(5), pooled(20), pooled(9), pooled(20), pooled(20)]) == [2]
    assert student_budget.drops([pooled(0), pooled(0)]) == student_budget.drops([pooled(20)]) == []


@pytest.mark.parametrize("budgets", [(), (15.0, 45.0), (20.0, 40.0), (7.5, 15.0)])
def test_budgets_are_whole_shards_and_double(budgets):
    with pytest.raises(InvalidInputError, match="twice"):
        student_budget.BudgetConfig(budgets_s=budgets)


def test_nobody_is_disturbed_but_as_said_and_budgets_are_nested():
    config = student_budget.BudgetConfig()
    small, large = (config.demonstrations(1, True, seconds) for seconds in (15.0, 60.0))
    assert len(small) == 4 and len(large) == 16 and large[:4] == small
    assert {job.task for job in small} == set(config.job.tasks)
    for job in large:
        assert job.perturbation.noise_rad == 0.06 and job.perturbation.corner_fraction == 0.25
        assert job.perturbation.task_interval is None and "randomization" not in job.env_kwargs
    clean = config.demonstrations(1, False, 60.0)
    other = config.demonstrations(0, False, 60.0)
    assert all(job.perturbation is None for job in clean)
    assert len({(job.task, job.seed) for job in (*large, *clean, *other)}) == 48


def test_a_shard_of_a_budget_is_no_longer_than_an_episode():
    assert student_budget.BudgetConfig().job.shard_s <= trainers.data.collection.EPISODE_S  # or falls are miscounted


# -- Lessons -----------------------------------------------------------------------------------------------------------


def test_every_student_starts_from_the_same_weights_and_sees_its_budget(tmp_path, monkeypatch):
    begun, seen, fit = [], [], trainers.BCTrainer.fit

    def watched(self, dataset, *args, **kwargs):
        begun.append({name: value.clone() for name, value in self.policy.actor.state_dict().items()})
        seen.append(len(dataset))
        np.testing.assert_allclose(self.policy.obs_normalizer.shift[:3], dataset.obs[:, :3].mean(0), atol=2e-3)
        return fit(self, dataset, *args, **kwargs)

    monkeypatch.setattr(trainers.BCTrainer, "fit", watched)
    initial = new_policy(TINY.seeded(0), TINY.job.env_kwargs).actor.state_dict()
    for name in ("clean BC", "DAgger"):
        for _ in lessons(name, tmp_path):
            pass
    assert seen == 2 * [50, 100, 200]
    for weights in begun:
        assert all(torch.equal(weights[name], initial[name]) for name in initial)


def test_who_drove_and_fell_is_counted_and_finished_students_are_read(tmp_path):
    found = {}
    for name in ("clean BC", "DAgger", "safe DAgger"):
        found[name] = [counts for _, _, counts in lessons(name, tmp_path)]
    assert found["clean BC"] == 3 * [{"falls": 0, "learner_fraction": 0.0}]
    assert [counts["learner_fraction"] for counts in found["DAgger"]] == [0.0, 0.5, 0.75]
    assert found["safe DAgger"][-1]["learner_fraction"] < 0.75
    falls = [counts["falls"] for counts in found["DAgger"]]
    assert falls == sorted(falls)
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}
    again = [(seconds, counts) for seconds, _, counts in lessons("DAgger", tmp_path)]
    assert again == list(zip(TINY.budgets_s, found["DAgger"]))
    assert kept == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}


def test_equal_seeds_give_equal_figures(tmp_path):
    def measure(folder, what):
        return student_budget.budget("perturbed safe DAgger", student_lessons.ALL, what, TINY, 1, tmp_path / folder)

    first = measure("a", "seed 0")
    assert first == measure("b", "seed 0") != measure("a", "seed 1")
    assert [level["seconds"] for level in first["levels"]] == [1.0, 2.0, 4.0]
    assert first["levels"][0]["pooled"] == first["levels"][0]["tasks"]["trot"]


# -- Table, figure and run ---------------------------------------------------------------------------------------------

REPORT = {
    "clean BC": {"all gaits": {"seed 0": {"levels": levels(2, 20, 4)}, "seed 1": {"levels": levels(4, 18, 6)}}},
    "DAgger": {"all gaits": {"seed 0": {"levels": levels(2, 10, 20, share=1.0)}}},
}


def test_the_table_pools_seeds_and_names_drops():
    table = student_lessons_page.budget_table(REPORT).splitlines()
    assert table[0].startswith("|  | 15 s | 30 s | 60 s | velocity error [m/s] |")
    assert table[2] == "| clean BC | 15% (100%) | 95% (100%) | 25% (100%) | 0.100 | 5.0 | 50% | 60 s |"
    assert table[3] == "| DAgger | 10% (100%) | 50% (100%) | 100% (100%) | 0.100 | 5.0 | 100% | none |"


def test_the_figure_shows_survival_success_and_falls():
    shares, falls = student_lessons_page.budget_figure(REPORT).axes
    np.testing.assert_allclose([line.get_ydata() for line in shares.lines[:2]], [[1, 1, 1], [0.15, 0.95, 0.25]])
    assert shares.lines[1].get_linestyle() == "--" and shares.get_xscale() == falls.get_xscale() == "log"
    assert [list(line.get_ydata()) for line in falls.lines] == [[0, 2, 5], [0, 2, 5]]
    assert shares.lines[0].get_color() == falls.lines[0].get_color() != falls.lines[1].get_color()


def test_parts_share_a_folder_that_changes_with_the_settings(tmp_path):
    section = student_parts.SECTIONS["budget"]
    pairs = [("all gaits", what) for what in section.config.parts("all gaits", ())]
    parts = student_parts.parts_of("budget", section, section.config.walkers([]), pairs, 1, tmp_path)
    assert len({part.path for part in parts}) == 10 and len({part.shared for part in parts}) == 1
    other = dataclasses.replace(parts[0], section=dataclasses.replace(section, config=section.quick))
    assert other.shared != parts[0].shared and other.path != parts[0].path
    assert dataclasses.replace(parts[0], seed=2).shared == parts[0].shared


@pytest.mark.slow
def test_a_quick_run_needs_no_policy_and_reads_what_is_there(tmp_path, capsys):
    arguments = ["budget", "--quick", "--n-jobs", "1", "--parts", str(tmp_path / "parts"), "--out-dir", str(tmp_path)]
    assert report_student.main(arguments) == 0
    data = json.loads((tmp_path / "student_budget.json").read_text())
    assert list(data["report"]) == list(student_budget.METHODS) and data["policies"] == {}
    assert data["config"]["settings"]["budgets_s"] == [2.0, 4.0]
    assert "| safe DAgger |" in capsys.readouterr().out and (tmp_path / "student_budget.png").stat().st_size > 5000
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").rglob("*") if path.is_file()}
    assert report_student.main(arguments) == 0
    assert kept == {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    "arguments", ["budget pushes", "budget --tasks trot", "budget --only walk", "budget --policy a.zip"]
)
def test_impossible_commands_are_refused(arguments, tmp_path, capsys):
    assert report_student.main([*arguments.split(), "--out-dir", str(tmp_path / "out")]) == 2
    assert "error: " in capsys.readouterr().err and not (tmp_path / "out").exists()
