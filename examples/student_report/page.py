"""The student's report in Markdown, written from ``student_SECTION.json``."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from student_report.ablation import CHANGED_WORLD
from student_report.classes import BARS, passes
from student_report.commanded import CORNERS, CORRECTED, DRAWN, PHASE_FREE
from student_report.figures import BAR
from student_report.lab import EXPERT
from student_report.lessons_page import budget_table, phase_free_table
from student_report.robustness import QUANTITIES
from student_report.sums import Count, Report, commanded_sums, gaits_of, variant_sums
from trainers.evaluation.metrics import wilson_interval
from trainers.utils.report import markdown, number


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


def student_block(data: Mapping[str, Any], made_by: str) -> str:
    """The students of several training seeds, for README.md.

    Args:
        data: what ``student_commanded.json`` holds.
        made_by: how it was made.
    """
    chapter = CHAPTERS["commanded"]
    return "\n\n".join([chapter.table(data["report"]), f"{chapter.note} {made_by}"])


# -- Tables ------------------------------------------------------------------------------------------------------------


def commanded_table(report: Report) -> str:
    """Per gait, over the training seeds: success, velocity error beside the expert's, corners, and without a clock."""
    rows = []
    for gait in gaits_of(report):
        own = commanded_sums(report, gait)
        tracked = [number(own["expert_error"], ".3f"), "-"]
        success = ["-"] * 5
        if own[DRAWN][1]:
            low, high = wilson_interval(*own[DRAWN])
            errors = [_judged(own[key], "velocity_error", ".3f") for key in ("error", "worst_error")]
            worst = _judged(own["worst"], "success_rate", ".0%")
            success = [_count(own[DRAWN], BARS["success_rate"]), f"{low:.1%} ... {high:.1%}", worst, *errors]
            tracked[1] = _judged(own["worst_ratio"], "error_ratio", ".2f")
        others = (_count(own[what]) for what in (CORNERS, "expert_corners", PHASE_FREE, CORRECTED))
        rows.append([gait, *success, *tracked, *others])
    header = ["gait", "success", "95 % interval", "worst seed", "velocity error [m/s]", "worst seed's", "expert's"]
    return markdown([*header, "worst ratio", "corners", "expert's", "without a clock", "own clock"], rows)


def ablation_table(report: Report) -> str:
    """Per variant: success in every gait, velocity error, changes of gait, the changed world, and one-step R2."""
    gaits, rows = gaits_of(report), []
    for name, tasks in report.items():
        own = variant_sums(tasks)
        counts = [own["gaits"].get(gait, (0, 0)) for gait in gaits]
        numbers = [number(own["error"], ".3f"), *(_count(own[what]) for what in ("switching", "changed"))]
        rows.append([name, *map(_count, counts), *numbers, number(own["r2"], ".4f")])
    header = ["", *gaits, "velocity error [m/s]", "changes of gait", "changed world", "R2"]
    return markdown(header, rows)


def switching_table(report: Report) -> str:
    """Per walker and first gait: successes to each second gait, and survivals of all together."""
    gaits = gaits_of(report)
    rows = []
    for name, tasks in report.items():
        for first, pairs in tasks.items():
            cells = [f"{pairs[to]['succeeded']}/{pairs[to]['trials']}" if to in pairs else "-" for to in gaits]
            survived, trials = (sum(pair[key] for pair in pairs.values()) for key in ("survived", "trials"))
            rows.append([name, first, *cells, f"{survived}/{trials}"])
    return markdown(["", "from", *(f"to {gait}" for gait in gaits), "survived"], rows, text_columns=2)


def robustness_table(report: Report) -> str:
    """Per student and quantity, in the middle of its range: survived and successful episodes of every gait."""
    gaits, rows = gaits_of(report), []
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
    for gait in gaits_of(report):
        for name, tasks in report.items():
            parts = tasks.get(gait, {})
            rows.append([gait, name, *(_push_speed(parts[part]) if part in parts else "-" for part in names)])
    return markdown(["gait", "", *(f"{name} [m/s]" for name in names)], rows, text_columns=2)


# -- Cells -------------------------------------------------------------------------------------------------------------


def _count(count: Count, bar: float = 0.0) -> str:
    """Successes of trials; bold where their share is below a bar."""
    succeeded, trials = count
    if not trials:
        return "-"
    return f"{succeeded}/{trials}" if succeeded >= bar * trials - 1e-9 else f"**{succeeded}/{trials}**"


def _judged(value: float | None, figure: str, how: str) -> str:
    """A number; bold where it misses its bar, as one does that there is none of."""
    text = number(value, how)
    return text if passes(figure, value) else f"**{text}**"


def _middle(levels: list[dict[str, Any]]) -> dict[str, Any]:
    return levels[len(levels) // 2]


def _against_bar(level: Mapping[str, Any]) -> str:
    """Survived and successful episodes; bold where their share is below `BAR`."""
    return ", ".join(_count((level[key], level["trials"]), BAR) for key in ("survived", "succeeded"))


def _push_speed(found: Mapping[str, Any]) -> str:
    return f"{'>= ' if found['at_cap'] else ''}{found['largest']:.1f}"


CHAPTERS = {
    "commanded": Chapter(
        "Commands that change, over training seeds",
        "Successful episodes with a new command every few seconds, of the main job's students for several training "
        "seeds together, then of the worst seed; mean velocity error, that of the worst seed, the expert's, and the "
        "largest ratio of a seed's to it; the same with commands from the corners of the ranges; of the students "
        "without a clock; and of these with a clock of their own that they correct by half at every step. Bold misses "
        f"a bar: success {BARS['success_rate']:.0%}, velocity error {BARS['velocity_error']:g} m/s, "
        f"{BARS['error_ratio']:g} times the expert's.",
        "Success per gait and training seed, and velocity errors beside the expert's",
        commanded_table,
    ),
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
    "ablation": Chapter(
        "One change each",
        "Students of a reduced main job that differ in one setting: successful episodes with drawn commands per gait, "
        "mean velocity error, successful changes of gait of all pairs, successful episodes in a changed world "
        f"({', '.join(f'{name} {value:g}' for name, value in CHANGED_WORLD.items())}), and one-step R2 on held-out "
        "rows of each one's own demonstrations. One training seed: differences of a few episodes say nothing.",
        "Success, velocity error, changes of gait and changed world per variant",
        ablation_table,
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
    "phase_free": Chapter(
        "Without a clock",
        "Successful episodes with commands that change, in every gait; survivors, changes of gait and noisy sensors "
        "of all gaits together; median and 99th percentile of the error of the phase on disturbed walks of the expert "
        "that nobody learned from. Students with a correction in their name were given; the others learned from the "
        "same demonstrations.",
        "Success and error of the phase, of students without a clock",
        phase_free_table,
    ),
}
"""Sections in the order of the page."""
