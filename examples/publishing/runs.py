"""The files of a run: which of them are published, and the command that made it."""

import json
import shlex
import shutil
from pathlib import Path
from typing import Any

from go1_mtl_gym.errors import InvalidInputError
from trainers.utils.files import write_json
from trainers.utils.report import results_table

COPIED = ("joint_targets.png", "gaits.gif")
"""Files of a run that are published as they are, next to ``metrics.json``."""
STUDENTS = {"policy.zip": "clocked.zip", "phase_free.zip": "phase_free.zip"}
"""Policies of a run, and their names in ``trainers/assets/``, from where `trainers.load_pretrained` reads them."""
PUBLISHED_PRESET = "default"
FOLDERS = ("--out", "--out-dir", "--parts")
"""Options of a command that say where its files go."""


def copy_run(run: Path, root: Path) -> None:
    """Copy what is published of a run; the output folder, which only its machine knows, is cut from the command.

    Args:
        run: output folder of the main job.
        root: of the checkout; results go to ``docs/results``, students to ``trainers/assets``.

    Raises:
        InvalidInputError: if files are missing (all are named), the metrics cannot be read, or the run is not one of
            the preset that is published.
    """
    results, students = root / "docs" / "results", root / "trainers" / "assets"
    missing = [name for name in ("metrics.json", *COPIED, *STUDENTS) if not (run / name).is_file()]
    if missing:
        raise InvalidInputError(
            f"{run} lacks {', '.join(missing)}; expected the --out folder of a finished examples/dagger.py"
            + (" (gaits.gif needs OpenGL)" if "gaits.gif" in missing else "")
        )
    metrics = read_json(run / "metrics.json")
    results_table(metrics)
    preset = metrics.get("config", {}).get("preset")
    if preset != PUBLISHED_PRESET:
        raise InvalidInputError(f"a run of the preset {PUBLISHED_PRESET!r} was expected, {run} is one of {preset!r}")
    metrics["command"] = without_out(metrics.get("command", "python examples/dagger.py"))
    write_json(results / "metrics.json", metrics)
    for name in COPIED:
        shutil.copyfile(run / name, results / name)
    students.mkdir(parents=True, exist_ok=True)
    for name, published in STUDENTS.items():
        shutil.copyfile(run / name, students / published)


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file.

    Raises:
        InvalidInputError: if the file is missing or holds something else.
    """
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InvalidInputError(f"there is no {path}") from error
    except ValueError as error:
        raise InvalidInputError(f"{path} is not JSON: {error}") from error
    if not isinstance(value, dict):
        raise InvalidInputError(f"{path} must hold a JSON object, got {type(value).__name__}")
    return value


def without_out(command: str) -> str:
    """A command line without the options that name folders of its machine (`FOLDERS`), and without their values."""
    words, kept = iter(shlex.split(command)), []
    for word in words:
        if word in FOLDERS:
            next(words, None)
        elif word.partition("=")[0] not in FOLDERS:
            kept.append(word)
    return shlex.join(kept)
