"""Finished parts of a report on disk, so that Ctrl-C costs little: named by what made them, measured side by side."""

import argparse
import functools
import hashlib
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from operator import methodcaller
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

import joblib
from threadpoolctl import threadpool_limits
from tqdm.auto import tqdm

from go1_mtl_gym.errors import Go1Error, InvalidInputError
from go1_mtl_gym.validation import number_in
from trainers.utils.files import json_ready, write_json


class Part(Protocol):
    """One part of a report; picklable."""

    section: Any
    """With `alone`: whether nothing else may run meanwhile, because it measures time."""

    def measure(self) -> dict[str, Any]:
        """The finished part, as `finished` gives it."""


def digest(words: Iterable[str]) -> str:
    """12 hexadecimal digits that change with any of the words."""
    total = hashlib.sha256()
    for word in words:
        total.update(word.encode())
    return total.hexdigest()[:12]


def sources(*packages: ModuleType) -> str:
    """The code and the robot descriptions of some packages, as one text."""
    folders = [Path(package.__file__).parent for package in packages]
    files = sorted(path for folder in folders for kind in ("*.py", "*.xml") for path in folder.rglob(kind))
    return "\n".join(path.read_text(encoding="utf-8") for path in files)


def finished(path: Path, measure: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """A finished part: read from `path` if it is there, else measured on one thread, timed and written there."""
    if path.is_file():
        return json.loads(path.read_text(encoding="utf-8"))
    start = time.monotonic()
    with threadpool_limits(1):
        part = measure()
    part["seconds"] = round(time.monotonic() - start, 2)
    write_json(path, part)
    return json_ready(part)


def measure_all(parts: Sequence[Part], n_jobs: int) -> list[dict[str, Any]]:
    """Measure what is not there yet, in processes side by side; what measures time comes last, alone."""
    together = [part for part in parts if not part.section.alone]
    ordered = [*together, *(part for part in parts if part.section.alone)]
    with tqdm(total=len(ordered), desc="report", unit="part") as bar:
        return [_shown(bar, part) for part in _results(together, ordered[len(together) :], n_jobs)]


def _results(together: list[Part], alone: list[Part], n_jobs: int) -> Iterator[dict[str, Any]]:
    if n_jobs == 1:
        yield from (part.measure() for part in together)
    else:
        parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator")
        yield from parallel(joblib.delayed(methodcaller("measure"))(part) for part in together)
    yield from (part.measure() for part in alone)


def _shown(bar: tqdm, part: dict[str, Any]) -> dict[str, Any]:
    bar.set_postfix_str(" ".join(part[name] for name in ("section", "task", "what") if name in part))
    bar.update()
    return part


def report_parser(description: str, parts: Path, seed: str) -> argparse.ArgumentParser:
    """A command line with what all reports can be told; `parse_report` reads it.

    Args:
        description: of the report.
        parts: default folder of finished parts.
        seed: what the seed is of.
    """
    style = argparse.ArgumentDefaultsHelpFormatter
    parser = argparse.ArgumentParser(description=description, formatter_class=style)
    add = parser.add_argument
    add("--quick", action="store_true", help="little of everything, to see that everything works")
    add("--seed", type=int, default=1, help=seed)
    add("--n-jobs", type=int, default=os.cpu_count() or 1, help="processes")
    add("--parts", type=Path, default=parts, help="folder of finished parts, from which an interrupted run goes on")
    return parser


def parse_report(
    parser: argparse.ArgumentParser, arguments: Sequence[str] | None, distinct: Sequence[str] = ()
) -> argparse.Namespace:
    """Read a report's command line.

    Args:
        parser: see `report_parser`.
        arguments: without the program's name; None are the process's own.
        distinct: names of lists in which nothing may stand twice.

    Raises:
        InvalidInputError: for an impossible number of processes or seed, or something that was named twice.
    """
    options = parser.parse_args(arguments)
    if options.seed is not None:
        number_in(options.seed, 0, 2**31 - 1, "seed")
    number_in(options.n_jobs, 1, 1024, "n_jobs")
    for name in distinct:
        own = getattr(options, name) or []
        if len(set(own)) != len(own):
            raise InvalidInputError(f"something was named twice in {name}: {' '.join(map(str, own))}")
    return options


def exit_status(main: Callable[[list[str] | None], int]) -> Callable[[list[str] | None], int]:
    """A report's command that ends with a status: 2 and one line for bad input, 130 for Ctrl-C."""

    @functools.wraps(main)
    def run(arguments: list[str] | None = None) -> int:
        try:
            return main(arguments)
        except Go1Error as error:
            print(f"error: {error}", file=sys.stderr)
            return 2
        except KeyboardInterrupt:
            print("\ninterrupted; finished parts are kept, the same command goes on from there", file=sys.stderr)
            return 130

    return run
