"""Students without a clock: the phase asked for and its error by hand, what the variants see, and a quick run."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import trainers
from go1_mtl_gym import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout
from trainers.policies.phase_estimator import phase_distance
from trainers.policies.phase_free import phase_free_layout

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

import report_student  # noqa: E402
from main_job.students import new_policy  # noqa: E402
from student_report import lab as student_lab  # noqa: E402
from student_report import lessons_page as student_lessons_page  # noqa: E402
from student_report import parts as student_parts  # noqa: E402
from student_report import phase as student_phase  # noqa: E402
from student_report import phase_free as student_phase_free  # noqa: E402

TINY = dataclasses.replace(
    student_phase_free.QUICK,
    job=dataclasses.replace(
        student_phase_free.QUICK.job, tasks=("trot", "walk"), clean_s=1.0, perturbed_s=1.0, shard_s=1.0, clone_steps=3
    ),
    held_out_s=1.0,
)
TURNS = np.array([0.0, 0.1, 0.25, 0.7, 0.95])


def circle(turns):
    angle = 2 * np.pi * np.asarray(turns)
    return np.stack([np.sin(angle), np.cos(angle)], axis=1).astype(np.float32)


def rows_at(turns, layout):
    """Rows of these phases, zero but for the first task's id."""
    obs = np.zeros((len(turns), layout.size))
    obs[:, layout.slices["phase"]] = circle(turns)
    obs[:, layout.slices["task"].start] = 1.0
    starts = np.arange(len(turns)) == 0
    return trainers.Demonstrations(
        obs, np.zeros((len(turns), 12)), starts, layout.tasks, np.zeros(12), np.full(12, 0.5), 50.0
    )


def finished(**kwargs):
    """An untrained student without a clock."""
    student = new_policy(
        dataclasses.replace(TINY.job, width=8, history=1, **kwargs), TINY.job.env_kwargs | {"history": 1}
    )
    layout = phase_free_layout(student, student_phase_free.FRAMES)
    return trainers.PhaseFreePolicy(student, trainers.PhaseEstimator(layout, 8))


@pytest.fixture(scope="module")
def taught(tmp_path_factory):
    return student_phase_free.Lessons(TINY, tmp_path_factory.mktemp("phase_free"))


# -- Phase -------------------------------------------------------------------------------------------------------------


def test_the_distance_of_phases_goes_the_short_way_round():
    first, second = circle([0.0, 0.95, 0.1, 0.3]), circle([0.25, 0.05, 0.1, 0.8])
    np.testing.assert_allclose(phase_distance(first, second), [0.25, 0.1, 0.0, 0.5], atol=1e-6)


def test_the_error_is_that_of_the_estimate():
    rows = rows_at(TURNS, TINY.layout)
    late = student_phase.phase_error(lambda rows, have: circle(TURNS + [0, 0, 0, 0, 0.2]), rows, TINY.layout)
    assert late["median"] == pytest.approx(0.0, abs=1e-6) and late["p99"] == pytest.approx(0.96 * 0.2, abs=1e-6)


def test_the_phase_is_asked_for_as_two_joints_that_are_cut_off_later():
    job = dataclasses.replace(TINY.job, channels=student_phase_free.FELT)
    rows = rows_at(TURNS, TINY.layout)
    seen = rows.select(TINY.layout, ObservationLayout(job.tasks, job.channels, job.history))
    policy, asked = student_phase.ask_for_phase(new_policy(job, job.env_kwargs), seen, circle(TURNS))
    assert policy.action_space.shape == (14,) and asked.acts.shape == (5, 14)
    np.testing.assert_array_equal(asked.acts[:, 12:], circle(TURNS))
    np.testing.assert_array_equal(asked.half_range, [0.5] * 12 + [student_phase.PHASE_RAD] * 2)
    with torch.no_grad():
        for weight in policy.actor.parameters():
            weight.normal_(0.0, 0.2)
    policy.fit_normalization(asked.obs, asked.acts)
    small = student_phase.without_asked(policy)
    assert small.action_space.shape == (12,) and small.env_kwargs == policy.env_kwargs
    whole = policy.predict(seen.obs, deterministic=True)[0]
    np.testing.assert_allclose(small.predict(seen.obs, deterministic=True)[0], whole[:, :12], atol=1e-6)
    assert np.ptp(whole[:, :12]) > 0.0
    estimate = student_phase.asked_phase(policy)(rows, TINY.layout)
    np.testing.assert_allclose(np.linalg.norm(estimate, axis=1), 1.0, atol=1e-6)


def test_a_clock_without_memory_is_the_estimate_and_one_with_memory_starts_at_0():
    policy, rows = finished(), rows_at(TURNS, TINY.layout)
    seen = rows.select(TINY.layout, policy.estimator.layout)
    direct = student_phase.running_phase(policy)(rows, TINY.layout)
    np.testing.assert_allclose(direct, policy.estimator.estimate(seen.obs), atol=1e-5)
    slow = student_phase.with_correction(policy, 1e-6)
    turn = 1.0 / (50 * trainers.policies.phase_free.TASKS["trot"].gait.period)
    moving = dataclasses.replace(rows, obs=rows.obs + np.where(np.arange(TINY.layout.size) == 34, 0.3, 0.0))
    expected = circle(turn * np.arange(5))
    np.testing.assert_allclose(student_phase.running_phase(slow)(moving, TINY.layout), expected, atol=1e-4)


def test_another_correction_stays_in_the_world_that_was_chosen():
    policy = finished()
    policy.student.env_kwargs["noise"] = True
    other = student_phase.with_correction(policy, 0.2)
    assert other.correction == 0.2 and other.env_kwargs == policy.env_kwargs and "noise" not in other.env_kwargs


# -- Who learns from what ----------------------------------------------------------------------------------------------


def test_less_is_not_recorded_than_is_seen():
    for change in ({"history": 5}, {"channels": ("command", "phase")}):
        with pytest.raises(InvalidInputError, match=f"{student_phase_free.FRAMES} frames"):
            student_phase_free.PhaseFreeConfig(dataclasses.replace(TINY.job, **change))


def test_rows_are_the_main_jobs_and_held_out_ones_are_others():
    config = student_phase_free.PhaseFreeConfig()
    assert (len(config.training), len(config.held_out)) == (4 * (60 + 300) / 15, 4 * 30 / 15)
    clean, disturbed = config.training[:16], config.training[16:]
    assert all(job.perturbation is None and "randomization" not in job.env_kwargs for job in clean)
    for job in (*disturbed, *config.held_out):
        assert job.perturbation == config.job.disturbed(0.06) and job.env_kwargs["randomization"].fraction == 0.3
    assert all(job.env_kwargs["history"] == student_phase_free.FRAMES for job in config.training)
    assert not {job.seed for job in config.training} & {job.seed for job in config.held_out}


def test_variants_see_what_their_names_say(taught):
    sizes = {}
    for name in student_phase_free.VARIANTS:
        policy, estimate = taught.student(name)
        sizes[name] = policy.observation_space.shape[0] - 2
        assert policy.action_space.shape == (12,)
        assert (estimate is not None) == ("phase" in name or "stages" in name)
    assert list(sizes.values()) == [34, 49, 49 + 2 * 34, *[49 + 9 * 34] * 4, 51]
    corrections = [taught.student(name)[0].correction for name in sizes if name.startswith("two")]
    assert corrections == [1.0, 0.2]


def test_two_stages_are_the_clocks_student_and_an_estimator(taught):
    two, clock = taught.student("two stages")[0], taught.student("clock")[0]
    for name, value in clock.actor.state_dict().items():
        assert torch.equal(two.student.actor.state_dict()[name], value)
    assert len(list(taught.folder.glob("*.zip"))) <= len(student_phase_free.VARIANTS) - 1


def test_one_lesson_is_measured_alike_again(taught):
    def measure(name):
        return student_phase_free.phase_free(name, "all gaits", "taught here", TINY, 1, taught.folder)

    found = measure("two stages")
    assert found == measure("two stages") and 0.0 <= found["phase"]["median"] <= found["phase"]["p99"] <= 0.5
    assert set(found["tasks"]) == {"trot", "walk"} and found["switching"]["trials"] == 2
    assert found["walking"]["trials"] == found["noisy"]["trials"] == 2


def test_finished_students_are_measured_with_each_correction_and_others_refused(tmp_path):
    finished().save(tmp_path / "c.zip")
    new_policy(TINY.job, TINY.job.env_kwargs).save(tmp_path / "p.zip")
    section = dataclasses.replace(student_parts.SECTIONS["phase_free"], config=TINY)
    who = section.config.walkers(student_lab.walkers([f"own={tmp_path / 'c.zip'}"]))
    pairs = [("all gaits", what) for what in section.config.parts("all gaits", ())]
    parts = student_parts.parts_of("phase_free", section, who, pairs, 1, tmp_path)
    assert [(part.walker.name, part.what) for part in parts[-3:]] == [
        ("clock", "taught here"),
        ("own", "correction 1"),
        ("own", "correction 0.2"),
    ]
    assert len(parts) == len(student_phase_free.VARIANTS) + 2 == len({part.path for part in parts})
    with pytest.raises(InvalidInputError, match="MultiHeadPolicy"):
        section.config.walkers(student_lab.walkers([str(tmp_path / "p.zip")]))


# -- Table, figure and run ---------------------------------------------------------------------------------------------


def figures(succeeded, phase=None):
    own = {"succeeded": succeeded, "survived": 20, "trials": 20, "success_rate": succeeded / 20}
    own |= {"success_interval": trainers.evaluation.metrics.wilson_interval(succeeded, 20), "velocity_error": 0.05}
    return {"walking": own, "noisy": own, "switching": None, "tasks": {"trot": own}, "phase": phase}


REPORT = {
    "one frame": {"all gaits": {"taught here": figures(3)}},
    "own": {
        "all gaits": {
            "correction 1": figures(18, {"median": 0.01, "p99": 0.2}),
            "correction 0.2": figures(20, {"median": 0.0, "p99": 0.1}),
        }
    },
}


def test_the_table_has_a_row_per_student_and_correction():
    table = student_lessons_page.phase_free_table(REPORT).splitlines()
    assert table[2] == "| one frame | 3/20 | 20/20 | 0.050 | - | 3/20 | - |"
    assert table[3] == "| own, correction 1 | 18/20 | 20/20 | 0.050 | - | 18/20 | 0.010, 0.200 |"
    assert table[4].startswith("| own, correction 0.2 | 20/20 |")


def test_the_figure_shows_success_and_the_error_of_who_has_one():
    shares, errors = student_lessons_page.phase_free_figure(REPORT).axes
    dots = [line for line in shares.lines if line.get_marker() == "o"]
    assert list(dots[0].get_xdata()) == [0.15, 0.9, 1.0] and list(dots[0].get_ydata()) == [2.2, 1.2, 0.2]
    assert [list(line.get_xdata()) for line in errors.lines] == [[0.01, 0.2], [student_lessons_page.PHASE_FLOOR, 0.1]]


@pytest.mark.slow
def test_a_quick_run_measures_all_variants_and_a_finished_student(tmp_path, capsys):
    job = dataclasses.replace(student_phase_free.QUICK.job, history=1)
    student = new_policy(job, job.env_kwargs)
    path = tmp_path / "c.zip"
    trainers.PhaseFreePolicy(student, trainers.PhaseEstimator(phase_free_layout(student, 3), 8)).save(path)
    folders = ["--parts", str(tmp_path / "parts"), "--out-dir", str(tmp_path)]
    arguments = ["phase_free", "--quick", "--n-jobs", "2", *folders]
    assert report_student.main([*arguments, "--policy", f"own={path}"]) == 0
    data = json.loads((tmp_path / "student_phase_free.json").read_text())
    assert list(data["report"]) == [*student_phase_free.VARIANTS, "own"] and list(data["policies"]) == ["own"]
    assert list(data["report"]["own"]["all gaits"]) == ["correction 1", "correction 0.2"]
    assert data["report"]["clock"]["all gaits"]["taught here"]["phase"] is None
    assert "| own, correction 0.2 |" in capsys.readouterr().out
    assert (tmp_path / "student_phase_free.png").stat().st_size > 5000
