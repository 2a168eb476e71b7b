"""Sections of the student's report that make their own students: lessons, who is measured, and a quick run."""

import dataclasses
import json
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import trainers
from go1_mtl_gym import Go1Env

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

import dagger  # noqa: E402
import publish_results  # noqa: E402
import report_student  # noqa: E402
from main_job import config as dagger_config  # noqa: E402
from main_job.config import JobConfig  # noqa: E402
from main_job.students import new_policy  # noqa: E402
from student_report import ablation as student_ablation  # noqa: E402
from student_report import classes as student_classes  # noqa: E402
from student_report import commanded as student_commanded  # noqa: E402
from student_report import parts as student_parts  # noqa: E402
from student_report import school as student_school  # noqa: E402
from student_report.lab import Walker  # noqa: E402

TINY = {
    "rounds": 1,
    "clean_s": 1.0,
    "perturbed_s": 1.0,
    "held_out_s": 1.0,
    "shard_s": 1.0,
    "dagger_s": 0.4,
    "width": 8,
    "batch_size": 32,
    "clone_steps": 20,
    "round_steps": 10,
    "phase_free_s": 0.5,
    "phase_free_steps": 5,
    "round_episodes": 1,
    "episode_s": 0.5,
}


# -- Lessons -----------------------------------------------------------------------------------------------------------


def test_a_lesson_is_named_by_what_makes_the_student():
    name = student_school.lesson_name(JobConfig(seed=3))
    assert name.startswith("seed-3-") and name == student_school.lesson_name(
        pickle.loads(pickle.dumps(JobConfig(seed=3)))
    )
    for unused in ({"n_envs": 7}, {"device": "cuda"}, {"episodes": 1}, {"preset": "smoke"}, {"video_s": 9.0}):
        assert student_school.lesson_name(JobConfig(seed=3, **unused)) == name
    used = ({"seed": 4}, {"width": 64}, {"kp": 20.0}, {"rounds": 2}, {"phase_free_s": 0.0}, {"takeover_rad": 0.1})
    names = {student_school.lesson_name(JobConfig(**({"seed": 3} | own))) for own in used}
    assert len(names | {name}) == 7


@pytest.fixture(scope="module")
def lesson(tmp_path_factory):
    """A lesson of two gaits: its settings, the folder of all lessons, and the student."""
    config = JobConfig(**TINY, tasks=("trot", "walk"), seed=2, n_envs=2)
    root = tmp_path_factory.mktemp("school")
    threads = torch.get_num_threads()
    student = student_school.teach(config, root)
    assert torch.get_num_threads() == threads
    return config, root, student


def test_a_lesson_leaves_the_main_jobs_student(lesson, tmp_path):
    config, _, student = lesson
    job = dagger.Job(dataclasses.replace(config, n_envs=1), tmp_path / "job")
    train, held_out = job.demonstrations()
    policy = job.student(train, held_out)
    phase_free = job.phase_free(policy)["phase_free"]
    np.testing.assert_allclose(
        trainers.load(student.policy).predict(held_out.obs, deterministic=True)[0],
        policy.predict(held_out.obs, deterministic=True)[0],
        atol=1e-6,
    )
    obs = np.zeros(phase_free.observation_space.shape, dtype=np.float32)
    obs[-2] = 1.0
    found, expected = (
        own.predict(obs, deterministic=True)[0] for own in (trainers.load(student.phase_free), phase_free)
    )
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert student.held_out["walk"]["r2"] == pytest.approx(trainers.offline_metrics(policy, held_out)["walk"]["r2"])


def test_a_lesson_is_not_given_twice(lesson, monkeypatch, capfd):
    config, root, student = lesson
    monkeypatch.setattr(student_school, "_lesson", None)
    lessons = {"a": config, "b": dataclasses.replace(config, n_envs=1, episodes=3)}
    assert student_school.teach_all(lessons, root, 1) == {"a": student, "b": student}
    assert student.seconds > 0.0 and "step/s" in (student.folder / "progress.log").read_text()
    assert "step/s" not in capfd.readouterr().err


def test_an_interrupted_lesson_goes_on(lesson, tmp_path, monkeypatch):
    config, _, _ = lesson
    config = dataclasses.replace(config, rounds=0, phase_free_s=0.0)
    student = dagger.Job.student

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(dagger.Job, "student", interrupted)
    with pytest.raises(KeyboardInterrupt):
        student_school.teach(config, tmp_path)
    shards = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*/demonstrations/*.npz")}
    assert len(shards) == 6
    monkeypatch.setattr(dagger.Job, "student", student)
    taught = student_school.teach(config, tmp_path)
    assert taught.policy.is_file() and taught.phase_free is None
    assert shards == {path: path.stat().st_mtime_ns for path in shards}


# -- Classes -----------------------------------------------------------------------------------------------------------


def test_every_seed_is_a_default_job():
    lessons = student_classes.seed_lessons([4, 0], False)
    assert lessons == {"seed 4": JobConfig(seed=4), "seed 0": JobConfig()}
    assert student_classes.changed(lessons["seed 4"]) == {"seed": 4}
    assert student_classes.seed_lessons([1], True)["seed 1"].clone_steps == 300


def test_variants_differ_from_the_reduced_job_in_their_change_alone():
    lessons = student_classes.variant_lessons([5, 6], False)
    reduced = lessons["default, reduced"]
    assert reduced == JobConfig(**student_classes.REDUCED, seed=5)
    assert len({student_school.lesson_name(config) for config in lessons.values()}) == len(lessons) == 19
    for name, config in lessons.items():
        own = {key: value for key, value in vars(config).items() if value != getattr(reduced, key)}
        assert own == student_classes.VARIANTS[name]


@pytest.mark.parametrize("name", student_classes.VARIANTS)
def test_there_can_be_a_student_of_every_variant(name):
    config = student_classes.variant_lessons([0], False)[name]
    assert new_policy(config, config.env_kwargs).n_tasks == 4


def test_the_changed_world_can_be():
    Go1Env("trot", **student_ablation.CHANGED_WORLD).close()


def test_students_without_a_clock_and_the_expert_are_measured_in_less(lesson):
    _, _, student = lesson
    who = student_classes.seed_walkers({"seed 2": student})
    assert [walker.name for walker in who] == ["seed 2", "seed 2 without a clock", "expert"]
    section = student_parts.SECTIONS["commanded"]
    pairs = [("trot", what) for what in section.config.parts("trot", ("trot",))]
    parts = student_parts.parts_of("commanded", section, who, pairs, 1, Path())
    assert [(part.walker.name, part.what) for part in parts] == [
        ("seed 2", "drawn"),
        ("seed 2", "corners"),
        ("seed 2 without a clock", "phase_free"),
        ("seed 2 without a clock", "clock with correction"),
        ("expert", "drawn"),
        ("expert", "corners"),
    ]
    assert isinstance(who[1].load(), trainers.PhaseFreePolicy) and who[2].env_kwargs["kp"] == 50.0
    alone = student_classes.variant_walkers({"kp 20": student})
    assert alone == [Walker.student("kp 20", student.policy)] and alone[0].sha256 == who[0].sha256


# -- What is measured --------------------------------------------------------------------------------------------------


@pytest.fixture
def calls(monkeypatch):
    """Arguments of `trainers.evaluate` and `trainers.evaluate_transition`, which measure nothing."""
    found = []

    def evaluate(*arguments, **kwargs):
        found.append((arguments, kwargs))
        record = trainers.EpisodeRecord(0, ((0.0, 0.0, 0.0),), 1.0, False, 0.1, 0.0, (0.0, 0.0, 0.0, 0.0), True)
        return trainers.ClosedLoopResult("trot", 1.0, (record,))

    for name in ("evaluate", "evaluate_transition"):
        monkeypatch.setattr(trainers, name, evaluate)
    return found


def test_commanded_episodes_are_passed_on(calls, monkeypatch):
    monkeypatch.setattr(
        student_commanded, "with_correction", lambda who, correction: f"{who} corrected by {correction}"
    )
    config = student_commanded.CommandedConfig()
    for what in config.parts("walk", ("walk",)):
        assert student_commanded.commanded("expert", "walk", what, config, 7, kp=40.0)["succeeded"] == 1
    expected = [("expert", 100), ("expert", 20), ("expert", 20), ("expert corrected by 0.5", 20)]
    assert [arguments for arguments, _ in calls] == [(who, "walk", n, 30.0, 7) for who, n in expected]
    corners = [kwargs.pop("corners") for _, kwargs in calls]
    assert corners == [False, True, False, False]
    assert all(kwargs == {"command_interval": 5.0, "kp": 40.0} for _, kwargs in calls)


def test_ablation_walks_in_two_worlds_and_changes_gait(calls):
    config = student_ablation.AblationConfig()
    parts = config.parts("walk", ("trot", "walk", "jump"))
    assert parts == ("drawn", "changed world", "trot", "jump")
    for what in parts[:3]:
        student_ablation.ablation("policy", "walk", what, config, 7)
    changed = {"friction": 0.7, "payload_kg": 1.5, "action_delay_s": 0.01, "joint_friction": 0.5}
    assert calls == [
        (("policy", "walk", 20, 20.0, 7), {"command_interval": 5.0}),
        (("policy", "walk", 5, 20.0, 7), {"command_interval": 5.0} | changed),
        (("policy", "walk", "trot", 3, 7), {"before_s": 2.0, "after_s": 6.0}),
    ]


# -- The run -----------------------------------------------------------------------------------------------------------


def run(folder, *arguments):
    folders = ["--parts", str(folder / "parts"), "--out-dir", str(folder / "out")]
    return report_student.main([*arguments, "--quick", "--n-jobs", "1", *folders])


@pytest.mark.slow
def test_a_quick_run_makes_its_students_once(tmp_path, monkeypatch):
    monkeypatch.setitem(dagger_config.PRESETS, "smoke", TINY)
    monkeypatch.setattr(student_classes, "QUICK_VARIANTS", ("default, reduced", "no round"))
    arguments = ("commanded", "ablation", "--seeds", "1", "--tasks", "trot", "walk")
    assert run(tmp_path, *arguments) == 0
    commanded, ablation = (
        json.loads((tmp_path / "out" / f"student_{name}.json").read_text()) for name in ("commanded", "ablation")
    )
    assert list(commanded["report"]) == ["seed 1", "seed 1 without a clock", "expert"]
    own = commanded["report"]["seed 1"]["walk"]["drawn"]
    assert own["trials"] == 2 and set(own["passed"]) == set(commanded["bars"]) == set(student_classes.BARS)
    assert set(commanded["report"]["seed 1 without a clock"]["walk"]) == {"phase_free", "clock with correction"}
    assert commanded["report"]["expert"]["trot"]["corners"]["survived"] == 1
    assert commanded["seconds"]["students"] > 0.0 and len(commanded["policies"]) == 2
    assert list(ablation["report"]) == list(ablation["lessons"]) == ["default, reduced", "no round"]
    assert set(ablation["report"]["no round"]["walk"]) == {"drawn", "changed world", "trot", "held_out"}
    assert ablation["lessons"]["no round"]["rounds"] == 0
    page = "\n".join(publish_results.student_report(tmp_path / "out"))
    assert "### One change each" in page and "](student_commanded.png)" in page
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").rglob("*") if path.is_file()}
    assert run(tmp_path, *arguments) == 0
    assert kept == {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["commanded", "--policy", "a.zip"], "make their own"),
        (["robustness", "ablation"], "expected for robustness"),
        (["commanded", "--seeds", "-1"], "training seed"),
        (["commanded", "--seeds", "1", "1"], "twice"),
        (["ablation", "--tasks", "pronk"], "task"),
        (["ablation", "--only", "corners"], "part"),
    ],
)
def test_impossible_settings_are_refused_before_anybody_is_taught(arguments, reason, tmp_path, capsys):
    assert run(tmp_path, *arguments) == 2
    assert reason in capsys.readouterr().err and not list(tmp_path.iterdir())
