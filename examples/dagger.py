"""The main job: expert demonstrations, cloning, DAgger, evaluation, pictures.

    python examples/dagger.py                      about half an hour on two quiet cores, results under runs/<date>
    python examples/dagger.py --preset smoke       a few minutes, to see that everything works

``go1-mtl-gym train`` is the same; here its stages can be read. Every stage leaves its result on disk; Ctrl-C keeps what
is done and the same command with ``--out`` goes on from there.
"""

import shlex
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from trainers.cli.train import parse_job
from trainers.utils.cli import interpreter, main

if TYPE_CHECKING:
    import trainers


def train(job: "trainers.Job") -> dict[str, Any]:
    """The stages in order; returns what ``metrics.json`` holds."""
    from go1_mtl_gym.rendering import RenderingError

    rows, held_out = job.demonstrations()
    policy = job.clone(rows, held_out)
    policy = job.dagger(policy, rows, held_out)
    policies = {"multi_head": policy, **job.phase_free(policy), **job.baselines()}
    metrics = job.evaluate(policies, held_out)
    try:
        job.draw(policy, held_out)
    except RenderingError as error:
        print(f"no videos: {error}")
    return metrics


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Run the job from the command line."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    config, out = parse_job(words, "examples/dagger.py")
    from trainers.pipeline.main_job import run_job  # PyTorch, for which --help does not wait

    command = shlex.join(["python", "examples/dagger.py", *words])
    run_job(config, out, command, f"{interpreter()} examples/quickstart.py", train, table=True)


if __name__ == "__main__":
    raise SystemExit(run())
