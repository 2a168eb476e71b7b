"""The tables of arXiv 2505.08574 and ours beside them: paper.json, paper.md and figures.

python examples/reproduce_paper.py simulation                                trot, jump, bound at 1 kHz; 512 wide
python examples/reproduce_paper.py hardware hardware_half_noise              trot and walk, rates and noise of a robot
python examples/reproduce_paper.py hardware_estimator          likewise, with an expert that has to estimate its state
python examples/reproduce_paper.py simulation hardware --widths 2560 --seeds 0                       the paper's width
python examples/reproduce_paper.py simulation --widths 512 2560 --device cuda                            both, on a GPU
python examples/reproduce_paper.py simulation hardware --quick --out-dir runs/quick              a minute's worth

Demonstrations and students are made once and kept in --parts; a call trains those that it asks for and that are not
there yet, and then shows all finished ones of the kinds it asks for, so that wide ones can be added later. Parts are
named by their settings: after a change of the expert's code, give another folder. Ctrl-C loses the students in the
making and nothing else.
"""

import argparse
import dataclasses
import shlex
import sys
from pathlib import Path
from typing import Any

from expert_report.figures import save_figure
from main_job.students import check_device
from paper_report.config import FULL, PRECISIONS, QUICK, TABLES, PaperConfig
from paper_report.data import TRAIN, collect, shard_jobs
from paper_report.figures import contact_figure, loss_figure
from paper_report.page import paper_page, score_table
from paper_report.published import KINDS, MULTI_HEAD
from paper_report.students import School, students, teach_all
from publishing.runs import read_json, without_out
from report_parts import exit_status, parse_report, report_parser

import trainers
from go1_mtl_gym.validation import number_in
from trainers.policies.checkpoint import versions
from trainers.utils.files import write_atomically, write_json

OUT = Path("docs/results")
PARTS = Path("runs/paper")
NAME = "paper"


def reproduce(
    name: str, config: PaperConfig, options: argparse.Namespace, command: str
) -> tuple[dict[str, Any], School]:
    """Make what is missing of a table; returns what ``paper.json`` holds of it, and its students' files.

    Args:
        name: of the table.
        config: how much is made.
        options: of the command line.
        command: the command line.
    """
    table = TABLES[name]
    wanted = students(table, options.kinds, config)
    data = collect(table, config, options.parts, options.n_jobs)
    school = School(table, config, data, options.device, options.threads, command)
    teach_all(school, wanted, options.n_jobs)
    found = {
        "students": school.finished(options.kinds),
        "data": data.account(),
        "config": dataclasses.asdict(config),
        "env_kwargs": shard_jobs(table, config)[TRAIN][0].as_dict()["env_kwargs"],
        "largest": {gait: config.largest(gait).tolist() for gait in table.gaits},
        "seed": config.seed,
        "versions": versions(),
    }
    return found, school


def save_figures(name: str, found: dict[str, Any], school: School, folder: Path) -> list[Path]:
    """Write the figures of a table: held-out loss, joint targets of its widest multi-head student, contacts."""
    rows = school.data.rows(school.data.tests[0])
    figures = {"loss": loss_figure(found["students"], school.table.gaits), "contacts": contact_figure(rows)}
    shown = school.widest(MULTI_HEAD)
    if shown is not None:
        figures["targets"] = trainers.joint_target_figure(shown, rows)
    return [save_figure(figure, folder / f"{NAME}_{name}_{what}.png") for what, figure in figures.items()]


def write_table(name: str, found: dict[str, Any], folder: Path) -> Path:
    """Put a table into ``paper.json``, leave the others as they are, and write ``paper.md`` anew.

    All stand in one file, so that the page can always show the paper as a whole, whichever table was made last.
    """
    path = folder / f"{NAME}.json"
    tables = read_json(path)["tables"] if path.is_file() else {}
    data = {"tables": {each: (tables | {name: found})[each] for each in TABLES if each in tables or each == name}}
    write_json(path, data)
    text = paper_page(data, [picture.name for picture in folder.glob(f"{NAME}_*.png")])
    write_atomically(path.with_suffix(".md"), lambda file: file.write(text.encode()))
    return path


def settings(options: argparse.Namespace) -> PaperConfig:
    """How much is made: the full or the quick settings, with what the command line says otherwise."""
    names = ("widths", "seeds", "steps", "batch_size", "precision", "seed")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    lists = {name: tuple(value) for name, value in given.items() if isinstance(value, list)}
    return dataclasses.replace(QUICK if options.quick else FULL, **given | lists)


def parse(arguments: list[str]) -> argparse.Namespace:
    """Read the command line.

    Raises:
        InvalidInputError: for an impossible number, a device that is not there, or something that was named twice.
    """
    description = "Make the tables of arXiv 2505.08574 with this project's expert, and show both side by side."
    parser = report_parser(description, PARTS, seed=f"of commands and episodes; None: {FULL.seed}")
    parser.set_defaults(seed=None)
    add = parser.add_argument
    add("tables", nargs="+", choices=tuple(TABLES), help="which; two more are beside hardware")
    add("--kinds", nargs="+", choices=tuple(KINDS), default=list(KINDS), help="of students")
    add("--widths", type=int, nargs="+", default=None, help=f"units per hidden layer; None: {FULL.widths}")
    add("--seeds", type=int, nargs="+", default=None, help=f"of the trainings; None: {FULL.seeds}")
    add("--steps", type=int, default=None, help=f"gradient steps of every training; None: {FULL.steps}")
    add("--batch-size", type=int, default=None, help=f"rows per step; None: {FULL.batch_size}")
    add("--precision", choices=tuple(PRECISIONS), default=None, help=f"of the trainings; None: {FULL.precision}")
    add("--device", default="cpu", help="of the trainings: cpu or cuda")
    add("--threads", type=int, default=1, help="of each training on a CPU; changes the last digits")
    add("--out-dir", type=Path, default=OUT, help="folder of paper.json, paper.md and the figures")
    options = parse_report(parser, arguments, distinct=("tables", "kinds"))
    number_in(options.threads, 1, 1024, "threads")
    check_device(options.device)
    return options


@exit_status
def main(arguments: list[str] | None = None) -> int:
    """Run from the command line; returns the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    command = without_out(shlex.join(["python", "examples/reproduce_paper.py", *arguments]))
    options = parse(arguments)
    config = settings(options)
    for name in options.tables:
        found, school = reproduce(name, config, options, command)
        pictures = save_figures(name, found, school, options.out_dir)
        path = write_table(name, found, options.out_dir)
        table = score_table(school.table.published, found["students"], school.data.tests[0], paper=True)
        print(f"\n{table}\n\n{name}: {path}", *(f"picture: {picture}" for picture in pictures), sep="\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
