"""Table and picture of new gaits, by hand."""

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

from gait_report import page as gait_page  # noqa: E402
from gait_report.methods import FROZEN, SCRATCH, TUNED  # noqa: E402


def figures(succeeded, survived, r2, error=0.1, **more):
    """Of one student over 20 episodes."""
    counts = {"trials": 20, "succeeded": succeeded, "survived": survived}
    return counts | {"r2": r2, "velocity_error": error} | more


def changes(largest):
    return {"rows": 10, "equal": largest == 0.0, "largest_rad": largest}


def levels(*budgets):
    return [
        {"seconds": 15.0 * 2**i, "seeds": {str(seed): own for seed, own in enumerate(seeds)}}
        for i, seeds in enumerate(budgets)
    ]


OLD = {"trot": {"trials": 5, "succeeded": 5}, "walk": {"trials": 5, "succeeded": 3}}
DATA = {
    "report": {
        "pace": {
            FROZEN: levels(
                [figures(0, 10, 0.9, changes=changes(0.0)), figures(4, 20, 0.8, changes=changes(0.0))],
                [figures(20, 20, 0.99, 0.02, changes=changes(0.0)), figures(19, 20, 0.97, 0.04, changes=changes(0.0))],
            ),
            TUNED: levels(
                [figures(5, 20, 0.9, changes=changes(0.01), old=OLD)],
                [figures(9, 20, 0.95, None, changes=changes(0.052), old=OLD)],
            ),
            SCRATCH: levels([figures(0, 20, 0.5)], [figures(0, 19, 0.9)]),
        }
    },
    "expert": {"pace": {"trials": 20, "succeeded": 19}},
    "before": {"trot": {"trials": 5, "succeeded": 5}, "walk": {"trials": 5, "succeeded": 4}},
}


def test_seeds_are_summed_and_missing_errors_left_out():
    sums = gait_page.level_sums(DATA["report"]["pace"][FROZEN][0])
    assert (sums["trials"], sums["survived"], sums["succeeded"], sums["seconds"]) == (40, 30, 4, 15.0)
    assert (sums["survival_rate"], sums["success_rate"]) == (0.75, 0.1)
    low, high = sums["survival_interval"]
    assert low == pytest.approx(0.598, abs=1e-3) and high == pytest.approx(0.858, abs=1e-3)  # Wilson, 30 of 40
    assert sums["r2"] == pytest.approx(0.85)
    mixed = levels([figures(0, 0, 0.1, None), figures(0, 20, 0.1, 0.3)])[0]
    assert gait_page.level_sums(mixed)["velocity_error"] == 0.3
    assert gait_page.level_sums(levels([figures(0, 0, 0.1, None)])[0])["velocity_error"] is None


@pytest.mark.parametrize(
    ("survived", "expected"),
    [((0, 20, 20), 30.0), ((20, 20, 20), 15.0), ((20, 19, 20), 60.0), ((20, 20, 19), None)],
)
def test_enough_is_where_survival_begins_to_last(survived, expected):
    sums = [gait_page.level_sums(level) for level in levels(*([figures(0, n, 0.5)] for n in survived))]
    assert gait_page.enough(sums) == expected


def test_the_table_row_by_row():
    table, references = gait_page.new_gaits_table(DATA).split("\n\n")
    lines = table.splitlines()
    assert lines[0] == "| gait | learned | 15 s | 30 s | all survive from | velocity error [m/s] | old gaits |"
    assert lines[2] == (f"| pace | {FROZEN} | 10% (75%) 0.8500 | 98% (100%) 0.9800 | 30 s | 0.030 | equal to the bit |")
    assert lines[3] == (
        f"| pace | {TUNED} | 25% (100%) 0.9000 | 45% (100%) 0.9500 | 15 s | - | 8/10, changed by up to 0.052 rad |"
    )
    assert lines[4] == f"| pace | {SCRATCH} | 0% (100%) 0.5000 | 0% (95%) 0.9000 | - | 0.100 | - |"
    assert "19/20 of pace" in references and "9/10 of its own gaits" in references


def test_one_bit_in_any_student_is_a_change():
    own = levels([figures(20, 20, 0.9, changes=changes(0.0))], [figures(20, 20, 0.9, changes=changes(1e-7))])
    assert gait_page.old_cell(own) == "changed by up to 1e-07 rad"
    assert gait_page.old_cell(own[:1]) == "equal to the bit"


def test_the_picture_shows_survival_success_and_what_is_left_to_explain():
    shares, errors = gait_page.new_gaits_figure(DATA).axes
    np.testing.assert_allclose(
        [line.get_ydata() for line in shares.lines],
        [[0.75, 1.0], [0.1, 0.975], [1.0, 1.0], [0.25, 0.45], [1.0, 0.95], [0.0, 0.0]],
    )
    assert [line.get_linestyle() for line in shares.lines[:2]] == ["-", "--"]
    np.testing.assert_allclose(errors.lines[0].get_ydata(), [0.15, 0.02])
    np.testing.assert_allclose(errors.lines[1].get_ydata(), [0.1, 0.2])
    assert len({line.get_color() for line in shares.lines}) == 3
    assert shares.get_xscale() == errors.get_xscale() == errors.get_yscale() == "log"
    assert shares.get_title(loc="left") == "pace"


def test_every_gait_has_its_row_of_panels():
    data = DATA | {"report": {"pace": DATA["report"]["pace"], "gallop": DATA["report"]["pace"]}}
    axes = gait_page.new_gaits_figure(data).axes
    assert [ax.get_title(loc="left") for ax in axes] == ["pace", "", "gallop", ""]


def test_the_section_holds_the_table_and_the_picture_that_is_there():
    with_picture = gait_page.new_gaits_section(DATA, "Made by hand.", True)
    without = gait_page.new_gaits_section(DATA, "Made by hand.", False)
    assert with_picture[:-1] == without and with_picture[-1].endswith("(new_gaits.png)")
    assert without[1] == gait_page.new_gaits_table(DATA) and without[2].endswith("Made by hand.")
