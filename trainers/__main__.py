"""``python -m trainers``: what is done with a finished policy.

``play`` drives it, ``certify POLICY --out FOLDER`` finds out what it can be trusted with. A policy is a file, "clocked"
or "phase_free" (those in the package), or "expert".
"""

import argparse
from collections.abc import Sequence
from typing import Any

import trainers
from go1_mtl_gym import TASKS
from trainers.utils.cli import main, positive_float, positive_int, writable_folder

QUICK: dict[str, Any] = {"episodes": 4, "seconds": 5.0, "tours": 2, "tour_seconds": 10.0}
"""Everything is done and nothing shown."""


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Do what a command says."""
    options = parser().parse_args(arguments)
    if options.command == "play":
        from trainers.play.program import run as play

        play(options)
    else:
        _certify(vars(options))


def _certify(given: dict[str, Any]) -> None:
    """Certify a policy, and film what failed."""
    given.pop("command")
    out, videos, quick = writable_folder(given.pop("out")), given.pop("video"), given.pop("quick")
    policy, n_jobs, robot = given.pop("policy"), given.pop("jobs"), given.pop("robot")
    options = (QUICK if quick else {}) | {name: value for name, value in given.items() if value is not None}
    if robot is not None:
        options["robot"] = robot
    try:
        certificate = trainers.certify(policy, out, n_jobs=n_jobs, progress=True, **options)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"finished cells are in {out}; the same command goes on") from None
    met = sum(cell.verdict == "met" for cell in certificate.cells)
    print(f"{met} of {len(certificate.cells)} claims are met; {out / 'certificate.md'} has them all")
    if videos:
        from trainers.evaluation.replay import film_failures

        film_failures(certificate, policy, out / "videos", videos)


def parser() -> argparse.ArgumentParser:
    """The options; None stands for a default, such as that of `trainers.certify`."""
    from trainers.evaluation.conditions import CONDITIONS
    from trainers.play.program import add_arguments

    program = argparse.ArgumentParser(prog="python -m trainers", description="What is done with a finished policy.")
    commands = program.add_subparsers(dest="command", required=True)
    add_arguments(commands.add_parser("play", help="drive a policy or the expert, in a window or for a film"))
    add = commands.add_parser(
        "certify", help="what a policy can be trusted with, as a JSON file and a page"
    ).add_argument
    add("policy", help='file of a policy, "clocked" or "phase_free" (in the package), or "expert"')
    add("--out", required=True, help="folder of the certificate; an interrupted one goes on in the same folder")
    add("--tasks", nargs="+", choices=tuple(TASKS), help="gaits (default: all that the policy knows)")
    add("--conditions", nargs="+", choices=tuple(CONDITIONS), help="conditions (default: all)")
    add("--claim", type=float, help="success rate that is claimed of the operator (default: 0.99)")
    add("--allowed-failures", type=int, help="failures that a claim bears in the end (default: 1)")
    add("--episodes", type=positive_int, help="largest number per gait and condition (default: what the claim needs)")
    add("--seconds", type=positive_float, help="of an episode (default: 30)")
    add("--tours", type=positive_int, help="largest number of tours (default: 100)")
    add("--tour-seconds", type=positive_float, help="of a tour (default: 90)")
    add("--seed", type=int, help="of all episodes (default: 1)")
    add("--jobs", type=int, default=1, help="processes (default: 1)")
    add("--reference", help="another policy, which has the same episodes")
    add("--no-early-stop", dest="stop_early", action="store_false", default=None, help="do all episodes of every cell")
    add("--quick", action="store_true", help="a few short episodes per cell, which show nothing")
    add("--video", type=positive_int, nargs="?", const=5, metavar="N", help="film N failed episodes (default: 5)")
    add("--robot", metavar="PATH", help="MJCF file of another Go1")
    return program


if __name__ == "__main__":
    raise SystemExit(run())
