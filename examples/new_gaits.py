"""New gaits for a trained policy: a head on its frozen trunk, all of it tuned with rehearsal, or a network of its own.

A head learns from demonstrations alone, or from half as many and a round of DAgger in which the expert takes over when
the student goes astray; all methods get labels for equally many seconds. It takes about two hours of one core.

python examples/new_gaits.py                          pace and gallop for the student that comes with the package
python examples/new_gaits.py --policy runs/default/policy.zip --gaits gallop             Ctrl-C and it goes on later
python examples/new_gaits.py --quick --out-dir runs/quick                                a minute's worth

Writes new_gaits.json and new_gaits.png and prints a table: success, survival and R2 by seconds of demonstrations.
"""

import argparse
import dataclasses
import shlex
import sys
from pathlib import Path
from typing import Any

from expert_report.figures import save_figure
from gait_report.config import QUICK, NewGaitsConfig
from gait_report.page import new_gaits_figure, new_gaits_table
from gait_report.parts import assembled, parts_of, prepare
from publishing.runs import without_out
from report_parts import exit_status, measure_all, parse_report, report_parser
from student_report.lab import Walker

from trainers.policies.checkpoint import load, versions
from trainers.policies.pretrained import FOLDER
from trainers.utils.files import write_json

OUT = Path("docs/results")
PARTS = Path("runs/new_gaits")
GAITS = ("pace", "gallop")


def report(options: argparse.Namespace) -> dict[str, Any]:
    """Everything that was measured, and how to measure it again.

    Raises:
        Go1Error: if the policy or a gait is not as expected.
    """
    config = QUICK if options.quick else NewGaitsConfig()
    load(options.policy)  # whatever is wrong with the file is said before it is read for its digest
    base = Walker.student("base", options.policy)
    parts = parts_of(base, options.gaits, config, options.seed, options.parts)
    if not all(part.path.is_file() for part in parts):
        prepare(parts, options.n_jobs)
    results = measure_all(parts, options.n_jobs)
    return assembled(parts, results) | {
        "config": dataclasses.asdict(config),
        "policies": {"base": base.sha256},
        "seed": options.seed,
        "versions": versions(),
        "seconds": {"new_gaits": round(sum(result["seconds"] for result in results), 1)},
    }


def parse(arguments: list[str]) -> argparse.Namespace:
    """Read the command line.

    Raises:
        InvalidInputError: for an impossible number.
    """
    description = "Teach a trained policy gaits that it does not know, in several ways, and measure how it walks."
    parser = report_parser(description, PARTS, seed="of the evaluation's commands and resets")
    add = parser.add_argument
    add("--policy", type=Path, default=Path(str(FOLDER / "clocked.zip")), help="file of the trained policy")
    add("--gaits", nargs="+", default=list(GAITS), help="that the policy does not know")
    add("--out-dir", type=Path, default=OUT, help="folder of the results and the figure")
    return parse_report(parser, arguments)


@exit_status
def main(arguments: list[str] | None = None) -> int:
    """Run from the command line; returns the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    command = without_out(shlex.join(["python", "examples/new_gaits.py", *arguments]))
    options = parse(arguments)
    data = report(options) | {"command": command}
    path = options.out_dir / "new_gaits.json"
    write_json(path, data)
    picture = save_figure(new_gaits_figure(data), path.with_suffix(".png"))
    print(f"\n{new_gaits_table(data)}\n\nresults: {path}\npicture: {picture}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
