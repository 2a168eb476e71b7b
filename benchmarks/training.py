"""How fast does the student learn, next to a bare loop of PyTorch, to `imitation` and to numpy?

    python benchmarks/training.py                                       every section on this machine's processor
    python benchmarks/training.py --sections step heads --rounds 5      some of it
    python benchmarks/training.py --device cuda                         on a GPU, with the data there and large batches
    python benchmarks/training.py --quick                               little of everything, to see that it works
    python benchmarks/training.py --out docs/results/benchmark_training.json

Everybody takes turns in one process, round after round, and is compared within each round. See benchmarks/README.md.
"""

import argparse
import dataclasses
import json
import shlex
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from tqdm.auto import tqdm
from training_parts import rows, steps
from training_parts.settings import QUICK, Settings, machine
from training_parts.timing import Heat, run

from go1_mtl_gym import Go1Error
from trainers.policies.checkpoint import versions
from trainers.utils.files import json_ready, write_json
from trainers.utils.report import training_table

SECTIONS: dict[str, tuple[str, Callable[[Settings], Iterator[Heat]]]] = {
    "step": ("gradient steps", steps.step),
    "heads": ("gradient steps by number of heads", steps.heads),
    "precision": ("gradient steps by precision", steps.precision),
    "reading": ("demonstrations from disk", rows.reading),
    "shuffling": ("shuffled batches", rows.shuffling),
    "collection": ("collecting demonstrations", rows.collection),
}
"""Name -> what is measured, and how."""
GPU_DEFAULTS = {"batch_size": 65_536, "rows": 1_800_000, "steps": 50}
"""What a GPU gets unless the command line says otherwise."""


def measure(options: argparse.Namespace) -> dict[str, Any]:
    """The sections asked for; with `--resume`, those that the same command wrote to the file are taken from there.

    After every section the file is written.
    """
    settings = options.settings
    result = {
        "config": dataclasses.asdict(settings),
        "seed": settings.seed,
        "machine": machine(settings),
        "versions": versions(),
        "command": options.command,
        "sections": {},
    }
    if options.resume:
        result["sections"] |= _finished(options.out, json_ready(result))
    for name in options.sections:
        if name not in result["sections"]:
            result["sections"][name] = _section(name, settings)
            if options.out is not None:
                write_json(options.out, result)
    return result


def _section(name: str, settings: Settings) -> dict[str, Any]:
    meaning, heats_of = SECTIONS[name]
    heats = list(heats_of(settings))
    with tqdm(total=len(heats) * settings.rounds, desc=name, unit="round") as bar:
        return {"meaning": meaning, "rows": [row for heat in heats for row in run(heat, settings.rounds, bar.update)]}


def _finished(path: Path, wanted: dict[str, Any]) -> dict[str, Any]:
    """Sections in a file that the same command made, on the same machine, with the same versions."""
    if not path.is_file():
        return {}
    found = json.loads(path.read_text(encoding="utf-8"))
    same = all(found.get(name) == wanted[name] for name in ("command", "config", "machine", "versions"))
    return found["sections"] if same else {}


def parse(arguments: list[str]) -> argparse.Namespace:
    """Read the command line.

    Raises:
        InvalidInputError: for an impossible number, or a device that is not there.
    """
    parser = argparse.ArgumentParser(description="Time the training next to others.")
    numbers = [field for field in dataclasses.fields(Settings) if field.name != "device"]
    parser.add_argument("--sections", nargs="+", choices=tuple(SECTIONS), default=list(SECTIONS), help="what to time")
    parser.add_argument("--device", default="cpu", help="of the gradient steps: cpu (default) or cuda")
    parser.add_argument("--quick", action="store_true", help="little of everything")
    parser.add_argument("--out", type=Path, default=None, help="file of the results")
    parser.add_argument("--resume", action="store_true", help="go on with an interrupted run of this command")
    for field in numbers:
        several = isinstance(field.default, tuple)
        kind = type(field.default[0] if several else field.default)
        name, many = f"--{field.name.replace('_', '-')}", {"nargs": "+"} if several else {}
        parser.add_argument(name, type=kind, default=None, help=f"default {field.default}", **many)
    options = parser.parse_args(arguments)
    if options.resume and options.out is None:
        parser.error("--resume needs --out")
    chosen = GPU_DEFAULTS if options.device != "cpu" else {}
    chosen = chosen | (QUICK if options.quick else {})
    for field in numbers:
        value = getattr(options, field.name)
        if value is not None:
            chosen[field.name] = tuple(value) if isinstance(value, list) else value
    options.settings = Settings(device=options.device, **chosen)
    return options


def published(arguments: list[str]) -> str:
    """The command line without the file of the results and without what only says how to go on."""
    words, kept = iter(arguments), []
    for word in words:
        if word.partition("=")[0] == "--out":
            next(words, None) if word == "--out" else None
        elif word != "--resume":
            kept.append(word)
    return shlex.join(["python", "benchmarks/training.py", *kept])


def main(arguments: list[str] | None = None) -> int:
    """Run from the command line; returns the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        options = parse(arguments)
        options.command = published(arguments)
        result = measure(options)
    except Go1Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(training_table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
