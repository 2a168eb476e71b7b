"""Tables: what stands in which cell, what stands there for a missing number."""

import copy

import pytest

from go1_mtl_gym.errors import InvalidInputError
from trainers import paper_table, results_table
from trainers.utils.report import markdown

STUDENT = {
    "mse": 0.0012345,
    "mae": 0.01234,
    "r2": 0.98765,
    "r2_joint_mean": 0.97,
    "survival_rate": 1.0,
    "survival_s": 20.0,
    "velocity_error": 0.0312,
    "yaw_rate_error": 0.0512,
    "step_rate": 2.497,
    "success_rate": 0.95,
    "success_interval": [0.76, 0.99],
    "episodes": 20,
}
EXPERT = {name: value for name, value in STUDENT.items() if name not in ("mse", "mae", "r2", "r2_joint_mean")}
METRICS = {"tasks": {"trot": {"multi_head": STUDENT, "expert": EXPERT}, "walk": {"pooled": STUDENT | {"r2": 0.9}}}}


def cells(table: str) -> list[list[str]]:
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]


def test_a_row_per_task_and_learner_the_expert_first():
    header, rule, expert, student, pooled = cells(results_table(METRICS))
    assert header == [
        "gait", "learner", "MSE [rad^2]", "MAE [rad]", "R2", "success", "survival", "velocity error [m/s]", "steps/s",
    ]  # fmt: skip
    assert rule[0] == ":--" and rule[-1] == "--:" and len(rule) == len(header)
    assert expert == ["trot", "MPC expert", "-", "-", "-", "19/20", "20/20", "0.031", "2.50"]
    assert student[:2] == ["trot", "multi-head student"]
    assert student[2:] == ["0.001234", "0.0123", "0.9877", "19/20", "20/20", "0.031", "2.50"]
    assert pooled[:2] == ["walk", "pooled baseline (no task id)"]


def test_the_phase_free_student_stands_below_the_student_and_without_one_step_errors():
    learners = {"pooled": STUDENT, "phase_free": EXPERT, "multi_head": STUDENT}
    student, phase_free, pooled = cells(results_table({"tasks": {"trot": learners}}))[2:]
    assert [row[1].partition(" (")[0] for row in (student, phase_free, pooled)] == [
        "multi-head student", "the same without a clock", "pooled baseline",
    ]  # fmt: skip
    assert phase_free[2:] == ["-", "-", "-", "19/20", "20/20", "0.031", "2.50"]


def test_episodes_in_hands_have_a_column_where_there_were_any():
    scores = {"expert": EXPERT, "multi_head": STUDENT | {"operator_success_rate": 0.9}}
    header, _, expert, student = cells(results_table({"tasks": {"trot": scores}}))
    assert header[-1] == "in hands" and (expert[-1], student[-1]) == ("-", "18/20")


def test_undefined_values_are_dashes_and_unknown_learners_keep_their_name():
    none = dict.fromkeys(STUDENT, None) | {"survival_rate": 0.0, "episodes": 4}
    literal, other = cells(results_table({"tasks": {"jump": {"mine": {}, "paper_literal": none}}}))[2:]
    assert literal[1].startswith("paper-literal 34 + K")
    assert literal[2:] == ["-", "-", "-", "-", "0/4", "-", "-"]
    assert other == ["jump", "mine"] + ["-"] * 7
    nan = cells(results_table({"tasks": {"jump": {"pooled": {"mse": float("nan"), "success_rate": float("nan")}}}}))[2]
    assert nan[2] == nan[5] == "-"


def test_a_rate_is_a_count_where_the_number_of_episodes_is_known():
    def success(**scores):
        return cells(results_table({"tasks": {"trot": {"expert": scores}}}))[2][5]

    assert success(success_rate=0.75, episodes=[{}] * 8) == "6/8"
    assert success(success_rate=0.75, episodes=8) == "6/8"
    assert success(success_rate=0.75) == "75 %"


def test_the_input_stays_as_it_was():
    before = copy.deepcopy(METRICS)
    results_table(METRICS), paper_table(METRICS)
    assert before == METRICS


def test_the_papers_numbers_stand_beside_ours():
    header, _, trot, walk = cells(paper_table(METRICS))
    assert header[0] == "gait" and "paper" in header[3]
    assert trot == ["trot", "0.9877", "-", "0.9195", "0.7701", "simulation"]
    assert walk == ["walk", "-", "0.9000", "0.9612", "-", "hardware"]
    assert cells(paper_table({"tasks": {"pace": {}}}))[2] == ["pace", "-", "-", "-", "-", "-"]


def test_markdown():
    assert markdown(["a", "b"], [["c", "d"]], text_columns=2) == "| a | b |\n| :-- | :-- |\n| c | d |"


@pytest.mark.parametrize("metrics", [{}, {"tasks": {}}, {"tasks": None}, {"task": {"trot": {}}}])
def test_metrics_without_tasks_are_refused(metrics):
    for table in (results_table, paper_table):
        with pytest.raises(InvalidInputError, match="at least one task"):
            table(metrics)
