"""How long somebody waits: for help, for the window, for the page, for an installation."""

import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.agents import Agent
from experiments.driving.programs import ROOT, run
from experiments.results import Results, group
from experiments.study import ALL_GAITS, Cell, Study, option
from experiments.tables import markdown
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.rendering import has_display
from trainers.cli.program import COMMANDS

HELP, WINDOW, WEB, IMPORTS, INSTALL = "help", "window", "page", "imports", "install"
HELP_S, DRIVE_S, INSTALL_S = 2.0, 10.0, 60.0
"""Aims: of help, of a robot that can be driven, and of that together with an installation without its downloads."""
FIRST_PICTURE = """
import os, sys
from trainers.cli.program import run
def drawn(self, notice=None, draw={place}.draw):
    draw(self, notice)
    if self._player.session.steps:
        os._exit(0)
{place}.draw = drawn
sys.exit(f"ended with status {{run(['play', *{options}])}} before the first picture")
"""
PLACES = {
    WINDOW: ("import trainers.play.window", "trainers.play.window.Window", []),
    WEB: ("import trainers.play.browser.surface", "trainers.play.browser.surface.Browser", ["--web", "--port", "0"]),
}
"""What is shown on -> import, class, options."""
IMPORTED = "import torch, mujoco, gymnasium, stable_baselines3"
"""What `play` cannot do without, or what learners of this kind import."""


@dataclass(frozen=True)
class TimesOptions:
    """How much of everything."""

    runs: int = option(5, "of each, of which the median counts")
    installs: int = option(1, "of the package into a new environment, from files that were downloaded before")


class Times(Study):
    """Seconds from a command to its help, and to a robot that can be driven."""

    name = "driving_times"
    title = "Waiting"
    note = (
        "Medians of the wall time of new processes whose files are in the system's cache. A robot can be driven once "
        "the first picture after its first step is shown; the window is drawn by OpenGL in software. To compare "
        "with on another machine: the imports of torch, mujoco, gymnasium and stable_baselines3 alone."
    )
    keys = ("agent", "task", "condition", "seed", "what")
    full = TimesOptions()
    quick = TimesOptions(runs=1, installs=0)
    code = ("trainers.cli", "trainers.play")
    alone = True

    def agents(self) -> list[Agent]:
        return [Agent("command line")]

    def cells(self, agent: Agent) -> list[Cell]:
        """What is waited for.

        Raises:
            InvalidInputError: if no window can be opened.
        """
        if not has_display():
            raise InvalidInputError("a display is needed for the window; xvfb-run has one")
        conditions = (IMPORTS, HELP, WINDOW, WEB, *([INSTALL] if self.options.installs else []))
        return [Cell(ALL_GAITS, condition) for condition in conditions]

    def measure(self, agent: Agent, cell: Cell, seed: int) -> list[dict[str, Any]]:
        if cell.condition == IMPORTS:
            return [self._timed("imports", [sys.executable, "-c", IMPORTED])]
        if cell.condition == HELP:
            program = [sys.executable, "-m", "trainers"]
            commands = {"--help": [], **{f"{name} --help": [name] for name in COMMANDS}}
            return [self._timed(what, [*program, *words, "--help"]) for what, words in commands.items()]
        if cell.condition == INSTALL:
            return [installation() for _ in range(self.options.installs)]
        place, surface, options = PLACES[cell.condition]
        code = f"{place}\n{FIRST_PICTURE.format(place=surface, options=options)}"
        return [self._timed("play" + (" --web" if cell.condition == WEB else ""), [sys.executable, "-c", code])]

    def _timed(self, what: str, command: Sequence[str]) -> dict[str, Any]:
        run(command)  # what it reads is in memory afterwards
        return {"what": what, "seconds": [round(run(command)[0], 3) for _ in range(self.options.runs)]}

    def table(self, results: Results) -> str:
        of, rows = group(results.records, "condition"), []
        middle = {
            each["what"]: float(np.median(each["seconds"])) for each in results.records if each["what"] != INSTALL
        }
        rows.append(["the imports alone", f"{middle['imports']:.1f}", "-"])
        slowest = max(middle[each["what"]] for each in of[HELP])
        rows.append([f"help, the slowest of {len(of[HELP])}", f"{slowest:.2f}", f"{HELP_S:g}"])
        rows += [[f"`go1-mtl-gym {what}`", f"{middle[what]:.1f}", f"{DRIVE_S:g}"] for what in ("play", "play --web")]
        for each in of.get(INSTALL, ()):
            rows.append(
                [
                    "from `pip install`, downloads left out, to `play --web`",
                    f"{sum(each['seconds']):.0f}",
                    f"{INSTALL_S:g}",
                ]
            )
        return markdown(["until", "measured [s]", "aim [s]"], rows)


def installation() -> dict[str, Any]:
    """Seconds of an installation from files that were downloaded, and of the first start after it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wheels, python = folder / "wheels", folder / "venv" / "bin" / "python"
        constraints = str(ROOT / "constraints" / "tested.txt")
        run([sys.executable, "-m", "venv", str(folder / "venv")])
        pip = [str(python), "-m", "pip", "--disable-pip-version-check"]
        run([*pip, "wheel", "-w", str(wheels), "-c", constraints, f"{ROOT}[web]", "hatchling"])
        package = next(wheels.glob("go1_mtl_gym-*.whl"))
        installed, _ = run([*pip, "install", "--no-index", "--find-links", str(wheels), f"{package}[web]"])
        place, surface, options = PLACES[WEB]
        code = f"{place}\n{FIRST_PICTURE.format(place=surface, options=options)}"
        return {"what": INSTALL, "seconds": [installed, run([str(python), "-P", "-c", code], PYTHONPATH="")[0]]}
