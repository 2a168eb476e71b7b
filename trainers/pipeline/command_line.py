"""The main job's options on the command line."""

import argparse
import os
from collections.abc import Sequence

from go1_mtl_gym import TASKS
from go1_mtl_gym.sensing.observation import CHANNELS
from trainers.pipeline.config import PRESETS, JobConfig


def parse_job(arguments: Sequence[str] | None = None) -> tuple[JobConfig, str | None]:
    """Read the command line; ``--help`` and unknown options end the program, as `argparse` has it.

    Args:
        arguments: the words after the program's name; None takes those of this process.

    Returns:
        The settings, and the output folder (None: choose one).

    Raises:
        InvalidInputError: if a setting cannot be.
    """
    given = vars(job_parser().parse_args(arguments))
    out, preset = given.pop("out"), given.pop("preset")
    options = {name: value for name, value in given.items() if value is not None}
    return JobConfig.from_preset(preset, **options), out


def job_parser() -> argparse.ArgumentParser:
    """The options; None stands for the preset's value."""
    parser = argparse.ArgumentParser(
        description="Teach one network several gaits of a Go1 from an MPC expert, and measure how well it moves.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add(
        "--preset",
        choices=[*PRESETS],
        default="default",
        help="smoke: a few minutes; default: about half an hour on two quiet cores; shipped, for policies like those "
        "in the package: one to two hours (an estimate); paper: a day (an estimate)",
    )
    add("--out", help="folder of the results; an interrupted run goes on in the same one (default: runs/<date>)")
    add("--tasks", nargs="+", choices=tuple(TASKS), help="gaits, in head order; the preset's if not given")
    add("--rounds", type=int, default=None, help="DAgger rounds; the preset's if not given")
    add("--seed", type=int, default=0, help="of everything random")
    add("--n-envs", type=int, default=os.cpu_count() or 1, help="worker processes")
    add("--device", default="cpu", help="of the training: cpu or cuda")
    add(
        "--channels",
        nargs="*",
        choices=tuple(CHANNELS),
        default=None,
        help="parts of the observation; the preset's if not given",
    )
    add("--history", type=int, default=None, help="proprioceptive frames in the observation; the preset's if not given")
    add("--control-hz", type=int, default=None, help="rate of the policy; the preset's if not given")
    return parser
