"""The report's parts: what each section measures per gait."""

import dataclasses
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from report_parts import digest, finished, sources

import experts
import go1_mtl_gym
from expert_report.lab import Lab
from expert_report.labels import LabelsConfig, labels
from expert_report.limits import LimitsConfig, PushConfig, limits, pushes
from expert_report.steady import SteadyConfig, steady
from expert_report.timing import MODE_TASKS, ModesConfig, TimingConfig, modes, timing
from expert_report.walks import SoakConfig, SurvivalConfig, TransitionConfig, soak, survival, transitions
from go1_mtl_gym import TASKS
from trainers.policies.checkpoint import versions


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
        words = (
            *(repr(TASKS[name]) for name in sorted({self.task, *getattr(self.section.config, "tasks", ())})),
            repr((self.section.config, self.seed, self.control_hz, versions())),
            inspect.getsource(inspect.getmodule(self.section.measure)),
            sources(go1_mtl_gym, experts),
        )
        return self.folder / f"{self.name}-{self.task}-{digest(words)}.json"

    def measure(self) -> dict[str, Any]:
        """The finished part: read if it is there, else measured and written."""
        return finished(self.path, self._figures)

    def _figures(self) -> dict[str, Any]:
        lab = Lab(self.control_hz)
        figures = self.section.measure(lab, self.task, self.section.config, self.seed)
        ledger = dataclasses.asdict(lab.settle())
        return {"section": self.name, "task": self.task, "figures": figures, "ledger": ledger}
