"""``go1-mtl-gym certify POLICY --out FOLDER``."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tyro

from go1_mtl_gym.validation import integer_in
from trainers.cli.names import Conditions, Gaits
from trainers.cli.options import Unless, parse, values_of, with_number
from trainers.utils.cli import writable_folder

QUICK: dict[str, Any] = {"episodes": 4, "seconds": 5.0, "tours": 2, "tour_seconds": 10.0}
"""Everything is done and nothing shown."""
FILMS = 5
"""How many failed episodes are filmed unless told otherwise."""


@dataclasses.dataclass(frozen=True)
class Options:
    """Find out what a policy can be trusted with, gait by gait and condition by condition.

    Attributes:
        policy: File of a policy, "clocked" or "phase_free" (in the package), or "expert".
        out: Folder of the certificate; an interrupted one goes on in the same folder.
        tasks: Gaits; all that the policy knows if not given.
        conditions: Conditions; all if not given.
        claim: Success rate that is claimed of the operator.
        allowed_failures: Failures that a claim bears in the end.
        episodes: Largest number per gait and condition; what the claim needs if not given.
        seconds: Duration of an episode [s] (30 if not given).
        tours: Largest number of tours (100 if not given).
        tour_seconds: Duration of a tour [s] (90 if not given).
        seed: Of all episodes.
        jobs: Processes.
        reference: Another policy, which has the same episodes.
        no_early_stop: Do all episodes of every cell.
        quick: A few short episodes per cell, which show nothing.
        video: Film so many failed episodes; 5 if no number follows.
        robot: MJCF file of another Go1.
    """

    policy: tyro.conf.Positional[str]
    out: Path
    tasks: Gaits = ()
    conditions: Conditions = ()
    claim: float = 0.99
    allowed_failures: int = 1
    episodes: Unless[int] = None
    seconds: Unless[float] = None
    tours: Unless[int] = None
    tour_seconds: Unless[float] = None
    seed: int = 1
    jobs: int = 1
    reference: Unless[str] = None
    no_early_stop: bool = False
    quick: bool = False
    video: Unless[int] = None
    robot: Unless[str] = None


def run(words: Sequence[str]) -> None:
    """Certify a policy, and film what failed."""
    options = parse(Options, with_number(words, "--video", FILMS), "certify")
    given = values_of(options)
    out, videos, quick = writable_folder(given.pop("out")), given.pop("video"), given.pop("quick")
    policy, n_jobs, all_episodes = given.pop("policy"), given.pop("jobs"), given.pop("no_early_stop")
    if videos is not None:
        integer_in(videos, 1, 10**6, "video")
    chosen = (QUICK if quick else {}) | {name: value for name, value in given.items() if value not in (None, ())}
    if all_episodes:
        chosen["stop_early"] = False
    import trainers

    try:
        certificate = trainers.certify(policy, out, n_jobs=n_jobs, progress=True, **chosen)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"finished cells are in {out}; the same command goes on") from None
    met = sum(cell.verdict == "met" for cell in certificate.cells)
    for cell in certificate.cells:
        print(f"{cell.name}: {cell.verdict}, {cell.survived} of {cell.trials} survived, {cell.succeeded} succeeded")
    nothing = " A quick run is too short to show any." if quick else ""
    print(f"{met} of {len(certificate.cells)} claims are met; {out / 'certificate.md'} has them all.{nothing}")
    if videos:
        from trainers.evaluation.replay import film_failures

        film_failures(certificate, policy, out / "videos", videos)
