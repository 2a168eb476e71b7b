"""Bars, tables and figures of the student's report over training seeds and variants, by hand."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

from student_report import classes as student_classes  # noqa: E402
from student_report import figures as student_figures  # noqa: E402
from student_report import page as student_page  # noqa: E402
from student_report import sums as student_sums  # noqa: E402


def figures(succeeded, trials, error=0.02, **more):
    rate = succeeded / trials
    return {"succeeded": succeeded, "trials": trials, "success_rate": rate, "velocity_error": error, **more}


def commanded_report():
    """Two seeds: the first passes in trot but for the ratio; the second keeps falling in walk."""
    found = {
        "seed 0": {
            "trot": {"drawn": figures(95, 100, 0.05), "corners": figures(18, 20)},
            "walk": {"drawn": figures(100, 100, 0.04), "corners": figures(20, 20)},
        },
        "seed 1": {
            "trot": {"drawn": figures(94, 100, 0.03), "corners": figures(20, 20)},
            "walk": {"drawn": figures(0, 100, None), "corners": figures(0, 20, None)},
        },
        "seed 1 without a clock": {"trot": {"phase_free": figures(7, 20), "clock with correction": figures(19, 20)}},
        "expert": {
            "trot": {"drawn": figures(100, 100, 0.02), "corners": figures(20, 20)},
            "walk": {"drawn": figures(100, 100, 0.02), "corners": figures(19, 20)},
        },
    }
    return student_classes.judged(found, {"seed 0": None, "seed 1": None})


def test_every_seed_and_gait_is_held_against_the_bars():
    found = commanded_report()
    first, second = (found[name]["trot"]["drawn"] for name in ("seed 0", "seed 1"))
    assert first["error_ratio"] == 2.5 and second["error_ratio"] == 1.5
    assert first["passed"] == {"success_rate": True, "velocity_error": True, "error_ratio": False}
    assert second["passed"] == {"success_rate": False, "velocity_error": True, "error_ratio": True}
    assert found["seed 0"]["walk"]["drawn"]["passed"] == dict.fromkeys(student_classes.BARS, True)
    assert found["seed 1"]["walk"]["drawn"]["passed"] == dict.fromkeys(student_classes.BARS, False)
    assert "passed" not in found["expert"]["trot"]["drawn"] and json.dumps(found)


def test_the_table_of_commands_pools_seeds_and_marks_misses():
    assert student_page.commanded_table(commanded_report()).splitlines()[2:] == [
        "| trot | **189/200** | 90.4% ... 96.9% | **94%** | 0.040 | 0.050 | 0.020 | **2.50** | 38/40 | 20/20 "
        "| 7/20 | 19/20 |",
        "| walk | **100/200** | 43.1% ... 56.9% | **0%** | 0.040 | **-** | 0.020 | **-** | 20/40 | 19/20 | - | - |",
    ]


def test_parts_that_were_not_measured_are_no_misses():
    found = {"seed 0": {"trot": {"corners": figures(18, 20)}}, "expert": {"trot": {"corners": figures(20, 20)}}}
    found = student_classes.judged(found, {"seed 0": None})
    row = student_page.commanded_table(found).splitlines()[2]
    assert row == "| trot | - | - | - | - | - | - | - | 18/20 | 20/20 | - | - |"
    assert student_figures.commanded_figure(found).axes[0].get_ylabel() == "success"


VARIANTS = {
    "default, reduced": {
        "trot": {"drawn": figures(20, 20, 0.02), "walk": figures(3, 3), "held_out": {"r2": 0.9}},
        "walk": {
            "drawn": figures(10, 20, 0.04),
            "changed world": figures(4, 5),
            "trot": figures(1, 3),
            "held_out": {"r2": 0.8},
        },
    },
    "kp 20": {"trot": {"drawn": figures(0, 20, None), "held_out": {"r2": 0.5}}},
}


def test_variants_are_summed_over_gaits():
    own = student_sums.variant_sums(VARIANTS["default, reduced"])
    assert own["gaits"] == {"trot": (20, 20), "walk": (10, 20)} and own["success"] == (30, 40)
    assert own["switching"] == (4, 6) and own["changed"] == (4, 5)
    assert own["error"] == pytest.approx(0.03) and own["r2"] == pytest.approx(0.85)
    assert student_page.ablation_table(VARIANTS).splitlines()[2:] == [
        "| default, reduced | 20/20 | 10/20 | 0.030 | 4/6 | 4/5 | 0.8500 |",
        "| kp 20 | 0/20 | - | - | - | - | 0.5000 |",
    ]


def test_figures_show_every_seed_and_variant():
    left, right = student_figures.commanded_figure(commanded_report()).axes
    dots = [line.get_ydata() for line in left.lines if line.get_label() == "each seed"]
    np.testing.assert_allclose(dots, [[0.95, 0.94], [1.0, 0.0]])
    assert [float(line.get_ydata()[0]) for line in right.lines if line.get_marker() == "D"] == [0.02, 0.02]
    axes = student_figures.ablation_figure(VARIANTS).axes
    np.testing.assert_allclose(axes[0].lines[0].get_xdata(), [0.75, 0.0])
    np.testing.assert_allclose(axes[2].lines[0].get_xdata(), [4 / 6, math.nan])
    assert [text.get_text() for text in axes[0].get_yticklabels()] == list(VARIANTS)
