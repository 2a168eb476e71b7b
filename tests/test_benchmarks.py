"""The benchmark as a visitor runs it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from trainers.utils.report import benchmark_table

ROOT = Path(__file__).resolve().parents[1]


def benchmark(*arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, str(ROOT / "benchmarks" / "expert.py"), "--states", "15", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    out = tmp_path_factory.mktemp("benchmark") / "times.json"
    done = benchmark("--out", str(out))
    assert done.returncode == 0, done.stderr
    return done, out.read_text(encoding="utf-8"), out


def test_ours_is_timed_from_the_inside_out(result):
    done, text, out = result
    times = json.loads(text)["times_ms"]["ours, osqp"]
    assert 0 < times["qp"]["median"] < times["action"]["median"] < 100 and times["update"]["median"] > 0
    assert str(out.parent) not in text, "no path of the machine"
    assert "| ours, osqp |" in done.stdout and "| 1.00 |" in done.stdout


@pytest.mark.parametrize("name", ["piqp", "daqp"])
def test_exact_solvers_agree_or_are_named_as_missing(result, name):
    done, text, _ = result
    if f"ours, {name}" not in json.loads(text)["times_ms"]:
        assert f"{name} is left out" in done.stderr and f"pip install {name}" in done.stderr
        return
    assert all(error["largest"] < 2.0 for error in json.loads(text)["force_error_n"].values())


def test_a_folder_that_is_no_checkout_is_refused(tmp_path):
    done = benchmark("--go2-convex-mpc", str(tmp_path))
    assert done.returncode == 2 and "no checkout of go2-convex-mpc" in done.stderr


def test_a_checkout_that_cannot_be_imported_says_why(tmp_path):
    package = tmp_path / "src" / "python" / "convex_mpc"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    done = benchmark("--go2-convex-mpc", str(tmp_path))
    assert done.returncode == 2 and ("cannot be imported" in done.stderr or "numpy < 2.4" in done.stderr)


def test_the_table_has_a_row_per_scope_and_contestant():
    made_up = {
        "scopes": {"qp": "QP", "action": "action"},
        "times_ms": {"ours": {"qp": {"median": 0.5, "p99": 1.0}}, "other": {"qp": {"median": 1.0, "p99": 2.0}}},
        "ratio_to_ours": {"ours": {"qp": 1.0}, "other": {"qp": 2.0}},
    }
    assert benchmark_table(made_up).splitlines()[2:] == [
        "| QP | ours | 0.50 | 1.00 | 1.00 |",
        "| QP | other | 1.00 | 2.00 | 2.00 |",
    ]
