"""Lessons in new gaits: what is demonstrated, rehearsed and changed, who is refused, and a tiny run of each method."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import trainers
from go1_mtl_gym import InvalidInputError
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.robot import HOME_POSE

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

import new_gaits  # noqa: E402
from gait_report import config as gait_config  # noqa: E402
from gait_report import methods as gait_methods  # noqa: E402
from gait_report import parts as gait_parts  # noqa: E402
from gait_report.methods import ASSISTED, FROZEN, SCRATCH, TUNED  # noqa: E402
from main_job.students import new_policy  # noqa: E402
from student_report.lab import Walker  # noqa: E402

TINY = dataclasses.replace(
    gait_config.QUICK,
    job=dataclasses.replace(
        gait_config.QUICK.job, width=16, shard_s=1.0, held_out_s=1.0, clone_steps=5, episode_s=0.5, batch_size=32
    ),
    seconds=(1.0, 2.0),
    rehearsal_s=1.0,
)


@pytest.fixture(scope="module")
def base(tmp_path_factory) -> Walker:
    """A small untrained policy of two gaits, which stands still."""
    job = dataclasses.replace(TINY.job, tasks=("trot", "walk"))
    path = tmp_path_factory.mktemp("base") / "base.zip"
    policy, home = new_policy(job, job.env_kwargs), ActionMap.for_gains(PDGains(job.kp, job.kd)).from_radians(HOME_POSE)
    policy.act_normalizer.set(home, np.full(12, 0.1))
    policy.save(path)
    return Walker.student("base", path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Of demonstrations and students that the tests share."""
    return tmp_path_factory.mktemp("lessons")


def lesson(base: Walker, method: str, folder: Path, seed: int = 0) -> gait_methods.Lesson:
    return gait_methods.Lesson(base, "pace", method, 1.0, seed, TINY, folder)


# -- Settings and demonstrations ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "settings",
    [
        {"seconds": ()},
        {"seconds": (30.0, 15.0)},
        {"seconds": (15.0, 15.0)},
        {"seconds": (0.0, 15.0)},
        {"seconds": (10.0, 15.0)},
        {"seeds": ()},
        {"seeds": (1, 1)},
        {"rehearsal_s": 0.0},
        {"tuning_rate": 0.0},
        {"old_episodes": 0},
    ],
)
def test_impossible_settings_are_refused(settings):
    with pytest.raises(InvalidInputError):
        gait_config.NewGaitsConfig(**settings)


def test_a_minute_is_ten_clean_seconds_and_fifty_disturbed_ones(base):
    config = gait_config.NewGaitsConfig()
    jobs = gait_config.demonstrations(config.job_of(base.load(), ("pace",), 1), 60.0)
    clean = [job for job in jobs if job.perturbation is None]
    disturbed = [job for job in jobs if job.perturbation is not None]
    assert [job.seconds for job in clean] == [2.5] * 4 and [job.seconds for job in disturbed] == [12.5] * 4
    for job in disturbed:
        assert job.perturbation.noise_rad == 0.06 and job.perturbation.command_interval == (1.5, 4.0)
        assert job.perturbation.task_interval is None and job.env_kwargs["randomization"].fraction == 0.3
    assert not any("randomization" in job.env_kwargs for job in clean)
    assert {job.task for job in jobs} == {"pace"} and all(job.env_kwargs["tasks"] == ("pace",) for job in jobs)


def test_fewer_seconds_are_the_first_of_more_and_seeds_share_nothing(base):
    config = gait_config.NewGaitsConfig()
    jobs = {seed: config.job_of(base.load(), ("gallop",), seed) for seed in config.seeds}
    small, large = (gait_config.demonstrations(jobs[0], seconds) for seconds in (15.0, 240.0))
    assert len(small) == 2 and len(large) == 32 and all(job in large for job in small)
    names = [job.name for own in jobs.values() for job in gait_config.demonstrations(own, 240.0)]
    names += [job.name for job in gait_config.held_out(jobs[0])]
    assert len(set(names)) == len(names) == 3 * 32 + 4
    assert sum(job.seconds for job in gait_config.held_out(jobs[0])) == 60.0


def test_without_a_disturbed_share_all_is_clean():
    job = dataclasses.replace(TINY.job, tasks=("pace",), clean_s=5.0, perturbed_s=0.0)
    jobs = gait_config.demonstrations(job, 3.0)
    assert [(own.seconds, own.perturbation) for own in jobs] == [(1.0, None)] * 3


def test_the_job_sees_what_the_policy_sees_and_has_its_network(base):
    policy = base.load()
    policy.env_kwargs |= {"channels": ("command", "gravity", "phase"), "control_hz": 100, "kp": 40.0}
    job = gait_config.NewGaitsConfig().job_of(policy, ("pace",), 7)
    assert (job.channels, job.control_hz, job.kp, job.width) == (("command", "gravity", "phase"), 100, 40.0, 16)
    assert (job.tasks, job.seed) == (("pace",), 7)


# -- Old gaits ---------------------------------------------------------------------------------------------------------


def test_what_is_rehearsed_is_what_the_policy_does_and_is_made_once(base, folder):
    policy = base.load()
    rows = gait_methods.rehearsal(policy, TINY, folder)
    assert rows.tasks == ("trot", "walk") and set(rows.per_task()) == {"trot", "walk"} and rows.seconds == 2.0
    np.testing.assert_allclose(policy.predict(rows.obs, deterministic=True)[0], rows.acts, atol=1e-6)
    written = (folder / "rehearsal.npz").stat().st_mtime_ns
    again = gait_methods.rehearsal(policy, TINY, folder)
    assert (folder / "rehearsal.npz").stat().st_mtime_ns == written
    np.testing.assert_array_equal(again.obs, rows.obs)


def test_changes_are_measured_in_radians_and_to_the_bit(base, folder):
    policy, rows = base.load(), gait_methods.rehearsal(base.load(), TINY, folder)
    grown = policy.add_task("pace")
    assert gait_methods.changes(policy, grown, rows) == {"rows": 100, "equal": True, "largest_rad": 0.0}
    with torch.no_grad():
        grown.actor.heads[2][-1].bias += 1.0
    assert gait_methods.changes(policy, grown, rows)["equal"], "the new head is not asked in old gaits"
    with torch.no_grad():
        grown.actor.heads[1][-1].bias[4] += 0.01
    found = gait_methods.changes(policy, grown, rows)
    assert not found["equal"] and found["largest_rad"] == pytest.approx(0.01 * 0.1 * rows.half_range[4], rel=1e-3)


# -- Lessons -----------------------------------------------------------------------------------------------------------


def test_every_method_teaches_what_it_says(base, folder):
    before = base.load().state_dict()
    policies = {method: lesson(base, method, folder).policy() for method in (FROZEN, TUNED, SCRATCH)}
    for method in (FROZEN, TUNED):
        after = policies[method].state_dict()
        equal = all(torch.equal(after[name], value) for name, value in before.items() if name.startswith("actor"))
        assert equal == (method == FROZEN) and policies[method].env_kwargs["tasks"] == ("trot", "walk", "pace")
        assert torch.equal(after["obs_normalizer.shift"], before["obs_normalizer.shift"])
    heads = policies[FROZEN].actor.heads
    assert not any(torch.equal(heads[2][-1].weight, heads[k][-1].weight) for k in (0, 1)), "it has learned"
    first = [head[0].weight.detach() for head in heads]
    assert min((first[2] - first[k]).abs().max().item() for k in (0, 1)) < 0.05, "it began as a copy"
    assert policies[SCRATCH].env_kwargs["tasks"] == ("pace",) and len(policies[SCRATCH].actor.heads) == 1
    assert policies[SCRATCH].width == base.load().width


def test_a_lesson_is_measured_and_its_student_kept(base, folder):
    own = lesson(base, TUNED, folder)
    figures = own.measure(seed=1)
    assert {"survived", "succeeded", "survival_s", "step_rate", "r2", "velocity_error"} <= set(figures)
    assert figures["trials"] == 1 and figures["changes"]["rows"] == 100 and not figures["changes"]["equal"]
    assert set(figures["old"]) == {"trot", "walk"} and figures["old"]["walk"]["trials"] == 1
    students = {path: path.stat().st_mtime_ns for path in (folder / "students").iterdir()}
    assert own.measure(seed=1) == figures
    assert students == {path: path.stat().st_mtime_ns for path in (folder / "students").iterdir()}


def test_the_frozen_head_leaves_old_gaits_and_a_network_of_its_own_has_none(base, folder):
    frozen, scratch = (lesson(base, method, folder).measure(1) for method in (FROZEN, SCRATCH))
    assert frozen["changes"]["equal"] and "old" not in frozen
    assert not {"changes", "old"} & set(scratch)


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [(15.0, (15.0, 0.0)), (30.0, (15.0, 15.0)), (45.0, (15.0, 30.0)), (60.0, (30.0, 30.0)), (240.0, (120.0, 120.0))],
)
def test_half_of_the_labels_is_demonstrated_in_whole_shards(seconds, expected):
    assert gait_methods.halves(seconds, 15.0) == expected


def test_a_round_adds_as_many_labels_as_there_were_demonstrations(base, folder, monkeypatch):
    seen, taught = [], trainers.learn_task

    def watched(policy, dataset, *args, **kwargs):
        seen.append((len(dataset), policy.env_kwargs["tasks"]))
        return taught(policy, dataset, *args, **kwargs)

    monkeypatch.setattr(trainers, "learn_task", watched)
    own = gait_methods.Lesson(base, "pace", ASSISTED, 2.0, 0, TINY, folder)
    figures = own.measure(seed=1)
    assert seen == [(50, ("trot", "walk", "pace")), (100, ("trot", "walk", "pace"))]
    assert figures["changes"]["equal"] and "old" not in figures
    rows = trainers.Demonstrations.load(next((folder / "rounds").rglob("demonstrations.npz")))
    assert set(rows.per_task()) == {"pace"} and rows.seconds == 1.0 and rows.meta["beta"] == 0.0


def test_equal_seeds_teach_equal_students(base, folder, tmp_path):
    taught = [lesson(base, FROZEN, *where).policy() for where in ((folder,), (tmp_path,), (tmp_path, 1))]
    first, again, other = (own.actor.heads[2][0].weight for own in taught)
    assert torch.equal(first, again) and not torch.equal(first, other)


def test_the_expert_and_the_policy_before_are_measured_too(base):
    found = gait_methods.expert(base, "pace", TINY, 1)
    assert found["survived"] == found["trials"] == 1
    before = gait_methods.before(base, gait_parts.OLD, TINY, 1)
    assert list(before) == ["trot", "walk"] and before["trot"]["survival_s"] == 0.5


# -- Parts -------------------------------------------------------------------------------------------------------------


def test_all_parts_come_once_and_the_longest_lessons_first(base, tmp_path):
    parts = gait_parts.parts_of(base, ["pace", "gallop"], gait_config.NewGaitsConfig(), 1, tmp_path)
    assert len(parts) == 1 + 2 + 2 * 4 * 5 * 3 == len({part.path for part in parts})
    assert [part.method for part in parts[:3]] == ["before", "expert", "expert"]
    assert [part.seconds for part in parts[3:]] == sorted((part.seconds for part in parts[3:]), reverse=True)
    assert len({part.shared for part in parts}) == 1


def test_another_policy_or_setting_is_another_folder(base, tmp_path):
    part = gait_parts.parts_of(base, ["pace"], TINY, 1, tmp_path)[-1]
    other = dataclasses.replace(part, base=dataclasses.replace(base, sha256="0" * 64))
    longer = dataclasses.replace(part, section=dataclasses.replace(TINY, rehearsal_s=2.0))
    assert len({own.shared for own in (part, other, longer)}) == 3
    later = dataclasses.replace(part, seed=2)
    assert later.shared == part.shared and later.path != part.path, "students do not depend on the evaluation"


def test_finished_parts_are_read(base, tmp_path):
    part = gait_parts.parts_of(base, ["pace"], TINY, 1, tmp_path)[1]
    first = part.measure()
    assert first["task"] == "pace" and first["what"] == "expert" and first["figures"]["trials"] == 1
    assert json.loads(part.path.read_text()) == first == part.measure()


@pytest.mark.parametrize("gaits", [["trot"], ["crawl"], ["pace", "pace"]])
def test_gaits_must_be_new_known_and_different(base, tmp_path, gaits):
    with pytest.raises(InvalidInputError, match="gait"):
        gait_parts.parts_of(base, gaits, TINY, 1, tmp_path)


def test_policies_without_heads_or_with_memory_are_refused(tmp_path):
    job = dataclasses.replace(TINY.job, tasks=("trot", "walk"))
    frames = dataclasses.replace(job, history=2)
    new_policy(job, job.env_kwargs, pooled=True).save(tmp_path / "pooled.zip")
    new_policy(frames, frames.env_kwargs).save(tmp_path / "frames.zip")
    for path in (
        tmp_path / "pooled.zip",
        tmp_path / "frames.zip",
        trainers.policies.pretrained.FOLDER / "phase_free.zip",
    ):
        with pytest.raises(InvalidInputError, match="head per gait"):
            gait_parts.learnable(Walker.student("base", path))


def test_parts_are_put_in_order(base, tmp_path):
    parts = gait_parts.parts_of(base, ["pace"], TINY, 1, tmp_path)
    results = [{"figures": {"n": i}} for i in range(len(parts))]
    data = gait_parts.assembled(parts, results)
    assert data["before"] == {"n": 0} and data["expert"] == {"pace": {"n": 1}}
    assert list(data["report"]["pace"]) == [FROZEN, ASSISTED, TUNED, SCRATCH]
    assert data["report"]["pace"][SCRATCH] == [
        {"seconds": 1.0, "seeds": {"0": {"n": 9}}},
        {"seconds": 2.0, "seeds": {"0": {"n": 5}}},
    ]


# -- The command -------------------------------------------------------------------------------------------------------


IMPOSSIBLE = ["--gaits trot", "--gaits pace pace", "--gaits crawl", "--seed -1", "--n-jobs 0", "--policy nothing.zip"]


@pytest.mark.parametrize("arguments", IMPOSSIBLE)
def test_impossible_commands_are_refused(arguments, tmp_path, capsys):
    where = ["--out-dir", str(tmp_path / "out"), "--parts", str(tmp_path / "parts")]
    assert new_gaits.main([*arguments.split(), *where]) == 2
    assert "error: " in capsys.readouterr().err and not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_quick_run_writes_its_files_and_reads_what_is_there(tmp_path, capsys):
    where = ["--parts", str(tmp_path / "parts"), "--out-dir", str(tmp_path)]
    arguments = ["--quick", "--gaits", "pace", "--n-jobs", "1", *where]
    assert new_gaits.main(arguments) == 0
    data = json.loads((tmp_path / "new_gaits.json").read_text())
    assert list(data["report"]) == ["pace"] and data["seed"] == 1 and data["seconds"]["new_gaits"] > 0
    assert data["command"] == "python examples/new_gaits.py --quick --gaits pace --n-jobs 1"
    assert all(own["changes"]["equal"] for level in data["report"]["pace"][FROZEN] for own in level["seeds"].values())
    assert f"| pace | {SCRATCH} |" in capsys.readouterr().out and (tmp_path / "new_gaits.png").stat().st_size > 5000
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").rglob("*") if path.is_file()}
    assert new_gaits.main(arguments) == 0
    assert kept == {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").rglob("*") if path.is_file()}
