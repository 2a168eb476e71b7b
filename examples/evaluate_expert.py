"""Score the expert in closed loop: every gait, drawn commands, from a standing start.

python examples/evaluate_expert.py                                  20 commands x 30 s per gait
python examples/evaluate_expert.py --tasks trot --episodes 1 --seconds 5 --out trot.json
"""

import argparse
import os
import shlex
import sys
import time
from pathlib import Path
from typing import Any

from publish_results import without_out

import trainers
from go1_mtl_gym import TASKS, Go1Error
from trainers.checkpoint import versions
from trainers.files import write_json
from trainers.report import closed_loop_table

OUT = Path("docs/results/expert.json")


def evaluate(options: argparse.Namespace) -> dict[str, Any]:
    """Scores per task with the record of every episode, and what is needed to make them again."""
    start = time.monotonic()
    tasks = {}
    for task in options.tasks:
        result = trainers.evaluate(
            "expert",
            task,
            options.episodes,
            options.seconds,
            options.seed,
            n_jobs=options.n_jobs,
            progress=True,
            control_hz=options.control_hz,
        )
        tasks[task] = result.as_dict()
    return {
        "tasks": tasks,
        "config": {
            "episodes": options.episodes,
            "episode_s": options.seconds,
            "control_hz": options.control_hz,
            "command_range": {task: TASKS[task].command_range for task in options.tasks},
        },
        "seed": options.seed,
        "versions": versions(),
        "seconds": {"evaluation": round(time.monotonic() - start, 1)},
    }


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description="Score the expert in closed loop and write the records of all episodes.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add("--tasks", nargs="+", choices=tuple(TASKS), default=list(TASKS), help="gaits")
    add("--episodes", type=int, default=20, help="drawn commands per gait")
    add("--seconds", type=float, default=30.0, help="duration of an episode [s]")
    add("--seed", type=int, default=1, help="of commands and resets")
    add("--n-jobs", type=int, default=os.cpu_count() or 1, help="processes")
    add("--control-hz", type=int, default=50, help="rate of the expert and of the joint targets [Hz]")
    add("--out", type=Path, default=OUT, help="file of the results")
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Run from the command line; returns the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    options = parse(arguments)
    try:
        scores = evaluate(options)
    except Go1Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    scores["command"] = without_out(shlex.join(["python", "examples/evaluate_expert.py", *arguments]))
    write_json(options.out, scores)
    print(f"\n{closed_loop_table(scores['tasks'])}\n\nrecords of all episodes: {options.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
