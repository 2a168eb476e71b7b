"""The student's report: changes of gait, another world and kicks, each measured for the student and for the expert.

python examples/report_student.py robustness --policy runs/students/seed-0/policy.zip    Ctrl-C and it goes on later
python examples/report_student.py switching pushes --policy randomised=a.zip --policy nominal=b.zip     two students
python examples/report_student.py budget clockless                       students that are taught here, so no --policy
python examples/report_student.py clockless --policy clockless=c.zip     the same, and a finished one without a clock
python examples/report_student.py robustness --quick --policy a.zip --out-dir runs/quick            a minute's worth

Every section has its own file and figure, which hold what this command asked for and nothing else; whatever part was
measured before is taken from --parts.
"""

import argparse
import dataclasses
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from expert_figures import save_figure
from publish_results import without_out
from report_parts import measure_all
from student_figures import FIGURES
from student_lab import Walker, walkers
from student_lessons import ALL
from student_page import CHAPTERS
from student_parts import SECTIONS, StudentPart, parts_of

from go1_mtl_gym import Go1Error
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import number_in, one_of
from trainers.checkpoint import versions
from trainers.files import write_json

OUT = Path("docs/results")
PARTS = Path("runs/student")


def plan(options: argparse.Namespace, who: Sequence[Walker]) -> dict[str, list[StudentPart]]:
    """The parts of every section asked for.

    Raises:
        InvalidInputError: if a gait is none of the students', `only` names no part, or there is nothing to measure.
    """
    known = who[-1].env_kwargs["tasks"] if who else ()
    tasks = [one_of(task, known, "task") for task in options.tasks or known]
    found = {}
    for name in options.sections:
        section = SECTIONS[name]
        if options.quick:
            section = dataclasses.replace(section, config=section.quick)
        whom, gaits = (section.config.walkers(who), [ALL]) if section.prepare else (who, tasks)
        found[name] = parts_of(name, section, whom, gaits, options.seed, options.parts)
    names = tuple(dict.fromkeys(part.what for parts in found.values() for part in parts))
    only = [one_of(name, names, "part") for name in options.only or names]
    kept = {name: [part for part in parts if part.what in only] for name, parts in found.items()}
    if not all(kept.values()):
        raise InvalidInputError(f"these gaits and parts leave nothing to measure for {[*kept]}; expected some for each")
    return kept


def report(name: str, parts: Sequence[StudentPart], options: argparse.Namespace) -> dict:
    """Everything that was measured of a section, {walker: {gait: {part: figures}}}, and how to measure it again."""
    section, who = parts[0].section, [part.walker for part in parts]
    if section.prepare and not all(part.path.is_file() for part in parts):
        section.prepare(section.config, parts[0].shared, options.n_jobs)
    found: dict[str, dict[str, dict[str, Any]]] = {}
    seconds = 0.0
    for part, result in zip(parts, measure_all(parts, options.n_jobs), strict=True):
        found.setdefault(part.walker.name, {}).setdefault(part.task, {})[part.what] = result["figures"]
        seconds += result["seconds"]
    return {
        "section": name,
        "report": found,
        "config": {"settings": dataclasses.asdict(section.config), "env_kwargs": who[-1].env_kwargs},
        "policies": {walker.name: walker.sha256 for walker in who if walker.sha256},
        "seed": options.seed,
        "versions": versions(),
        "seconds": {name: round(seconds, 1)},
    }


def parse(arguments: list[str]) -> argparse.Namespace:
    """Read the command line.

    Raises:
        InvalidInputError: for an impossible number, or something that was named twice.
    """
    parser = argparse.ArgumentParser(
        description="Measure a student beside the expert, one file and one figure per section.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add("sections", nargs="+", choices=tuple(SECTIONS), help="what is measured")
    add("--policy", action="append", default=[], help="the student's file, or name=file; once per student")
    add("--tasks", nargs="+", default=None, help="gaits; None: all that the student knows")
    add("--only", nargs="+", default=None, help="quantities, directions or gaits changed to; None: all")
    add("--quick", action="store_true", help="few and short episodes, to see that everything works")
    add("--seed", type=int, default=1, help="of commands, resets, noise and kicks")
    add("--n-jobs", type=int, default=os.cpu_count() or 1, help="processes")
    add("--parts", type=Path, default=PARTS, help="folder of finished parts, from which an interrupted run goes on")
    add("--out-dir", type=Path, default=OUT, help="folder of the results and figures")
    options = parser.parse_args(arguments)
    measuring = [name for name in options.sections if not SECTIONS[name].prepare]
    if measuring and not options.policy:
        raise InvalidInputError(f"{', '.join(measuring)} measures given students: expected --policy, got none")
    if options.tasks and len(measuring) < len(options.sections):
        raise InvalidInputError(f"expected no --tasks where students are taught every gait, got {options.tasks}")
    number_in(options.seed, 0, 2**31 - 1, "seed")
    number_in(options.n_jobs, 1, 1024, "n_jobs")
    for names in (options.sections, options.tasks or [], options.only or []):
        if len(set(names)) != len(names):
            raise InvalidInputError(f"a section, gait or part was named twice: {' '.join(names)}")
    return options


def main(arguments: list[str] | None = None) -> int:
    """Run from the command line; returns the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    command = without_out(shlex.join(["python", "examples/report_student.py", *arguments]))
    try:
        options = parse(arguments)
        who = walkers(options.policy) if options.policy else []
        for name, parts in plan(options, who).items():
            data = report(name, parts, options) | {"command": command}
            path = options.out_dir / f"student_{name}.json"
            write_json(path, data)
            picture = save_figure(FIGURES[name](data["report"]), path.with_suffix(".png"))
            print(f"\n{CHAPTERS[name].table(data['report'])}\n\n{name}: {path}\npicture: {picture}")
    except Go1Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("\ninterrupted; finished parts are kept, the same command goes on from there", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
