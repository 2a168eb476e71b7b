"""The page in the browser: what it weighs, when it moves, and how well it agrees with Python."""

import hashlib
import json
import shutil
import sys
from dataclasses import dataclass
from typing import Any

from experiments.agents import Agent
from experiments.driving.programs import ROOT, run
from experiments.results import Results, group
from experiments.study import ALL_GAITS, Cell, Study, option
from experiments.tables import markdown
from go1_mtl_gym.errors import InvalidInputError

WEB = ROOT / "web"
CERTIFICATE = ROOT / "docs" / "results" / "certificate_clocked.json"
"""Has Python's verdicts on the tours."""
SIZES, MOTION, PARITY, TOURS = "sizes", "first-motion", "parity", "tours"
LARGEST_MB, LATEST_S, CLOSEST, NEAREST_M = 3.0, 3.0, 1e-6, 0.01
"""Aims: gzipped size and seconds until the first motion, differences of observations and actions, and of where drives
end."""


@dataclass(frozen=True)
class PageOptions:
    """How much of everything."""

    tours: int = option(100, "of an operator, as they are certified")
    loads: int = option(9, "of the page, each in a new browser")


class Site(Agent):
    """The page as it would be built now."""

    @property
    def identity(self) -> str:
        """Changes with the page's code; what Python writes for it is named by the study's code."""
        total = hashlib.sha256()
        files = [*WEB.glob("*.*"), *WEB.glob("src/*"), *WEB.glob("tests/*.mjs")]
        for path in sorted(files):
            total.update(path.read_bytes())
        for path in sorted((ROOT / "trainers" / "assets").glob("*.zip")):
            total.update(path.read_bytes())
        return total.hexdigest()


class Page(Study):
    """The page in the browser: sizes, time until the first motion, parity with Python, and an operator's tours."""

    name = "driving_page"
    title = "The page in the browser"
    note = (
        "Sizes are those of files compressed with gzip, level 9. The first motion is the first picture of the moving "
        "robot in Chromium without a window, with an empty cache, OpenGL in software and the server on the loopback "
        "interface."
    )
    keys = ("agent", "task", "condition", "seed", "part", "run", "policy", "drive", "tour")
    full = PageOptions()
    quick = PageOptions(tours=1, loads=1)
    code = ("go1_mtl_gym", "trainers.data", "trainers.policies", "trainers.evaluation", "web")
    alone = True

    def agents(self) -> list[Agent]:
        return [Site("page")]

    def cells(self, agent: Agent) -> list[Cell]:
        return [Cell(ALL_GAITS, condition) for condition in (SIZES, MOTION, PARITY, TOURS)]

    def prepare(self, n_jobs: int) -> None:
        """Build it, and let Python drive what it is compared with.

        Raises:
            InvalidInputError: if Node or what the page is built with is missing.
        """
        if shutil.which("node") is None or not (WEB / "node_modules").is_dir():
            raise InvalidInputError("the page needs Node 20, and what `make web` installs; one of them is not there")
        run([sys.executable, "-m", "web.export"], ROOT)
        run(["npm", "run", "--silent", "build"], WEB)
        tours = ["--tours", str(self.options.tours), "--jobs", str(n_jobs), "--certificate", str(CERTIFICATE)]
        run([sys.executable, "-m", "web.reference", *tours], ROOT)

    def measure(self, agent: Agent, cell: Cell, seed: int) -> list[dict[str, Any]]:
        runs = [str(self.options.loads)] if cell.condition == MOTION else []
        return json.loads(run(["node", "measure.mjs", cell.condition, *runs], WEB)[1])

    def table(self, results: Results) -> str:
        of = {condition: results.of(condition=condition) for condition in (SIZES, MOTION, PARITY, TOURS)}
        rows = [
            [f"gzipped, {each['part']} [MB]", f"{each['gzipped'] / 1e6:.2f}", aim]
            for each, aim in zip(of[SIZES], (f"{LARGEST_MB:g}", "-"), strict=True)
        ]
        seconds = sorted(of[MOTION].values("seconds"))
        middle, most = seconds[len(seconds) // 2], seconds[-1]
        rows.append(
            [f"first motion, median and longest of {len(seconds)} [s]", f"{middle:.1f}, {most:.1f}", f"{LATEST_S:g}"]
        )
        same = sum(each["fallen"] == each["fallen_in_python"] for each in of[TOURS])
        rows.append([f"tours of {of[TOURS][0]['seconds']:g} s: the same verdict", f"{same}/{len(of[TOURS])}", "all"])
        for key, who in (("fallen", "the page"), ("fallen_in_python", "Python")):
            rows.append(
                [
                    f"tours without a fall in {who}",
                    f"{sum(not each[key] for each in of[TOURS])}/{len(of[TOURS])}",
                    "all",
                ]
            )
        return markdown(["of the page", "measured", "aim"], rows)

    def paragraphs(self, results: Results) -> list[str]:
        rows = [
            [
                policy.replace("_", " "),
                str(max(each["seconds"] for each in drives)),
                *(f"{drives.largest(key):.0e}" for key in ("observation", "action", "apart_m")),
            ]
            for policy, drives in group(results.of(condition=PARITY), "policy").items()
        ]
        header = ["policy", "longest drive [s]", "observation", "action", "apart at the end [m]"]
        about = (
            "Largest differences from Python over the drives of all gaits, of a push and of changes of gait: of "
            f"observation and action from the same states (aim {CLOSEST:.0e}), and of where the robots end when each "
            f"network drives its own (aim {NEAREST_M:g} m)."
        )
        return [*super().paragraphs(results), about, markdown(header, rows)]
