"""The main job on the command line, from its options to its last sentence."""

import shlex
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from go1_mtl_gym.rendering import RenderingError
from trainers.pipeline.config import JobConfig
from trainers.pipeline.job import Job
from trainers.pipeline.summary import summary
from trainers.utils.cli import interpreter
from trainers.utils.files import read_object, write_atomically
from trainers.utils.folder_lock import alone_in
from trainers.utils.report import results_table

Stages = Callable[[Job], dict[str, Any]]
"""Runs the stages of a job; returns what ``metrics.json`` holds."""


def run_job(
    config: JobConfig, out: Path | None, command: str, drive: str, stages: Stages | None = None, table: bool = False
) -> None:
    """All stages, with progress, and what there is to say at the end.

    Args:
        config: what to do.
        out: folder of the results; None chooses ``runs/<date>``.
        command: how the run was started.
        drive: the command that drives a policy, whose file comes behind it.
        stages: in place of `all_stages`.
        table: print the table of all gaits and learners, too.

    Raises:
        InvalidInputError: as of `Job`, or if another process is at work in the folder.
        KeyboardInterrupt: says how to go on.
    """
    folder = Path(time.strftime("runs/%Y-%m-%d_%H-%M-%S")) if out is None else out
    job = Job(config, folder, command=command, progress=True)  # refuses impossible settings before it makes the folder
    try:
        with alone_in(folder):
            metrics = (stages or all_stages)(job)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"what is done is kept, go on with: --out {shlex.quote(str(folder))}") from None
    results = results_table(metrics) + "\n"
    write_atomically(folder / "table.md", lambda file: file.write(results.encode()))
    print("\n".join(["", *([results] if table else []), summary(metrics, folder, next_steps(folder, drive))]))


def all_stages(job: Job) -> dict[str, Any]:
    """The stages in order; pictures only where they can be drawn."""
    try:
        return job.run()
    except RenderingError as error:
        print(f"no videos: {error}")
    return read_object(job.folder.metrics, "file of metrics")


def next_steps(folder: Path, drive: str) -> Mapping[str, str]:
    """What one may want now -> the command for it."""
    python, policy, gif, log = (
        interpreter(),
        *(shlex.quote(str(folder / name)) for name in ("policy.zip", "gaits.gif", "tensorboard")),
    )
    steps = {"drive the policy": f"{drive} {policy}"}
    if (folder / "gaits.gif").is_file():
        steps["look at its gaits"] = f"{python} -m webbrowser {gif}"
    return steps | {"watch the training": f"{python} -m tensorboard.main --logdir {log}"}
