"""The student's report, one file and one figure per section, for the student and for the expert.

python examples/report_student.py robustness --policy runs/default/policy.zip    Ctrl-C and it goes on later
python examples/report_student.py switching pushes --policy randomised=a.zip --policy nominal=b.zip     two students
python examples/report_student.py commanded --seeds 0 1 2 3 4          makes its own five students, in some hours
python examples/report_student.py ablation                     makes its own, which differ in one setting each, in one
python examples/report_student.py budget phase_free           the same, in less than an hour each; with their own seeds
python examples/report_student.py phase_free --policy phase_free=c.zip     and a finished one without a clock
python examples/report_student.py robustness --quick --policy a.zip --out-dir runs/quick            a minute's worth

Every section has its own file and figure, which hold what this command asked for and nothing else; whatever part was
measured before, and whatever student was made, is taken from --parts.
"""

import argparse
import dataclasses
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from expert_report.figures import save_figure
from publishing.runs import without_out
from report_parts import exit_status, measure_all, parse_report, report_parser
from student_report.classes import changed
from student_report.figures import FIGURES
from student_report.lab import Walker, walkers
from student_report.lessons import ALL
from student_report.page import CHAPTERS
from student_report.parts import SECTIONS, Section, parts_of
from student_report.school import teach_all

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import number_in, one_of
from trainers.policies.checkpoint import versions
from trainers.utils.files import write_json

OUT = Path("docs/results")
PARTS = Path("runs/student")
OWN = tuple(name for name, section in SECTIONS.items() if section.school or section.prepare)
"""Sections that make their own students."""
BESIDE = ("phase_free",)
"""Those of them that measure given ones beside them, if there are any."""


def section_of(name: str, quick: bool) -> Section:
    """A section with the settings that are asked for."""
    section = SECTIONS[name]
    return dataclasses.replace(section, config=section.quick) if quick else section


def gaits(name: str, given: Sequence[Walker], options: argparse.Namespace) -> Sequence[str]:
    """What a section's students know, those that it makes or those that are given."""
    school = SECTIONS[name].school
    if SECTIONS[name].prepare:
        return (ALL,)
    if school is None:
        return given[-1].env_kwargs["tasks"]
    return next(iter(school.lessons(options.seeds, options.quick).values())).tasks


def plan(options: argparse.Namespace, known: Mapping[str, Sequence[str]]) -> dict[str, list[tuple[str, str]]]:
    """The gaits and parts of every section asked for.

    Args:
        options: of the command line.
        known: section -> the gaits of its students.

    Raises:
        InvalidInputError: if a gait is none of the students', `only` names no part, or there is nothing to measure.
    """
    found = {}
    for name in options.sections:
        tasks = [one_of(task, known[name], "task") for task in options.tasks or known[name]]
        config = section_of(name, options.quick).config
        found[name] = [(task, what) for task in tasks for what in config.parts(task, tasks)]
    names = tuple(dict.fromkeys(what for pairs in found.values() for _, what in pairs))
    only = [one_of(name, names, "part") for name in options.only or names]
    kept = {name: [pair for pair in pairs if pair[1] in only] for name, pairs in found.items()}
    if not all(kept.values()):
        raise InvalidInputError(f"these gaits and parts leave nothing to measure for {[*kept]}; expected some for each")
    return kept


def report(name: str, pairs: Sequence[tuple[str, str]], given: Sequence[Walker], options: argparse.Namespace) -> dict:
    """Everything that was measured of a section, {walker: {gait: {part: figures}}}, and how to measure it again.

    Args:
        name: of the section.
        pairs: gaits and parts.
        given: who is measured, if the section does not make its own students.
        options: of the command line.
    """
    section = section_of(name, options.quick)
    school, about, seconds = section.school, {}, {}
    if school:
        lessons = school.lessons(options.seeds, options.quick)
        students = teach_all(lessons, options.parts / "students", options.n_jobs)
        given = school.walkers(students)
        about = {"lessons": {own: changed(config) for own, config in lessons.items()}, "bars": school.bars}
        seconds = {"students": sum(student.seconds for student in students.values())}
    elif section.prepare:
        given = section.config.walkers(given)
    parts = parts_of(name, section, given, pairs, options.seed, options.parts)
    if section.prepare and not all(part.path.is_file() for part in parts):
        section.prepare(section.config, parts[0].shared, options.n_jobs)
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for part, result in zip(parts, measure_all(parts, options.n_jobs), strict=True):
        found.setdefault(part.walker.name, {}).setdefault(part.task, {})[part.what] = result["figures"]
        seconds[name] = seconds.get(name, 0.0) + result["seconds"]
    return {
        "section": name,
        "report": school.complete(found, students) if school else found,
        "config": {"settings": dataclasses.asdict(section.config), "env_kwargs": given[-1].env_kwargs},
        "policies": {walker.name: walker.sha256 for walker in given if walker.sha256},
        "seed": options.seed,
        "versions": versions(),
        "seconds": {what: round(value, 1) for what, value in seconds.items()},
        **about,
    }


def parse(arguments: list[str]) -> argparse.Namespace:
    """Read the command line.

    Raises:
        InvalidInputError: for an impossible number, or something that was named twice.
    """
    description = "Measure a student beside the expert, one file and one figure per section."
    parser = report_parser(description, PARTS, seed="of commands, resets, noise and kicks")
    add = parser.add_argument
    add("sections", nargs="+", choices=tuple(SECTIONS), help="what is measured")
    add(
        "--policy",
        action="append",
        help=f"the student's file, or name=file; once per student ({', '.join(OWN)} make their own, and only "
        f"{', '.join(BESIDE)} can measure others beside them)",
    )
    add("--tasks", nargs="+", default=None, help="gaits; None: all that the student knows")
    add("--only", nargs="+", default=None, help="parts, such as quantities, directions or gaits changed to; None: all")
    add(
        "--seeds",
        type=int,
        nargs="+",
        default=[0, 1, 2, 3, 4],
        help="of the training of commanded's own students; ablation takes the first, others have theirs",
    )
    add("--out-dir", type=Path, default=OUT, help="folder of the results and figures")
    options = parse_report(parser, arguments, distinct=("sections", "tasks", "only", "seeds"))
    for seed in options.seeds:
        number_in(seed, 0, 2**31 - 1, "training seed")
    needy = [name for name in options.sections if name not in OWN]
    unused = not needy and not set(BESIDE) & set(options.sections)
    if (needy and not options.policy) or (unused and options.policy):
        expected = f"expected for {', '.join(needy)}" if needy else f"not for {', '.join(OWN)}, which make their own"
        raise InvalidInputError(f"--policy is {expected}, got {options.policy}")
    return options


@exit_status
def main(arguments: list[str] | None = None) -> int:
    """Run from the command line; returns the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    command = without_out(shlex.join(["python", "examples/report_student.py", *arguments]))
    options = parse(arguments)
    given = walkers(options.policy) if options.policy else []
    for name, pairs in plan(options, {name: gaits(name, given, options) for name in options.sections}).items():
        data = report(name, pairs, given, options) | {"command": command}
        path = options.out_dir / f"student_{name}.json"
        write_json(path, data)
        picture = save_figure(FIGURES[name](data["report"]), path.with_suffix(".png"))
        print(f"\n{CHAPTERS[name].table(data['report'])}\n\n{name}: {path}\npicture: {picture}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
