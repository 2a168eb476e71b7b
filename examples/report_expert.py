"""The expert's report card: how well, how far, how hard and how fast it goes, every gait, every figure measured.

python examples/report_expert.py                               everything; Ctrl-C and the same command goes on
python examples/report_expert.py --tasks trot --sections pushes --out p.json   only some of it
python examples/report_expert.py --quick --out quick.json      a minute's worth, to see that everything works

The file holds what this command asked for and nothing else; whatever part was measured before is taken from --parts.
"""

import argparse
import dataclasses
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from expert_report.bars import compare
from expert_report.figures import save_figures
from expert_report.page import card_table, totals_text
from expert_report.parts import QUICK, SECTIONS, Part, Section
from publishing.runs import without_out
from report_parts import exit_status, measure_all, parse_report, report_parser

from go1_mtl_gym import TASKS
from go1_mtl_gym.validation import number_in
from trainers.policies.checkpoint import versions
from trainers.utils.files import write_json

OUT = Path("docs/results/expert.json")
PARTS = Path("runs/expert")
STEPS_WANTED = 1_000_000
"""Control steps without a NaN and without an exception that the report asks for."""


def sections(options: argparse.Namespace) -> dict[str, Section]:
    """The sections asked for, with their settings."""
    chosen = {}
    for name in options.sections:
        config = SECTIONS[name].config
        if options.quick:
            config = dataclasses.replace(config, **QUICK[name])
        if name == "soak" and options.soak_steps is not None:
            config = dataclasses.replace(config, steps=-(-options.soak_steps // len(options.tasks)))
        if hasattr(config, "tasks"):
            config = dataclasses.replace(config, tasks=tuple(options.tasks))
        chosen[name] = dataclasses.replace(SECTIONS[name], config=config)
    return chosen


def report(options: argparse.Namespace) -> dict[str, Any]:
    """Everything that was measured, and what is needed to measure it again."""
    chosen = sections(options)
    parts = [
        Part(name, task, section, options.seed, options.control_hz, options.parts)
        for name, section in chosen.items()
        for task in options.tasks
        if section.tasks is None or task in section.tasks
    ]
    return assemble(measure_all(parts, options.n_jobs), chosen, options)


def assemble(
    parts: Sequence[dict[str, Any]], chosen: dict[str, Section], options: argparse.Namespace
) -> dict[str, Any]:
    """Put the parts together: {"tasks": closed loop, as `trainers.evaluate` gives it, "report": {section: {task}}}."""
    found: dict[str, dict[str, Any]] = {name: {} for name in chosen}
    seconds = dict.fromkeys(chosen, 0.0)
    for part in parts:
        found[part["section"]][part["task"]] = part["figures"]
        seconds[part["section"]] = round(seconds[part["section"]] + part["seconds"], 1)
    walks = found.pop("survival", {})
    scores = {
        "tasks": {task: walk["fixed"] for task, walk in walks.items()},
        "report": {"changing": {task: walk["changing"] for task, walk in walks.items()}} | found,
    }
    return scores | {
        "bars": compare(scores),
        "totals": totals(parts),
        "config": config(chosen, options),
        "seed": options.seed,
        "versions": versions(),
        "seconds": seconds,
    }


def config(chosen: dict[str, Section], options: argparse.Namespace) -> dict[str, Any]:
    """Settings, per section; those of the first section also under the names that other reports use."""
    settings = {
        "control_hz": options.control_hz,
        "command_range": {task: TASKS[task].command_range for task in options.tasks},
        "sections": {name: dataclasses.asdict(section.config) for name, section in chosen.items()},
    }
    if "survival" in chosen:
        own = chosen["survival"].config
        settings |= {"episodes": own.episodes, "episode_s": own.seconds}
    return settings


def totals(parts: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Sums of all ledgers, and whether enough steps passed without a NaN and without an exception."""
    sums = {name: sum(part["ledger"][name] for part in parts) for name in parts[0]["ledger"]} if parts else {}
    flawless = bool(parts) and sums["bad_actions"] == sums["unhandled"] == 0
    return sums | {"wanted": STEPS_WANTED, "passed": flawless and sums["calls"] >= STEPS_WANTED}


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line.

    Raises:
        InvalidInputError: for an impossible number, or something that was named twice.
    """
    description = "Measure the expert in closed loop and write its report card."
    parser = report_parser(description, PARTS, seed="of commands, resets and kicks")
    add = parser.add_argument
    add("--tasks", nargs="+", choices=tuple(TASKS), default=list(TASKS), help="gaits")
    add("--sections", nargs="+", choices=tuple(SECTIONS), default=list(SECTIONS), help="what is measured")
    add("--control-hz", type=int, default=50, help="rate of the expert and of the joint targets [Hz]")
    add("--soak-steps", type=int, default=None, help="control steps of the long walk, over all gaits; None: 35000 each")
    add("--out", type=Path, default=OUT, help="file of the results; figures go beside it")
    options = parse_report(parser, arguments, distinct=("tasks", "sections"))
    if options.soak_steps is not None:
        number_in(options.soak_steps, 0, 1e9, "soak_steps")
    return options


@exit_status
def main(arguments: list[str] | None = None) -> int:
    """Run from the command line; returns the exit status."""
    arguments = sys.argv[1:] if arguments is None else arguments
    options = parse(arguments)
    scores = report(options)
    scores["command"] = without_out(shlex.join(["python", "examples/report_expert.py", *arguments]))
    write_json(options.out, scores)
    pictures = save_figures(scores, options.out.parent)
    print(f"\n{card_table(scores)}\n\n{totals_text(scores['totals'])}\n\nreport card: {options.out}")
    print("\n".join(f"picture: {path}" for path in pictures))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
