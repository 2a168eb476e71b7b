"""What is written into the picture of a session that is played, besides the captions of films."""

from trainers.evaluation.captions import (
    BUTTON,
    BUTTON_PITCH,
    BUTTONS,
    COMMAND,
    CONTACTS,
    DIM,
    MARGIN,
    PANEL,
    TEXT,
    TRACK,
    Page,
    Panel,
    panels,
)
from trainers.play.controls import HELP
from trainers.play.player import Player
from trainers.play.session import EXPERT

STATUS_HEIGHT = 44.0
HELP_ROW = 14.0
HELP_WIDTH = 240.0
EXPERT_COLOR = (255, 196, 84, 255)


def play_panels(size: tuple[int, int], player: Player, notice: str | None = None) -> list[Panel]:
    """Everything that is written into a picture.

    Args:
        size: width and height of the picture [pixels].
        player: that is shown.
        notice: a line of text, in place of what a person with keys is to be told; "" is none.
    """
    page = Page(*size)
    drawn = [*panels(size, player.session.reading), _status(page, player)]
    notice = notice_of(player) if notice is None else notice
    if notice:
        drawn.append(_line(page, notice))
    if player.help:
        drawn.append(_help(page))
    return drawn


def button_at(size: tuple[int, int], tasks: tuple[str, ...], x: float, y: float) -> str | None:
    """The gait whose button is somewhere in a picture, or None.

    Args:
        size: width and height of the picture [pixels].
        tasks: that there is a button for.
        x: from the left [pixels].
        y: from the top [pixels].
    """
    scale = Page(*size).scale
    place, offset = divmod(x / scale - BUTTONS[0], BUTTON_PITCH)
    inside = offset <= BUTTON[0] and 0.0 <= y / scale - BUTTONS[1] <= BUTTON[1]
    return tasks[int(place)] if inside and 0 <= place < len(tasks) else None


def _status(page: Page, player: Player) -> Panel:
    """Who drives, the clock of the gait, and how fast time goes, at the upper right."""
    width, height = CONTACTS[0], STATUS_HEIGHT
    x, y = page.width - width - MARGIN, BUTTONS[1]
    session = player.session
    state = session.go1.state
    pen = page.pen(x, y, width, height)
    pen.box(x, y, width, height, PANEL, 6)
    pen.text(x + 8, y + 12, f"{session.driver} drives", 13, EXPERT_COLOR if session.driver == EXPERT else TEXT)
    pen.text(x + width - 8, y + 12, f"{session.time_s:.1f} s", 13, DIM, "rm")
    pen.disc(x + 15, y + 31, 7, TRACK)
    pen.sector(x + 15, y + 31, 7, state.phase, COMMAND)
    pen.text(x + 28, y + 31, "stands" if state.standing else f"phase {state.phase:.2f}", 12, TEXT)
    pen.text(x + width - 8, y + 31, f"real time {player.factor:.2f}", 12, DIM, "rm")
    return pen.panel()


def notice_of(player: Player) -> str:
    """The one thing to be told at this time; empty if there is none."""
    session = player.session
    if session.ended == "time":
        return "the end  (R: once more)"
    if session.ended == "unstable":
        return "the physics has diverged  (R: once more)"
    if session.ended:
        return "fallen  (R: stand up)"
    if player.paused:
        return "paused  (space: go on, N: one step)"
    if player.speed < 1.0:
        return f"slow motion x {player.speed:g}  (=: faster)"
    waiting = session.go1.requested_task.name
    if waiting != session.go1.task.name:
        return f"{waiting} next"
    return player.title


def _line(page: Page, words: str) -> Panel:
    """A line of text below the buttons."""
    x, y = BUTTONS[0], BUTTONS[1] + BUTTON[1] + 6
    width = 7.0 * len(words) + 20
    pen = page.pen(x, y, width, 22)
    pen.box(x, y, width, 22, PANEL, 6)
    pen.text(x + width / 2, y + 11, words, 13, TEXT, "mm")
    return pen.panel()


def _help(page: Page) -> Panel:
    """The keys, at the right between status and feet, where they leave the robot to be seen."""
    height = HELP_ROW * len(HELP) + 8
    x, y = page.width - HELP_WIDTH - MARGIN, BUTTONS[1] + STATUS_HEIGHT + 2
    pen = page.pen(x, y, HELP_WIDTH, height)
    pen.box(x, y, HELP_WIDTH, height, (*PANEL[:3], 235), 8)
    for row, (keys, meaning) in enumerate(HELP):
        middle = y + 4 + HELP_ROW * (row + 0.5)
        pen.text(x + 86, middle, keys, 11, COMMAND, "rm")
        pen.text(x + 94, middle, meaning, 11, TEXT)
    return pen.panel()
