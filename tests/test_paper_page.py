"""The paper's tables: sums over seeds, verdicts, the page and the figures, by hand."""

import dataclasses
import math
import sys
from pathlib import Path

import numpy as np
import pytest

import trainers

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

from paper_report import config as paper_config  # noqa: E402
from paper_report import data as paper_data  # noqa: E402
from paper_report import figures as paper_figures  # noqa: E402
from paper_report import page as paper_page  # noqa: E402
from paper_report import sums as paper_sums  # noqa: E402


def student(
    kind="multi_head", width=512, seed=0, r2=0.99, mse=0.001, gait=None, use="named", steps=100, precision="bfloat16"
):
    """What is known of a student of trot and bound; bound's R2 is 0.001 lower."""
    gaits = [gait] if gait else ["trot", "bound"]
    figures = {"mse": mse, "mae": 10 * mse}
    scores = {name: figures | {"r2": r2 - 0.001 * (name == "bound"), "r2_joint_mean": r2 - 0.01} for name in gaits}
    return {
        "kind": kind,
        "width": width,
        "seed": seed,
        "precision": precision,
        "gait": gait,
        "steps": steps,
        "scores": {use: scores},
        "curve": {"steps": [50, 100], "mse": {name: [0.1, mse] for name in gaits}},
        "seconds": 30.0,
        "samples_per_s": 1000,
        "device": "cpu",
        "threads": 1,
        "command": f"python examples/reproduce_paper.py --widths {width}",
    }


# -- Sums --------------------------------------------------------------------------------------------------------------


def test_intervals_are_students_t():
    # n = 5: mean 3, s = sqrt(2.5), t = 2.776: half width 1.963. n = 2: t = 12.706, s = sqrt(2) / 2.
    assert paper_sums.estimate([1, 2, 3, 4, 5]) == pytest.approx((3.0, 2.776445 * math.sqrt(2.5 / 5), 5), rel=1e-6)
    assert paper_sums.estimate([0.0, 1.0]) == pytest.approx((0.5, 12.706205 * 0.5, 2), rel=1e-6)
    single = paper_sums.estimate([0.7])
    assert single.mean == 0.7 and math.isnan(single.half) and single.count == 1


def test_students_of_one_width_and_duration_are_one_learner():
    own = [student(seed=0, r2=0.98), student(seed=1, r2=0.99), student(width=2560), student(steps=7)]
    own += [student(precision="float32")]
    own += [student("per_gait", gait="trot", seed=s) for s in (0, 1, 2)] + [student("pooled")]
    assert [learner[:3] + (learner.kind,) for learner in paper_sums.learners(own)] == [
        (512, 7, "bfloat16", "multi_head"),
        (512, 100, "bfloat16", "multi_head"),
        (512, 100, "bfloat16", "pooled"),
        (512, 100, "bfloat16", "per_gait"),
        (512, 100, "float32", "multi_head"),
        (2560, 100, "bfloat16", "multi_head"),
    ]
    trot, bound = (paper_sums.scores(own, gait, "named") for gait in ("trot", "bound"))
    assert [each["r2"].count for each in trot.values()] == [1, 2, 1, 3, 1, 1]
    assert [learner.kind for learner in bound] == [*["multi_head"] * 2, "pooled", *["multi_head"] * 2]
    assert trot[paper_sums.Learner(512, 100, "bfloat16", 0)]["r2"].mean == pytest.approx(0.985)
    assert paper_sums.scores(own, "trot", "unseen") == {}


def test_a_verdict_needs_more_than_the_aim_and_every_figure():
    own = [student(r2=0.991, mse=0.001), student("pooled", r2=0.9905, mse=0.001)]
    trot, bound = paper_sums.verdicts("simulation", own)[0], paper_sums.verdicts("simulation", own)[-1]
    assert (trot["gait"], trot["r2"], trot["reached"]) == ("trot", 0.991, True)
    assert trot["worse"] == ["mse", "mae"]
    assert (bound["gait"], bound["reached"]) == ("bound", False)  # 0.990 is not above 0.99
    assert paper_sums.verdicts("simulation", own[:1])[0]["worse"] is None
    better = [student(mse=0.0009, r2=0.995), student("pooled", r2=0.9905, mse=0.001)]
    assert [each["worse"] for each in paper_sums.verdicts("simulation", better)] == [[], []]
    for other in ({"width": 2560}, {"steps": 7}, {"precision": "float32"}):
        apart = paper_sums.verdicts("simulation", [student(**other), student("pooled")])
        assert apart and all(each["worse"] is None for each in apart)


# -- Page and figures --------------------------------------------------------------------------------------------------


def test_scores_stand_beside_the_papers():
    own = [student(seed=seed, r2=0.99 + 0.001 * seed) for seed in (0, 1, 2)]
    lines = paper_page.score_table("simulation", own, "named", paper=True).splitlines()
    assert lines[2].startswith("| trot | paper, multi-task | - | 2560 | - | - | 0.000528 | 0.01764 | 0.91954 | - |")
    # s = 0.001, n = 3: half width 4.303 * 0.001 / sqrt(3).
    assert "| trot | multi-head | bfloat16 | 512 | 100 | 3 | 0.001000 ± 0.000000 |" in lines[4]
    assert lines[4].endswith("| 0.99100 ± 0.00248 | 0.98100 ± 0.00248 |")
    assert len(lines) == 2 + 3 * 2 + 2  # jump is not measured, so it has the paper's rows alone
    assert "paper" not in paper_page.score_table("simulation", own, "named", paper=False)


def test_the_summary_has_a_row_per_way_of_training():
    own = [student(seed=seed, r2=0.99 + 0.001 * seed) for seed in (0, 1, 2)] + [student("pooled", r2=0.98)]
    own += [student("per_gait", gait="bound", r2=0.97), student("pooled", width=2560, r2=0.96)]
    tables = {
        "simulation": table_of(*own),
        "hardware_half_noise": table_of(student(use="unseen"), name="hardware_half_noise"),
    }
    rows = [line.strip("| ").split(" | ") for line in paper_page.summary_table(tables).splitlines()[2:]]
    narrow, wide = "512, 100, bfloat16", "2560, 100, bfloat16"
    assert rows == [
        ["simulation", "trot", "0.9195", "0.7701", narrow, "0.9910 ± 0.0025", "0.9800", "-"],
        ["simulation", "trot", "0.9195", "0.7701", wide, "-", "0.9600", "-"],
        ["simulation", "bound", "0.9918", "0.9069", narrow, "0.9900 ± 0.0025", "0.9790", "0.9690"],
        ["simulation", "bound", "0.9918", "0.9069", wide, "-", "0.9590", "-"],
        ["hardware half noise", "trot", "0.9710", "-", narrow, "0.9900", "-", "-"],
    ]


def test_what_misses_is_bold():
    own = [student(r2=0.9905, mse=0.002), student("pooled", r2=0.98, mse=0.001)]
    trot, bound = paper_page.verdict_table("simulation", own).splitlines()[2:]
    assert "| 0.99050 | **all but MSE [rad^2], MAE [rad]** |" in trot and "| **0.98950** |" in bound
    assert paper_page.verdict_table("simulation", own[:1]).splitlines()[2].endswith("| 0.99050 | - |")


def table_of(*students, name="simulation"):
    config, table = paper_config.FULL, paper_config.TABLES[name]
    account = {gait: {"seconds": 600.0, "falls": 1} for gait in table.gaits}
    return {
        "students": list(students),
        "data": {"train": account, "unseen": account},
        "config": dataclasses.asdict(config),
        "env_kwargs": paper_data.shard_jobs(table, config)["train"][0].as_dict()["env_kwargs"],
        "largest": {gait: config.largest(gait).tolist() for gait in table.gaits},
        "seed": 0,
    }


def test_the_page_shows_both_tables_and_names_the_differences():
    tables = {"simulation": table_of(student()), "hardware": table_of(student(use="unseen"), name="hardware")}
    page = paper_page.paper_page({"tables": tables}, ["paper_hardware_loss.png"])
    simulation, hardware = page.split("## Hardware")
    assert "None had to be clipped" in page and "no noise, 1 kHz" in simulation and "4 ms of delay" in hardware
    assert "(paper_hardware_loss.png)" in hardware and ".png" not in simulation
    assert "| trot | 600 | 600 | 2 |" in hardware and "0.97101" in hardware
    assert "the authors' held-out command:" in simulation and "the authors' held-out command:" not in hardware


def test_half_the_noise_stands_beside_the_papers_hardware():
    own = table_of(student(use="unseen"), name="hardware_half_noise")
    page = paper_page.paper_page({"tables": {"hardware_half_noise": own}})
    assert "0.5 times the environment's default" in page and "0.97101" in page and "> 0.971 " in page
    assert paper_page.noise_factor(True) == 1.0


def test_what_the_expert_knows_of_the_state_is_named():
    own = table_of(student(use="unseen"), name="hardware_estimator")
    text = paper_page.differences("hardware", own)
    assert "a Kalman filter tells it" in text and "independent" not in text
    assert "a Kalman filter" not in paper_page.differences("hardware", table_of(student(use="unseen"), name="hardware"))


def test_every_command_that_made_a_student_is_named_once():
    own = paper_page.made_by(table_of(student(), student(seed=1), student(width=2560)))
    assert own.startswith(
        "Made by `python examples/reproduce_paper.py --widths 512` and `python examples/reproduce_paper.py --widths "
        "2560`, data seed 0; the trainings took 2 min"
    )


def test_clipped_commands_are_named():
    own = table_of(student())
    own["largest"]["jump"] = [0.8, 0.4, 0.0]
    assert paper_page.clipped(own) == "Clipped to what the expert survives: jump ± 0.8 and ± 0.4 m/s."


def test_stances_are_runs_of_contact():
    assert paper_figures.stances(np.array([1, 1, 0, 1, 0, 0, 1], dtype=bool)) == [(0, 2), (3, 1), (6, 1)]
    assert paper_figures.stances(np.zeros(3, dtype=bool)) == []
    assert paper_figures.stances(np.ones(3, dtype=bool)) == [(0, 3)]


def test_the_contact_figure_shows_the_end_of_the_first_episode():
    obs = np.zeros((60, 34 + 2))
    obs[:40, 34], obs[40:, 35] = 1.0, 1.0  # 40 rows of trot, 20 of bound
    obs[[14, 16, 17, 19], 30] = 1.0  # the front left foot of trot; the last ten rows of its first episode are 10 ... 19
    obs[:9, 31] = 1.0  # too early to be seen
    obs[20:, 32] = 1.0  # in the second episode, and throughout bound
    starts = np.isin(np.arange(60), (0, 20, 40))
    ones = np.ones(12)
    rows = trainers.Demonstrations(obs, np.zeros((60, 12)), starts, ("trot", "bound"), ones, ones, 50)
    figure = paper_figures.contact_figure(rows, seconds=0.2)
    assert [ax.get_title() for ax in figure.axes] == ["trot", "bound"]
    spans = [[path.get_extents() for path in bars.get_paths()] for bars in figure.axes[0].collections]
    found = [[(round(span.x0, 6), round(span.x1, 6)) for span in own] for own in spans]
    assert found == [[(0.08, 0.1), (0.12, 0.16), (0.18, 0.2)], [], [], []]
    (always,) = figure.axes[1].collections[2].get_paths()
    assert always.get_extents().width == pytest.approx(0.2)


def test_the_loss_figure_has_a_line_per_student():
    own = [student(), student(seed=1), student("pooled", width=64), student("per_gait", gait="trot")]
    figure = paper_figures.loss_figure(own, ("trot", "bound"))
    for ax in figure.axes:
        assert len(ax.lines) == 3 and ax.get_yscale() == "log"
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), [0.1, 0.001])
    assert [line.get_linestyle() for line in figure.axes[0].lines] == ["-", "-", "--"]
    assert len(figure.legends[0].get_texts()) == 2


def test_a_long_legend_is_broken_into_lines():
    own = [student(kind, width=width) for kind in ("multi_head", "pooled") for width in (512, 2560)]
    figure = paper_figures.loss_figure(own, ("trot", "bound"))
    (legend,) = figure.legends
    assert len(legend.texts) == 4 and legend.get_window_extent().width <= figure.bbox.width
    (single,) = paper_figures.loss_figure(own[::2], ("trot", "bound")).legends
    assert single.get_window_extent().height < 0.75 * legend.get_window_extent().height
