"""The report's parts: what each section measures per gait, and finished parts on disk, so that Ctrl-C costs little."""

import dataclasses
import hashlib
import inspect
import json
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import joblib
from expert_lab import Lab
from expert_labels import LabelsConfig, labels
from expert_limits import LimitsConfig, PushConfig, limits, pushes
from expert_steady import SteadyConfig, steady
from expert_timing import MODE_TASKS, ModesConfig, TimingConfig, modes, timing
from expert_walks import SoakConfig, SurvivalConfig, TransitionConfig, soak, survival, transitions
from threadpoolctl import threadpool_limits
from tqdm.auto import tqdm

import experts
import go1_mtl_gym
from go1_mtl_gym import TASKS
from trainers.checkpoint import versions
from trainers.files import json_ready, write_json


@dataclasses.dataclass(frozen=True)
class Section:
    """One thing that is measured per gait.

    Attributes:
        measure: (lab, task, config, seed) -> figures.
        config: its settings.
        alone: whether nothing else may run meanwhile, because it measures time.
        tasks: gaits it is made for, or None for all.
    """

    measure: Callable[[Lab, str, Any, int], dict[str, Any]]
    config: Any
    alone: bool = False
    tasks: tuple[str, ...] | None = None


SECTIONS = {
    "survival": Section(survival, SurvivalConfig()),
    "limits": Section(limits, LimitsConfig()),
    "pushes": Section(pushes, PushConfig()),
    "transitions": Section(transitions, TransitionConfig()),
    "soak": Section(soak, SoakConfig()),
    "steady": Section(steady, SteadyConfig()),
    "labels": Section(labels, LabelsConfig()),
    "modes": Section(modes, ModesConfig(), tasks=MODE_TASKS),
    "timing": Section(timing, TimingConfig(), alone=True),
}
"""Every section by name, in the order of measuring."""
QUICK = {
    "survival": {"episodes": 1, "seconds": 4.0, "change_s": 2.0},
    "limits": {"trials": 2, "scouts": 1, "seconds": 3.0, "grid": 1},
    "pushes": {"phases": 2, "grid": 1, "after_s": 1.0},
    "transitions": {"trials": 1, "after_s": 1.0},
    "soak": {"steps": 200},
    "steady": {"seconds": 4.0},
    "labels": {"walks": 1, "seconds": 1.5},
    "modes": {"episodes": 1, "seconds": 3.0, "push": PushConfig(1, grid=0, after_s=0.5, directions=("left",))},
    "timing": {"states": 20, "blocks": 1, "block_s": 0.2},
}
"""Settings of ``--quick``: everything is measured, nothing is measured well."""


@dataclasses.dataclass(frozen=True)
class Part:
    """One section of one gait.

    Attributes:
        name: of the section.
        task: the gait.
        section: how it is measured.
        seed: of everything random.
        control_hz: rate of the expert [Hz].
        folder: where finished parts are kept.
    """

    name: str
    task: str
    section: Section
    seed: int
    control_hz: int
    folder: Path

    @property
    def path(self) -> Path:
        """File of the finished part; its name changes with anything that could change the figures."""
        digest = hashlib.sha256()
        for word in (
            *(repr(TASKS[name]) for name in sorted({self.task, *getattr(self.section.config, "tasks", ())})),
            repr((self.section.config, self.seed, self.control_hz, versions())),
            inspect.getsource(inspect.getmodule(self.section.measure)),
            sources(),
        ):
            digest.update(word.encode())
        return self.folder / f"{self.name}-{self.task}-{digest.hexdigest()[:12]}.json"

    def measure(self) -> dict[str, Any]:
        """The finished part: read if it is there, else measured and written."""
        path = self.path
        if path.is_file():
            return json.loads(path.read_text(encoding="utf-8"))
        start = time.monotonic()
        with threadpool_limits(1):
            lab = Lab(self.control_hz)
            figures = self.section.measure(lab, self.task, self.section.config, self.seed)
        part = {
            "section": self.name,
            "task": self.task,
            "figures": figures,
            "ledger": dataclasses.asdict(lab.settle()),
            "seconds": round(time.monotonic() - start, 2),
        }
        write_json(path, part)
        return json_ready(part)


def sources() -> str:
    """The code of environment and expert, as one text."""
    folders = [Path(package.__file__).parent for package in (go1_mtl_gym, experts)]
    files = sorted(path for folder in folders for kind in ("*.py", "*.xml") for path in folder.rglob(kind))
    return "\n".join(path.read_text(encoding="utf-8") for path in files)


def measure_all(parts: Sequence[Part], n_jobs: int) -> list[dict[str, Any]]:
    """Measure what is not there yet, in processes side by side; what measures time comes last, alone."""
    together = [part for part in parts if not part.section.alone]
    ordered = [*together, *(part for part in parts if part.section.alone)]
    with tqdm(total=len(ordered), desc="report", unit="part") as bar:
        return [_shown(bar, part) for part in _results(together, ordered[len(together) :], n_jobs)]


def _results(together: list[Part], alone: list[Part], n_jobs: int) -> Iterator[dict[str, Any]]:
    if n_jobs == 1:
        yield from (part.measure() for part in together)
    else:
        parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator")
        yield from parallel(joblib.delayed(Part.measure)(part) for part in together)
    yield from (part.measure() for part in alone)


def _shown(bar: tqdm, part: dict[str, Any]) -> dict[str, Any]:
    bar.set_postfix_str(f"{part['section']} {part['task']}")
    bar.update()
    return part
