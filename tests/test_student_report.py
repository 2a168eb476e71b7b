"""The student's report: its parts, tables and figures by hand, and a quick run with a student that falls at once."""

import dataclasses
import json
import math
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

import trainers
from go1_mtl_gym import InvalidInputError
from go1_mtl_gym.env import Go1Env

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

import publish_results  # noqa: E402
import report_parts  # noqa: E402
import report_student  # noqa: E402
from student_report import figures as student_figures  # noqa: E402
from student_report import lab as student_lab  # noqa: E402
from student_report import page as student_page  # noqa: E402
from student_report import parts as student_parts  # noqa: E402
from student_report import pushes as student_pushes  # noqa: E402

GAITS = ("trot", "walk")


def level(survived, succeeded, value=1.0, trials=20):
    return {"value": value, "survived": survived, "succeeded": succeeded, "trials": trials}


def save_student(path, seed=0, **env_kwargs):
    """An untrained student of two gaits."""
    kwargs = {"tasks": GAITS, "channels": ("command",), **env_kwargs}
    env = Go1Env("trot", **kwargs)
    policy = trainers.MultiHeadPolicy(env.observation_space, env.action_space, width=8, env_kwargs=kwargs, seed=seed)
    policy.save(path)
    return path


@pytest.fixture(scope="module")
def student(tmp_path_factory):
    return save_student(tmp_path_factory.mktemp("student") / "policy.zip")


# -- Who walks ---------------------------------------------------------------------------------------------------------


def test_students_come_first_and_the_expert_walks_in_their_world(student):
    who = student_lab.walkers([f"mine={student}", str(student)])
    assert [walker.name for walker in who] == ["mine", "student", "expert"]
    assert who[-1].env_kwargs == {"tasks": GAITS} and who[-1].load() == "expert"
    assert who[0].sha256 == who[1].sha256 and len(who[0].sha256) == 64 and not who[-1].sha256
    assert isinstance(who[0].load(), trainers.MultiHeadPolicy)


def test_a_student_leaves_the_world_of_its_training(tmp_path):
    path = save_student(tmp_path / "policy.zip", noise=True, friction=0.5, history=2)
    policy = student_lab.walkers([str(path)])[0].load()
    assert policy.env_kwargs == {"tasks": GAITS, "channels": ("command",), "history": 2}


@pytest.mark.parametrize("names", [["", ""], ["expert="], ["="], ["a=", "a="]])
def test_names_that_say_nothing_are_refused(student, names):
    with pytest.raises(InvalidInputError, match="another name"):
        student_lab.walkers([name + str(student) for name in names])


def test_students_of_different_worlds_are_not_compared(student, tmp_path):
    other = save_student(tmp_path / "policy.zip", control_hz=100)
    with pytest.raises(InvalidInputError, match="control_hz"):
        student_lab.walkers([f"a={student}", f"b={other}"])


# -- Parts -------------------------------------------------------------------------------------------------------------


def test_a_part_has_another_name_when_anything_else_is_measured(student, tmp_path):
    mine, expert = student_lab.walkers([f"mine={student}"])
    section = student_parts.SECTIONS["pushes"]
    part = student_parts.StudentPart("pushes", section, mine, "trot", "left", 1, tmp_path)
    changes = (
        {"seed": 2},
        {"what": "right"},
        {"task": "walk"},
        {"walker": expert},
        {"walker": dataclasses.replace(expert, env_kwargs={"tasks": GAITS, "kp": 40.0})},
        {"walker": dataclasses.replace(mine, sha256="0" * 64)},
        {"section": dataclasses.replace(section, config=section.quick)},
    )
    assert len({part.path, *(dataclasses.replace(part, **change).path for change in changes)}) == 8
    renamed = dataclasses.replace(part, walker=dataclasses.replace(mine, name="other"))
    assert part.path == renamed.path == pickle.loads(pickle.dumps(part)).path


def test_a_finished_part_is_not_measured_again(tmp_path):
    calls = []
    for _ in range(2):
        part = report_parts.finished(tmp_path / "p.json", lambda: calls.append(1) or {"figures": {"a": math.nan}})
        assert part["figures"] == {"a": None} and part["seconds"] >= 0.0
    assert calls == [1]


# -- Tables and figures ------------------------------------------------------------------------------------------------

ROBUST = {
    "mine": {
        "trot": {"friction": {"levels": [level(3, 1, 0.4), level(19, 18, 0.7), level(20, 20, 1.0)]}},
        "walk": {"friction": {"levels": [level(20, 20, 0.4), level(18, 17, 0.7), level(20, 20, 1.0)]}},
    },
    "expert": {"trot": {"friction": {"levels": [level(20, 20, 0.4), level(20, 20, 0.7), level(20, 20, 1.0)]}}},
}
KICKS = {
    "mine": {"trot": {"left": {"largest": 1.2, "at_cap": False}, "right": {"largest": 0.8, "at_cap": False}}},
    "expert": {"trot": {"left": {"largest": 5.0, "at_cap": True}}},
}
SWITCHES = {
    "mine": {"trot": {"walk": level(20, 18)}, "walk": {"trot": level(10, 9)}},
    "expert": {"trot": {"walk": level(20, 20)}, "walk": {"trot": level(20, 19)}},
}


def test_the_middle_of_a_range_is_held_against_95_per_cent():
    table = student_page.robustness_table(ROBUST).splitlines()
    assert table[0] == "|  | quantity | middle | trot | walk |"
    assert table[2:] == ["| mine | friction | 0.7 | 19/20, **18/20** | **18/20**, **17/20** |"]


def test_kicks_and_switches_have_a_row_each():
    assert student_page.push_table(KICKS).splitlines()[2:] == [
        "| trot | mine | 1.2 | 0.8 | - | - |",
        "| trot | expert | >= 5.0 | - | - | - |",
    ]
    assert student_page.switching_table(SWITCHES).splitlines()[2:4] == [
        "| mine | trot | - | 18/20 | 20/20 |",
        "| mine | walk | 9/20 | - | 10/20 |",
    ]


def test_figures_show_the_weaker_direction_and_the_weakest_gait():
    figure = student_figures.push_figure(KICKS)
    lateral, fore_aft = figure.axes
    assert [bar.get_height() for bar in lateral.patches] == [0.8, 5.0]
    assert [text.get_text() for text in lateral.texts + fore_aft.texts] == ["0.8", "5.0", "", ""]
    pooled, weakest = student_figures.robustness_figure(ROBUST).axes[0].lines[:2]
    np.testing.assert_allclose(pooled.get_ydata(), [23 / 40, 37 / 40, 1.0])
    np.testing.assert_allclose(weakest.get_ydata(), [3 / 20, 18 / 20, 1.0])
    texts = [text.get_text() for text in student_figures.switching_figure(SWITCHES).axes[0].texts]
    assert texts == ["18/20", "9/20"]


def test_every_section_has_a_figure_and_a_chapter():
    assert set(student_parts.SECTIONS) == set(student_figures.FIGURES) == set(student_page.CHAPTERS)


# -- The run -----------------------------------------------------------------------------------------------------------


def run(folder, student, *more):
    arguments = ["--quick", "--n-jobs", "1", "--parts", str(folder / "parts"), "--out-dir", str(folder / "out")]
    return report_student.main(["robustness", "pushes", "--policy", f"mine={student}", *arguments, *more])


def test_a_quick_run_writes_one_file_and_figure_per_section_and_goes_on(student, tmp_path, monkeypatch, capsys):
    only = ["--tasks", "trot", "--only", "friction", "left"]
    measure = student_pushes.pushes

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setitem(
        student_parts.SECTIONS, "pushes", dataclasses.replace(student_parts.SECTIONS["pushes"], measure=interrupted)
    )
    assert run(tmp_path, student, *only) == 130
    assert (tmp_path / "out" / "student_robustness.json").is_file() and "goes on" in capsys.readouterr().err
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").iterdir()}
    assert len(kept) == 2
    monkeypatch.setitem(
        student_parts.SECTIONS, "pushes", dataclasses.replace(student_parts.SECTIONS["pushes"], measure=measure)
    )
    assert run(tmp_path, student, *only) == 0
    assert kept.items() <= {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").iterdir()}.items()
    data = json.loads((tmp_path / "out" / "student_robustness.json").read_text())
    assert list(data["report"]) == ["mine", "expert"]
    levels = data["report"]["mine"]["trot"]["friction"]["levels"]
    assert [own["value"] for own in levels] == [0.4, 0.7, 1.0]
    assert data["report"]["expert"]["trot"]["friction"]["levels"][1]["survived"] == 1
    assert data["seed"] == 1 and "mujoco" in data["versions"] and data["seconds"]["robustness"] > 0.0
    assert data["policies"] == {"mine": student_lab.walkers([str(student)])[0].sha256}
    assert str(tmp_path / "parts") not in data["command"] and data["command"].startswith("python examples/report_st")
    for name in ("robustness", "pushes"):
        assert (tmp_path / "out" / f"student_{name}.png").stat().st_size > 5000
    page = "\n".join(publish_results.student_report(tmp_path / "out"))
    assert "### Another world" in page and "### Kicks" in page and "](student_pushes.png)" in page
    assert "on one core" in page and "Changes of gait" not in page


@pytest.mark.parametrize(
    "option", ["--seed -1", "--n-jobs 0", "--tasks jump", "--only mud", "--only left", "--tasks trot trot"]
)
def test_impossible_settings_are_refused(option, student, tmp_path, capsys):
    assert run(tmp_path, student, *option.split()) == 2
    assert "error: " in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_a_missing_policy_is_named(tmp_path, capsys):
    assert run(tmp_path, tmp_path / "nothing.zip") == 2
    assert "nothing.zip" in capsys.readouterr().err
