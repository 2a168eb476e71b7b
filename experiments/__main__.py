"""The command line: ``python -m experiments list | run NAME [--quick] ... | publish``."""

import argparse
import dataclasses
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments.agents import policy_files
from experiments.catalog import STUDIES, study_class, summary_line
from experiments.plots import save_figure
from experiments.publish import publish_command
from experiments.results import Results, without_folders
from experiments.running import run
from experiments.study import CACHE, Study
from go1_mtl_gym.validation import number_in
from trainers.utils import cli

OUT = CACHE / "results"


def study_parser(name: str) -> argparse.ArgumentParser:
    """The command line of one study: what all have in common, and its options."""
    cls = study_class(name)
    parser = argparse.ArgumentParser(prog=f"python -m experiments run {name}", description=summary_line(cls))
    add = parser.add_argument
    add("--quick", action="store_true", help="little of everything, to see that everything works")
    add("--seed", type=int, default=1, help="of commands, resets, noise and pushes; %(default)s")
    add("--n-jobs", type=int, default=os.cpu_count() or 1, help="processes")
    add("--only", nargs="+", default=[], help="agents, tasks and conditions; all if not given")
    add("--add", action="store_true", help="keep records of the results file that this run does not replace")
    add("--out", type=Path, default=OUT, help="folder of the results and the picture; %(default)s")
    add("--cache", type=Path, default=CACHE, help="folder of finished cells, from which an interrupted run goes on")
    if cls.takes_policies:
        add(
            "--policy", action="append", default=[], help="file of a policy, or name=file; the shipped one if not given"
        )
    for field in dataclasses.fields(cls.full):
        _add_option(parser, field, getattr(cls.full, field.name))
    return parser


def _add_option(parser: argparse.ArgumentParser, field: "dataclasses.Field[Any]", default: Any) -> None:
    """An option for a number, a word or several; other settings are no options."""
    several = isinstance(default, tuple) and bool(default)
    kind = type(default[0] if several else default)
    if kind in (int, float, str):
        shown = " ".join(map(str, default)) if several else default
        about = f"{field.metadata.get('about', '')} (whole runs: {shown})".replace("%", "%%")
        nargs = "+" if several else None
        parser.add_argument(f"--{field.name.replace('_', '-')}", type=kind, nargs=nargs, help=about)


def study_of(name: str, options: argparse.Namespace) -> Study:
    """The study that a command line asks for.

    Raises:
        InvalidInputError: for an impossible number.
    """
    cls = study_class(name)
    number_in(options.seed, 0, 2**31 - 1, "seed")
    number_in(options.n_jobs, 1, 1024, "n_jobs")
    fields = [field.name for field in dataclasses.fields(cls.full)]
    given = {name: value for name in fields if (value := getattr(options, name, None)) is not None}
    given = {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}
    chosen = dataclasses.replace(cls.quick if options.quick else cls.full, **given)
    return cls(chosen, policy_files(getattr(options, "policy", [])), options.cache)


def run_command(name: str, arguments: list[str]) -> None:
    """``run``: measure a study, write its results and picture, print its table."""
    study_class(name)
    options = study_parser(name).parse_args(arguments)
    study = study_of(name, options)
    command = without_folders(shlex.join(["python", "-m", "experiments", "run", name, *arguments]))
    path = cli.writable_folder(options.out) / f"{study.name}.json"
    cli.writable_folder(options.cache)
    try:
        results = run(study, options.seed, options.n_jobs, command, options.only)
    except KeyboardInterrupt as interrupt:
        raise KeyboardInterrupt("what is finished is kept, the same command goes on from there") from interrupt
    if options.add and path.is_file():
        results = results.beside(Results.read(path), study.keys)
    results.write(path)
    print(f"\n{study.table(results)}\n\nresults: {path}")
    figures = study.more_figures() | {"": study.figure(results)}
    for end, figure in figures.items():
        if figure is not None:
            print(f"picture: {save_figure(figure, path.with_name(f'{study.name}{end}.png'))}")


@cli.main
def main(arguments: Sequence[str] | None = None) -> None:
    """Run from the command line; returns the exit status."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    parser = argparse.ArgumentParser(
        prog="python -m experiments", description="Measure, and publish what was measured."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("list", help="name every study")
    commands.add_parser("run", help="measure a study; run NAME --help lists its options", add_help=False)
    commands.add_parser("publish", help="write the pages of results; publish --help", add_help=False)
    command, rest = arguments[:1], arguments[1:]
    options = parser.parse_args(command)
    if options.command == "list":
        width = max(map(len, STUDIES))
        print("\n".join(f"{name:{width}}  {summary_line(study_class(name))}" for name in STUDIES))
    elif options.command == "publish":
        publish_command(rest)
    elif not rest or rest[0].startswith("-"):
        parser.error("run needs the name of a study; list names them all")
    else:
        run_command(rest[0], rest[1:])


if __name__ == "__main__":
    raise SystemExit(main())
