"""The machine: cores, threads, a GPU, and where files can be written."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from go1_mtl_gym.errors import InvalidInputError
from trainers.cli.checks.finding import FAILED, NOTE, OK, WARNING, Finding, tried
from trainers.utils.cli import writable_folder

ENOUGH_GB = 1.0
"""A run of the default preset leaves about half of it."""
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_TORCH = """
import json, torch
gpu = torch.cuda.is_available()
print(json.dumps({"gpu": torch.cuda.get_device_name() if gpu else "", "version": torch.__version__}))
"""


def cores() -> Iterator[Finding]:
    """How many there are, how many this process may use, and how busy they are."""
    count = os.cpu_count() or 1
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else count
    text, remedy = f"{count}", ""
    if usable < count:
        text, remedy = (
            f"{usable} of {count} may be used",
            f"go1-mtl-gym train --n-envs {usable}; --jobs {usable} elsewhere",
        )
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    busy = load > 0.5 * usable
    text += f", load {load:.1f}{': they have other work, and everything takes longer' if busy else ''}"
    yield Finding("cores", WARNING if remedy else NOTE if busy else OK, text, remedy)
    given = {name: os.environ[name] for name in THREADS if os.environ.get(name)}
    several = {name: value for name, value in given.items() if value != "1"}
    if several:
        listed = ", ".join(f"{name}={value}" for name, value in several.items())
        remedy = "unset them, or set them to 1: worker processes run side by side"
        yield Finding("threads", WARNING, listed, remedy)
    else:
        yield Finding("threads", OK, "one per worker process; `train --threads N` gives the training more")


def gpu() -> Iterator[Finding]:
    """Whether PyTorch sees one; none is needed."""
    answer, reason = tried(_TORCH)
    if reason:
        yield Finding(
            "PyTorch", FAILED, f"cannot be imported: {reason}", "python -m pip install --force-reinstall torch"
        )
    elif answer["gpu"]:
        yield Finding("GPU", OK, f"{answer['gpu']}: `train --device cuda` trains on it")
    elif shutil.which("nvidia-smi"):
        remedy = "install PyTorch's CUDA build, by pytorch.org; networks this small train as well on the CPU"
        yield Finding("GPU", WARNING, f"there is one, and torch {answer['version']} does not see it", remedy)
    else:
        yield Finding("GPU", OK, "none, and none is needed: networks this small train on the CPU")


def files() -> Iterator[Finding]:
    """Whether results can be written here, and temporary files."""
    for folder, remedy in (
        (Path("runs"), "go elsewhere, or give --out"),
        (Path(tempfile.gettempdir()), "export TMPDIR=FOLDER"),
    ):
        try:
            writable_folder(folder)
        except InvalidInputError as error:
            yield Finding("files", FAILED, str(error), remedy)
            continue
        present = next(place for place in (folder, *folder.absolute().parents) if place.exists())
        free = shutil.disk_usage(present).free / 1e9
        enough = free >= ENOUGH_GB
        text = f"{folder} can be written, {free:.1f} GB free"
        yield Finding(
            "files", OK if enough else WARNING, text, "" if enough else "a run takes about half a GB: make room"
        )
