"""Publishing: what is copied, what is written, and what is said when something is missing."""

import json
import sys
from pathlib import Path

import pytest

from go1_mtl_gym.errors import InvalidInputError

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

import publish_results as publish  # noqa: E402
from gait_report.page import new_gaits_table  # noqa: E402
from publishing import runs  # noqa: E402

from tests.test_new_gaits_page import DATA as NEW_GAITS  # noqa: E402
from tests.test_paper_page import student, table_of  # noqa: E402

CLOSED = {
    "survival_rate": 1.0,
    "survival_s": 20.0,
    "velocity_error": 0.031,
    "yaw_rate_error": 0.051,
    "step_rate": 2.5,
    "success_rate": 0.95,
    "success_interval": [0.76, 0.99],
}
STUDENT = CLOSED | {"mse": 0.0012, "mae": 0.012, "r2": 0.98765, "r2_joint_mean": 0.97, "episodes": 20}
METRICS = {
    "tasks": {"trot": {"expert": CLOSED | {"episodes": 20}, "multi_head": STUDENT}},
    "config": {"preset": "default", "rounds": 2},
    "seed": 3,
    "versions": {"mujoco": "9.9.9", "torch": "8.8.8"},
    "seconds": {"demonstrations": 61.0, "clone": 120.0},
    "command": "python examples/dagger.py --out /home/somebody/run --seed 3",
}
EXPERT = {
    "tasks": {"trot": CLOSED | {"task": "trot", "seconds": 30.0, "episodes": [{}] * 20}},
    "config": {"episodes": 20, "episode_s": 30.0, "control_hz": 50},
    "seed": 1,
    "versions": {},
    "seconds": {"evaluation": 240.0},
    "command": "python examples/report_expert.py --parts /home/somebody/parts",
}
BEGIN, END = "<!-- gaits:begin -->", "<!-- gaits:end -->"
README = "\n".join(
    f"text before {name}\n<!-- {name}:begin -->\nold {name}\n<!-- {name}:end -->"
    for name in ("results", "gaits", "expert", "paper", "presets", "student", "new_gaits")
)


@pytest.fixture
def run(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "metrics.json").write_text(json.dumps(METRICS))
    (folder / "joint_targets.png").write_bytes(b"png")
    (folder / "gaits.gif").write_bytes(b"gif")
    (folder / "policy.zip").write_bytes(b"student")
    (folder / "phase_free.zip").write_bytes(b"without a clock")
    return folder


@pytest.fixture
def root(tmp_path):
    folder = tmp_path / "root"
    folder.mkdir()
    (folder / "README.md").write_text(README + "\ntext after\n", encoding="utf-8")
    return folder


def test_a_run_becomes_the_page_and_the_blocks(run, root):
    assert publish.main([str(run)], root) == 0
    results = root / "docs" / "results"
    assert sorted(path.name for path in results.iterdir()) == [
        "README.md", "gaits.gif", "joint_targets.png", "metrics.json",
    ]  # fmt: skip
    assert (results / "gaits.gif").read_bytes() == b"gif"
    students = {path.name: path.read_bytes() for path in (root / "trainers" / "assets").iterdir()}
    assert students == {"clocked.zip": b"student", "phase_free.zip": b"without a clock"}
    page, readme = (path.read_text(encoding="utf-8") for path in (results / "README.md", root / "README.md"))
    for text in (page, readme):
        assert "| trot | multi-head student | 0.001200 | 0.0120 | 0.9877 | 19/20 | 20/20 | 0.031 | 2.50 |" in text
        assert "Made by `python examples/dagger.py --seed 3`, seed 3, in 3 min of wall time." in text
    assert "| trot | 0.9877 | - | 0.9195 | 0.7701 | simulation |" in page
    assert "9.9.9" in page and "| clone | 120 |" in page and "settings differ" in page
    assert "old results" not in readme and "old gaits" not in readme
    assert all(f"old {name}" in readme for name in ("expert", "paper", "student", "new_gaits")), "nothing known yet"
    assert all(f"text before {name}" in readme for name in ("results", "expert")) and readme.endswith("text after\n")


def test_no_path_of_the_machine_is_published(run, root):
    publish.main([str(run)], root)
    for path in (root / "docs" / "results").glob("*.*"):
        assert b"somebody" not in path.read_bytes()
    assert json.loads((root / "docs" / "results" / "metrics.json").read_text()) == METRICS | {
        "command": "python examples/dagger.py --seed 3"
    }


def test_the_experts_numbers_come_from_its_file(run, root):
    publish.main([str(run)], root)
    (root / "docs" / "results" / "expert.json").write_text(json.dumps(EXPERT))
    assert publish.main([], root) == 0
    for path in (root / "README.md", root / "docs" / "results" / "README.md"):
        text = path.read_text(encoding="utf-8")
        assert "| trot | 19/20 | 20/20 | 0.031 | 0.051 | 2.50 |" in text
        assert "20 drawn commands x 30 s per gait at 50 Hz" in text


def test_the_report_card_takes_the_scores_place_once_it_is_there(run, root):
    publish.main([str(run)], root)
    results = root / "docs" / "results"
    kicks = {"trot": {"left": 1.7, "right": 1.6, "lateral": 1.6}}
    counts = ("calls", "bad_actions", "unhandled", "solver_failures", "inexact_solves", "bad_states")
    totals = dict.fromkeys(counts, 3) | {"wanted": 1000000, "passed": False}
    (results / "expert.json").write_text(json.dumps(EXPERT | {"report": {"pushes": kicks}, "totals": totals}))
    (results / "expert_pushes.png").write_bytes(b"png")
    assert publish.main([], root) == 0
    page, readme = (path.read_text(encoding="utf-8") for path in (results / "README.md", root / "README.md"))
    for text in (page, readme):
        assert "| trot | 19/20 | 0.031 (> 0.03) | -, - | - | - | 1.6 | - | - | - | - |" in text
        assert "Made by `python examples/report_expert.py`, seed 1, in 4 min on one core." in text
    assert "| trot | 1.7 | 1.6 | - | - |" in page and "](expert_pushes.png)" in page
    assert "](expert_limits.png)" not in page and "3 control steps" in page
    assert publish.main(["--check"], root) == 0


def test_benchmarks_new_gaits_and_the_papers_tables_stand_on_the_page_once_they_are_there(run, root):
    publish.main([str(run)], root)
    results = root / "docs" / "results"
    titles = ("## Training against others", "## New gaits for a trained policy", "](paper.md)")
    page = (results / "README.md").read_text(encoding="utf-8")
    assert not any(title in page for title in titles)
    rate = {"samples_per_s": {"median": 200.0, "low": 190.0, "high": 210.0}}
    rows = [{"setting": "here", "contestant": "ours", "figures": rate, "over": {}}]
    benchmark = {
        "sections": {"step": {"meaning": "steps", "rows": rows}},
        "command": "python b.py --out /home/me/b.json",
    }
    (results / "benchmark_training.json").write_text(json.dumps(benchmark))
    made = {"command": "python examples/new_gaits.py", "seed": 2, "seconds": {"new_gaits": 600.0}}
    (results / "new_gaits.json").write_text(json.dumps(NEW_GAITS | made))
    (results / "paper.md").write_text("the paper's tables")
    (results / "paper.json").write_text(json.dumps({"tables": {"simulation": table_of(student(r2=0.9876))}}))
    assert publish.main([], root) == 0
    page, readme = (path.read_text(encoding="utf-8") for path in (results / "README.md", root / "README.md"))
    assert "| 0.9195 | 0.7701 | 512, 100, bfloat16 | 0.9876 | - | - |" in readme
    assert new_gaits_table(NEW_GAITS) in readme and "Made by `python examples/new_gaits.py`, seed 2" in readme
    assert all(title in page for title in titles)
    assert "| here | ours | 200 |" in page and "Made by `python b.py`." in page
    assert "Made by `python examples/new_gaits.py`, seed 2, in 10 min on one core." in page


def test_the_students_of_several_seeds_stand_in_the_readme(run, root):
    figures = {"trials": 10, "succeeded": 9, "success_rate": 0.9, "velocity_error": 0.03, "error_ratio": 1.0}
    found = {name: {"trot": {"drawn": figures}} for name in ("seed 0", "seed 1", "expert")}
    report = {"section": "commanded", "report": found, "seed": 1, "seconds": {"students": 60.0, "commanded": 60.0}}
    command = "python examples/report_student.py commanded --out-dir /home/somebody"
    results = root / "docs" / "results"
    results.mkdir(parents=True)
    (results / "student_commanded.json").write_text(json.dumps(report | {"command": command}))
    assert publish.main([str(run)], root) == 0
    readme = (root / "README.md").read_text(encoding="utf-8")
    block = readme.partition("<!-- student:begin -->")[2].partition("<!-- student:end -->")[0]
    assert "| trot | **18/20** |" in block and "0.030" in block
    assert "Made by `python examples/report_student.py commanded`, seed 1, in 2 min on one core." in block


def test_publishing_twice_changes_nothing(run, root, capsys):
    publish.main([str(run)], root)
    before = (root / "README.md").read_text(encoding="utf-8")
    assert publish.main([], root) == 0 and "nothing to change" in capsys.readouterr().out
    assert (root / "README.md").read_text(encoding="utf-8") == before
    assert publish.main(["--check"], root) == 0


def test_check_writes_nothing(root, capsys):
    before = (root / "README.md").read_text(encoding="utf-8")
    assert publish.main(["--check"], root) == 1
    assert "out of date: README.md" in capsys.readouterr().out
    assert (root / "README.md").read_text(encoding="utf-8") == before


@pytest.mark.parametrize("name", ["metrics.json", "joint_targets.png", "gaits.gif", "policy.zip", "phase_free.zip"])
def test_a_missing_file_is_named(run, root, name, capsys):
    (run / name).unlink()
    assert publish.main([str(run)], root) == 2
    error = capsys.readouterr().err
    assert name in error and str(run) in error and ("OpenGL" in error) == (name == "gaits.gif")
    assert not (root / "docs").exists() and not (root / "trainers").exists()


@pytest.mark.parametrize("config", [{"preset": "smoke"}, {"preset": "paper"}, {}])
def test_a_run_of_another_preset_is_refused(run, root, config, capsys):
    (run / "metrics.json").write_text(json.dumps(METRICS | {"config": config}))
    assert publish.main([str(run)], root) == 2
    assert f"'default' was expected, {run} is one of {config.get('preset')!r}" in capsys.readouterr().err
    assert not (root / "docs").exists() and not (root / "trainers").exists()


def test_damaged_metrics_are_refused(run, root, capsys):
    for text, message in (("{", "not JSON"), ("[]", "JSON object"), ("{}", "at least one task")):
        (run / "metrics.json").write_text(text)
        assert publish.main([str(run)], root) == 2
        assert message in capsys.readouterr().err
    assert not (root / "docs").exists()


@pytest.mark.parametrize("text", ["", BEGIN, END + BEGIN, 2 * (BEGIN + END), BEGIN + END + END])
def test_missing_markers_are_named(text):
    with pytest.raises(InvalidInputError, match="<!-- gaits:begin -->"):
        publish.rewrite(text, {"gaits": "new"})


def test_a_missing_readme_is_an_error(tmp_path, capsys):
    assert publish.main([], tmp_path) == 2
    assert "README.md" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "shown"),
    [
        ("", ""),
        (" --seed 1 --out '/a b/c' --rounds 2", " --seed 1 --rounds 2"),
        (" --out=/a", ""),
        (" --out", ""),
        (" --parts /a --quick --parts=/b", " --quick"),
    ],
)
def test_the_output_folder_is_cut_from_a_command(options, shown):
    assert runs.without_out("python examples/dagger.py" + options) == "python examples/dagger.py" + shown


def test_gaits_and_presets_come_from_the_code():
    assert (
        "| walk | `Go1Walk-v0` | 0.60 | 0.78 | 0.25 0.75 0 0.5 | 1.67 | ± 0.5 | ± 0.3 | ± 0.5 |"
        in publish.gaits_block()
    )
    presets = publish.presets_block()
    assert "| units per hidden layer | 256 | 64 | 2560 |" in presets
    assert "| per gait and round [s] | 60 | 2 | - |" in presets


def test_what_is_committed_is_up_to_date(capsys):
    assert publish.main(["--check"]) == 0, capsys.readouterr().out + "run examples/publish_results.py"
