"""The main job: expert demonstrations, cloning, DAgger, evaluation, pictures.

    python examples/dagger.py                      about half an hour on two quiet cores, results under runs/<date>
    python examples/dagger.py --preset smoke       a few minutes, to see that everything works

Every stage leaves its result on disk; Ctrl-C keeps what is done and the same command with ``--out`` goes on from there.
"""

import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import trainers
from go1_mtl_gym.rendering import RenderingError
from trainers.pipeline.command_line import parse_job
from trainers.utils.cli import interpreter, main

SMOKE = """
So little training gives a robot that falls: the smoke preset only shows that every stage works. Without --preset the
same command trains the robot of the README."""


def train(job: trainers.Job) -> dict[str, Any]:
    """The stages in order; returns what ``metrics.json`` holds."""
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


def summary(metrics: dict[str, Any], out: Path) -> str:
    """The table of results, where they are, and what to do with them."""
    files = {
        "policy.zip": "the trained policy",
        "phase_free.zip": "the same without a clock",
        "metrics.json": "everything measured",
        "gaits.gif": "the policy in every gait",
    }
    width = len(str(out / max(files, key=len)))
    there = [f"  {str(out / name):{width}}  {files[name]}" for name in files if (out / name).is_file()]
    lines = [
        trainers.results_table(metrics),
        "\nresults:",
        *there,
        f"watch the training:  {interpreter()} -m tensorboard.main --logdir {shlex.quote(str(out / 'tensorboard'))}",
        f"run the policy:      {interpreter()} examples/quickstart.py {shlex.quote(str(out / 'policy.zip'))}",
    ]
    return "\n".join(lines)


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Run the job from the command line."""
    config, folder = parse_job(arguments)
    out = Path(folder or time.strftime("runs/%Y-%m-%d_%H-%M-%S"))
    command = shlex.join(["python", "examples/dagger.py", *(sys.argv[1:] if arguments is None else arguments)])
    job = trainers.Job(config, out, command=command, progress=True)
    try:
        metrics = train(job)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"what is done is kept, go on with: --out {shlex.quote(str(out))}") from None
    (out / "table.md").write_text(trainers.results_table(metrics) + "\n", encoding="utf-8")
    print(f"\n{summary(metrics, out)}")
    if config.preset == "smoke":
        print(SMOKE)


if __name__ == "__main__":
    raise SystemExit(run())
