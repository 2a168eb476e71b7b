"""What ``python -m trainers play`` does with its options."""

import argparse
import dataclasses
import sys
from pathlib import Path
from typing import Any

from tqdm.auto import tqdm

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.rendering import has_display
from go1_mtl_gym.validation import one_of
from trainers.evaluation.agents import opened
from trainers.evaluation.certificate import Certificate
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.replay import certified_episode
from trainers.evaluation.script import Script
from trainers.evaluation.tour import DEFAULT_TOUR
from trainers.play.hands import Hands
from trainers.play.player import Player
from trainers.play.record import FilmFile, Recording, record
from trainers.play.session import EXPERT, Session
from trainers.policies.pretrained import PRETRAINED
from trainers.utils.cli import positive_int, writable_file
from trainers.utils.validation import checked_seed

ENDLESS_S = 1e6
"""Length of an episode that hands drive [s]."""
STAND = (0.0, 0.0, 0.0)
SEED = 1
FILM_SIZE, LARGE_FILM_SIZE = (640, 360), (1280, 720)
"""Width and height of a film without a window [pixels]: one that waits in memory until its end, and any other."""


def add_arguments(program: argparse.ArgumentParser) -> None:
    """Add the options of `play`."""
    add = program.add_argument
    add("--policy", help='file of a policy, "clocked" or "phase_free" (in the package; default: clocked), or "expert"')
    add("--task", help="gait to begin with (default: trot)")
    add("--seed", type=int, help=f"of the stand that it begins with (default: {SEED})")
    add("--script", metavar="FILE", help="JSON file of a trainers.Script, which drives instead of you")
    add("--save-script", metavar="FILE", help="write down what you do, since the last reset, as such a file")
    add("--replay", metavar="FILE", help="certificate.json or its folder: one of its episodes drives instead of you")
    add("--episode", metavar="NAME", help='which of them, such as "operator/trot/17"')
    add(
        "--record",
        metavar="FILE",
        help="film it: .mp4, .gif, .webp, or .png for the last picture; scripts and replays without a window",
    )
    add("--ghost", action="store_true", help="show the pose that the expert asks for")
    add("--size", type=positive_int, nargs=2, metavar=("WIDTH", "HEIGHT"), help="of window or film [pixels]")
    add("--fps", type=positive_int, default=25, help="pictures per second of the film (default: 25)")


def run(options: argparse.Namespace) -> None:
    """Let somebody play, or film what is played.

    Raises:
        Go1Error: if an option is not as described, or nothing can be shown on this machine.
    """
    _check_together(options)
    film = None if options.record is None else FilmFile(writable_file(options.record), options.fps)
    tape = None if options.save_script is None else writable_file(options.save_script)
    if options.record is not None and not has_window() and options.replay is None and options.script is None:
        print("no display: filming the tour of the package; --script FILE films another one", file=sys.stderr)
        options.script = DEFAULT_TOUR
    session, hands, title = _session(options)
    with session:
        player = Player(session, hands, stands_up=hands is not None, title=title)
        player.ghost = options.ghost
        if film is not None and hands is None:
            _film(player, film, options.size or (FILM_SIZE if film.waits else LARGE_FILM_SIZE))
        else:
            _play(player, film, options.size or (1280, 720))
    if tape is not None and hands is not None and session.steps:
        hands.script.write(tape)
        print(f"{tape} has what you did: --script {tape} does it again")


def has_window() -> bool:
    """Whether windows can be opened here; other systems than Linux always have a screen."""
    return has_display() or not sys.platform.startswith("linux")


def _check_together(options: argparse.Namespace) -> None:
    """Refuse options that contradict each other."""
    if options.script is not None and options.replay is not None:
        raise InvalidInputError("one thing can drive: give --script or --replay, got both")
    if (options.replay is None) != (options.episode is None):
        raise InvalidInputError(
            '--replay FILE and --episode NAME belong together, such as --episode "operator/trot/17"'
        )
    driven = "--script" if options.script is not None else "--replay" if options.replay is not None else ""
    for name in ("task", "save_script", *(("seed",) if options.replay is not None else ())):
        if driven and getattr(options, name) is not None:
            raise InvalidInputError(f"{driven} says everything; beside it came --{name.replace('_', '-')}")


def _session(options: argparse.Namespace) -> tuple[Session, Hands | None, str]:
    """The session that is asked for, the player's hands if they drive, and what drives otherwise."""
    if options.replay is not None:
        return _replayed(options.replay, options.episode, options.policy)
    named = options.policy or PRETRAINED[0]
    student = opened(PRETRAINED[0] if named == EXPERT else named)
    seed = SEED if options.seed is None else checked_seed(options.seed)
    who: dict[str, Any] = {"expert_drives": named == EXPERT}
    if options.script is not None:
        script = options.script if isinstance(options.script, Script) else Script.read(options.script)
        for task in script.task_names:
            one_of(task, student.tasks, "gait of the script")
        first = script.moves[0]
        setup = EpisodeSetup(first.task, seed, script.seconds, command=first.command)
        title = "" if isinstance(options.script, Script) else Path(options.script).name
        return Session(student, setup, script.drive, **who), None, title
    task = one_of(options.task or student.tasks[0], student.tasks, "gait")
    hands = Hands()
    return Session(student, EpisodeSetup(task, seed, ENDLESS_S, command=STAND), hands.drive, **who), hands, ""


def _replayed(file: str, episode: str, named: str | None) -> tuple[Session, None, str]:
    certificate = Certificate.read(file)
    cell, _, setup = certified_episode(certificate, episode)
    name = certificate.policy["name"] if named is None else named
    if named is None and name not in (*PRETRAINED, EXPERT):
        raise InvalidInputError(f"the certificate is of {name}: say where it is, --policy FILE")
    agent = opened(name)
    arguments = certificate.settings.arguments(agent, cell.condition)
    student = None if isinstance(agent, str) else agent
    return Session(student, dataclasses.replace(setup), None, **arguments), None, episode


def _film(player: Player, film: FilmFile, size: tuple[int, int]) -> None:
    print(f"filming {film.path}", file=sys.stderr)
    with tqdm(total=player.session.go1.config.episode_steps, unit="step", leave=False) as bar:
        record(player, film, *size, progress=lambda steps: bar.update(steps - bar.n))
    print(film.summary)


def _play(player: Player, film: FilmFile | None, size: tuple[int, int]) -> None:
    from trainers.play.window import Window

    window = Window(player, *size)
    try:
        window.run(each=Recording(player, film, window.picture) if film is not None else lambda: None)
        if film is not None:
            if film.is_still:
                film.add(window.picture())
            film.close()
            print(film.summary)
    finally:
        if film is not None:
            film.discard()
        window.close()
