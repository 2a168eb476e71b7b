"""The published run of the main job: its metrics as records, and the tables made of them."""

from collections.abc import Mapping
from typing import Any

from experiments.results import Results, distinct
from experiments.tables import count, markdown, number
from go1_mtl_gym import TASKS
from go1_mtl_gym.errors import InvalidInputError
from trainers.utils.report import paper_table, results_table

NAME = "main_job"
EXPERT, STUDENT = "expert", "multi_head"
RATES = {"survival_rate": "survived", "success_rate": "succeeded"}
DERIVED = (*RATES, *(f"operator_{name}" for name in RATES), "success_interval", "episodes")


def results_of(metrics: Mapping[str, Any], command: str) -> Results:
    """The records of a run.

    Args:
        metrics: what its ``metrics.json`` holds.
        command: that made it.

    Raises:
        InvalidInputError: if the metrics are not those of a run.
    """
    try:
        records = [
            {"study": NAME, "agent": agent, "task": task, "condition": "", "seed": metrics["seed"], **_counted(scores)}
            for task, agents in metrics["tasks"].items()
            for agent, scores in agents.items()
        ]
        names = ("seed", "versions", "seconds")
        head = {name: metrics[name] for name in names}
        return Results(NAME, command, options=metrics["config"], machine=None, records=tuple(records), **head)
    except (KeyError, TypeError, AttributeError) as error:
        raise InvalidInputError(f"expected the metrics of a finished run of the main job; missing: {error}") from error


def _counted(scores: Mapping[str, Any]) -> dict[str, Any]:
    """Metrics with counts in place of the rates that follow from them."""
    trials = scores["episodes"]
    counts = {"trials": trials}
    for before in ("", "operator_"):
        for rate, counted in RATES.items():
            if before + rate in scores:
                counts[before + counted] = round(trials * scores[before + rate])
    return {name: value for name, value in scores.items() if name not in DERIVED} | counts


def summary_table(results: Results) -> str:
    """One row per gait: the expert beside the policy."""
    rows = []
    for task in distinct(results.records, "task"):
        both = [results.of(task=task, agent=agent) for agent in (EXPERT, STUDENT)]
        cells = [count(members.rate(key)) for key in ("succeeded", "operator_succeeded") for members in both]
        for key, how in (("velocity_error", ".3f"), ("step_rate", ".2f")):
            cells += [number(members.mean(key), how) for members in both]
        rows.append([task, *cells, f"{TASKS[task].gait.step_rate:.2f}"])
    metrics = ("success", "in hands", "velocity error [m/s]", "steps per second")
    header = [f"{metric}: {agent}" for metric in metrics for agent in ("expert", "student")]
    return markdown(["gait", *header, "steps per second: planned"], rows)


def tables(results: Results) -> list[str]:
    """Paragraphs of the page of the main job."""
    metrics = {"tasks": _by_task(results)}
    return [
        "![The student in its gaits](gaits.gif)",
        "## Student and baselines",
        results_table(metrics),
        "![Joint targets of the student and of the expert](joint_targets.png)",
        "## R2 here and in the paper",
        paper_table(metrics),
        "The settings differ (another expert, other gains, rates, commands and inputs; walk was measured on hardware), "
        "so the table says how well each network fits its own expert, not which one is better.",
        "## Wall time",
        markdown(["stage", "wall time [s]"], [[stage, f"{value:.0f}"] for stage, value in results.seconds.items()]),
        "As long as this run took, whatever else the machine did meanwhile.",
    ]


def _by_task(results: Results) -> dict[str, dict[str, Any]]:
    """{task: {agent: metrics}} with rates."""
    tasks: dict[str, dict[str, Any]] = {}
    for record in results.records:
        counted = {f"{before}{rate}": before + key for before in ("", "operator_") for rate, key in RATES.items()}
        rates = {rate: record[key] / record["trials"] for rate, key in counted.items() if key in record}
        tasks.setdefault(record["task"], {})[record["agent"]] = record | rates | {"episodes": record["trials"]}
    return tasks
