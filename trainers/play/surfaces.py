"""What a player is shown on: a window where there is a display, otherwise a page in browsers."""

import socket

from go1_mtl_gym.rendering import RenderingError, has_display
from trainers.play.loop import Surface
from trainers.play.options import LOOPBACK, WEB_PACKAGES, PlayOptions
from trainers.play.player import Player

INSTALL = 'pip install "viser>=1.1.1,<1.2" trimesh'
LOOPBACKS = (LOOPBACK, "localhost", "::1")


def opened_surface(player: Player, options: PlayOptions, size: tuple[int, int]) -> Surface:
    """A window, or a page where there is no display or a page is asked for; how to get to a page is printed.

    Args:
        player: that is shown.
        options: that say which, and where a page is served.
        size: width and height of the window, or of a film of the page [pixels].

    Raises:
        RenderingError: if there is no display, nor the packages that a page needs.
        InvalidInputError: if a page cannot be served there.
    """
    if not options.web and has_display():
        from trainers.play.window import Window

        return Window(player, *size)
    try:
        from trainers.play.browser.surface import Browser
    except ModuleNotFoundError as error:
        if error.name not in WEB_PACKAGES:
            raise
        why = "" if options.web else "there is no display, and "
        instead = "add --record FILE.webp to film it without either"
        if options.record is not None:
            instead = "leave out --web to film a tour without either"
        raise RenderingError(
            f"{why}a page in a browser needs {error.name}: {INSTALL}, or the extra `web`; or {instead}"
        ) from error
    browser = Browser(player, options.host, options.port, size)
    print(_invitation(browser.link, options), flush=True)
    return browser


def _invitation(link: str, options: PlayOptions) -> str:
    """How to get to a page."""
    why = "" if options.web else "there is no display: "
    lines = [f"{why}drive in a browser at {link} (Ctrl+C here ends it)"]
    port = link.rpartition(":")[2]
    if options.host in LOOPBACKS:
        host = f"[{options.host}]" if ":" in options.host else options.host
        tunnel = f"ssh -N -L {port}:{host}:{port} {socket.gethostname()}"
        lines += [f"from another machine: {tunnel}, then the same link there"]
    else:
        lines += ["everybody who can reach this machine there can drive"]
    return "\n".join(lines)
