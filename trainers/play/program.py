"""What ``go1-mtl-gym play`` does with its options."""

import sys
from pathlib import Path
from typing import Any

from tqdm.auto import tqdm

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.rendering import has_display
from go1_mtl_gym.validation import one_of
from trainers.evaluation.agents import identity, opened
from trainers.evaluation.certificate import Certificate
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.replay import certified_episode
from trainers.evaluation.script import LONGEST_S, Script
from trainers.evaluation.tour import DEFAULT_TOUR
from trainers.play.hands import Hands
from trainers.play.loop import play_on
from trainers.play.options import PlayOptions
from trainers.play.player import Player
from trainers.play.record import FilmFile, Recording, record
from trainers.play.session import EXPERT, Session
from trainers.play.surfaces import opened_surface
from trainers.policies.packaged import PRETRAINED
from trainers.utils.cli import writable_file

ENDLESS_S = 1e6
"""Length of an episode that hands drive [s]."""
STAND = (0.0, 0.0, 0.0)
SEED = 1
STUDENT = next(iter(PRETRAINED))
FILM_SIZE, LARGE_FILM_SIZE = (640, 360), (1280, 720)
"""Width and height of a film without a window [pixels]: one that waits in memory until its end, and any other."""


def play(options: PlayOptions) -> None:
    """Let somebody play, or film what is played.

    Raises:
        Go1Error: if a file is not as described, or nothing can be shown on this machine.
    """
    largest = FILM_SIZE if options.size is None else None
    film = None if options.record is None else FilmFile(writable_file(options.record), options.fps, largest)
    tape = None if options.save_script is None else writable_file(options.save_script)
    script = None if options.script is None else Script.read(options.script)
    unseen = film is not None and not (options.web or has_display())
    if unseen and script is None and options.replay is None:
        options.refuse_hands("without a display --record films a tour, --script FILE another one")
        print("no display: filming the tour of the package; --script FILE films another one", file=sys.stderr)
        script = DEFAULT_TOUR
    session, hands, title = _session(options, script)
    with session:
        player = Player(session, hands, stands_up=hands is not None, title=title)
        player.ghost = options.ghost
        if film is not None and hands is None:
            _film(player, film, options.size or (FILM_SIZE if film.waits else LARGE_FILM_SIZE))
            return
        try:
            _play(player, film, options)
        finally:  # interrupted, or the physics has diverged: what was driven is kept
            if tape is not None and hands is not None and session.steps:
                hands.script.write(tape)
                kept = f"the first {LONGEST_S / 60:g} minutes of " if session.time_s > LONGEST_S else ""
                print(f"{tape} has {kept}what you did: --script {tape} does it again")


def _session(options: PlayOptions, script: Script | None) -> tuple[Session, Hands | None, str]:
    """The session that is asked for, the player's hands if they drive, and what drives otherwise."""
    if options.replay is not None and options.episode is not None:
        return _replayed(options.replay, options.episode, options.policy)
    named = options.policy or STUDENT
    student = opened(STUDENT if named == EXPERT else named)
    seed = SEED if options.seed is None else options.seed
    who: dict[str, Any] = {"expert_drives": named == EXPERT}
    if script is not None:
        for task in script.task_names:
            one_of(task, student.tasks, "gait of the script")
        first = script.moves[0]
        setup = EpisodeSetup(first.task, seed, script.seconds, command=first.command)
        return Session(student, setup, script.drive, **who), None, "" if options.script is None else options.script.name
    task = one_of(options.task or student.tasks[0], student.tasks, "gait")
    hands = Hands()
    return Session(student, EpisodeSetup(task, seed, ENDLESS_S, command=STAND), hands.drive, **who), hands, ""


def _replayed(file: Path, episode: str, named: str | None) -> tuple[Session, None, str]:
    certificate = Certificate.read(file)
    cell, _, setup = certified_episode(certificate, episode)
    name = certificate.policy["name"] if named is None else named
    if named is None and name not in (*PRETRAINED, EXPERT):
        raise InvalidInputError(f"the certificate is of {name}: say where it is, --policy FILE")
    if named is None and identity(name) != certificate.policy:
        raise InvalidInputError(
            f"the certificate is of another {name} than this package's: --policy FILE names it, and --policy {name} "
            "shows this one in the same episode"
        )
    agent = opened(name)
    arguments = certificate.settings.arguments(agent, cell.condition)
    student = None if isinstance(agent, str) else agent
    return Session(student, setup, None, **arguments), None, episode


def _film(player: Player, film: FilmFile, size: tuple[int, int]) -> None:
    print(f"filming {film.path}", file=sys.stderr)
    with tqdm(total=player.session.go1.config.episode_steps, unit="step", leave=False) as bar:
        record(player, film, *size, progress=lambda steps: bar.update(steps - bar.n))
    print(film.summary)


def _play(player: Player, film: FilmFile | None, options: PlayOptions) -> None:
    on_page = options.web or not has_display()
    small = on_page and film is not None and film.waits  # nobody sees the pictures that become a page's film
    surface = opened_surface(player, options, options.size or (FILM_SIZE if small else LARGE_FILM_SIZE))
    try:
        play_on(surface, player, each=Recording(player, film, surface.picture) if film is not None else lambda: None)
        if film is not None and film.is_still:
            film.add(surface.picture())
    except KeyboardInterrupt:
        if not surface.ends_by_interrupt:
            raise
    finally:  # interrupted, too: a film has what was seen until then
        if film is not None:
            film.close()
            print(film.summary)
        surface.close()
