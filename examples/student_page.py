"""The student's report in Markdown, written from ``student_SECTION.json``."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from student_figures import BAR, Report
from student_lab import EXPERT
from student_lessons_page import budget_table, clockless_table
from student_robustness import QUANTITIES

from trainers.report import markdown


@dataclass(frozen=True)
class Chapter:
    """How a section is shown.

    Attributes:
        title: of its heading.
        note: what its table holds.
        picture: description of its picture.
        table: writes the table from {walker: {gait: {part: figures}}}.
    """

    title: str
    note: str
    picture: str
    table: Callable[[Report], str]


def student_section(name: str, data: Mapping[str, Any], made_by: str, picture: bool) -> list[str]:
    """Paragraphs of one section on the page of results.

    Args:
        name: of the section.
        data: what ``student_NAME.json`` holds.
        made_by: how it was made.
        picture: whether ``student_NAME.png`` is there.
    """
    chapter = CHAPTERS[name]
    shown = [f"![{chapter.picture}](student_{name}.png)"] if picture else []
    return [f"### {chapter.title}", chapter.table(data["report"]), f"{chapter.note} {made_by}", *shown]


# -- Tables ------------------------------------------------------------------------------------------------------------


def switching_table(report: Report) -> str:
    """Per walker and first gait: successes to each second gait, and survivals of all together."""
    gaits = _gaits(report)
    rows = []
    for name, tasks in report.items():
        for first, pairs in tasks.items():
            cells = [f"{pairs[to]['succeeded']}/{pairs[to]['trials']}" if to in pairs else "-" for to in gaits]
            survived, trials = (sum(pair[key] for pair in pairs.values()) for key in ("survived", "trials"))
            rows.append([name, first, *cells, f"{survived}/{trials}"])
    return markdown(["", "from", *(f"to {gait}" for gait in gaits), "survived"], rows, text_columns=2)


def robustness_table(report: Report) -> str:
    """Per student and quantity, in the middle of its range: survived and successful episodes of every gait."""
    gaits, rows = _gaits(report), []
    for name, tasks in report.items():
        for quantity in QUANTITIES if name != EXPERT else ():
            middle = {task: _middle(parts[quantity]["levels"]) for task, parts in tasks.items() if quantity in parts}
            if middle:
                value = next(iter(middle.values()))["value"]
                cells = [_against_bar(middle[gait]) if gait in middle else "-" for gait in gaits]
                rows.append([name, QUANTITIES[quantity].label, f"{value:g}", *cells])
    return markdown(["", "quantity", "middle", *gaits], rows, text_columns=2)


def push_table(report: Report) -> str:
    """Per gait and walker: largest kick in every direction [m/s]."""
    names = ("left", "right", "forward", "backward")
    rows = []
    for gait in _gaits(report):
        for name, tasks in report.items():
            parts = tasks.get(gait, {})
            rows.append([gait, name, *(_kick(parts[part]) if part in parts else "-" for part in names)])
    return markdown(["gait", "", *(f"{name} [m/s]" for name in names)], rows, text_columns=2)


# -- Cells -------------------------------------------------------------------------------------------------------------


def _gaits(report: Report) -> list[str]:
    return list(dict.fromkeys(gait for tasks in report.values() for gait in tasks))


def _middle(levels: list[dict[str, Any]]) -> dict[str, Any]:
    return levels[len(levels) // 2]


def _against_bar(level: Mapping[str, Any]) -> str:
    """Survived and successful episodes; bold where their share is below `BAR`."""
    cells = []
    for key in ("survived", "succeeded"):
        text = f"{level[key]}/{level['trials']}"
        cells.append(text if level[key] >= BAR * level["trials"] - 1e-9 else f"**{text}**")
    return ", ".join(cells)


def _kick(found: Mapping[str, Any]) -> str:
    return f"{'>= ' if found['at_cap'] else ''}{found['largest']:.1f}"


CHAPTERS = {
    "switching": Chapter(
        "Changes of gait",
        "Successful changes while walking at a drawn command: no fall, and the second gait's commands and steps are "
        "followed as success asks. Last column: without a fall, to all gaits together.",
        "Successful changes of gait, of student and expert",
        switching_table,
    ),
    "robustness": Chapter(
        "Another world",
        "In the middle of each range: survived and successful episodes with drawn commands that change; bold where "
        f"fewer than {BAR:.0%}. The picture shows the whole ranges.",
        "Survival over friction, payload, delay, motors, contacts and noise, of student and expert",
        robustness_table,
    ),
    "pushes": Chapter(
        "Kicks",
        "Largest change of the base's velocity that at least 90 % of the trials survive at a random phase of the "
        "cycle, walking at 0.3 m/s.",
        "Largest kick survived, of student and expert",
        push_table,
    ),
    "budget": Chapter(
        "DAgger against cloning",
        "Success, and in brackets survival, with equally many labels per gait; episodes of all gaits and training "
        "seeds together. Error, falls (of all gaits) and the learner's share of the steps while collecting belong to "
        "the last column of budgets. Success drops where it falls from one budget to the next by more than the 95 % "
        "interval of the difference.",
        "Survival, success and falls over labels, of five ways to ask for them",
        budget_table,
    ),
    "clockless": Chapter(
        "Without a clock",
        "Successful episodes with commands that change, in every gait; survivors, changes of gait and noisy sensors "
        "of all gaits together; median and 99th percentile of the error of the phase on disturbed walks of the expert "
        "that nobody learned from. All but named students learned from the same demonstrations.",
        "Success and error of the phase, of students without a clock",
        clockless_table,
    ),
}
"""Sections in the order of the page."""
