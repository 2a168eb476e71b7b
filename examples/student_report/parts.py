"""The sections of the student's report, and their parts: one walker, one gait, and one thing that is done to it."""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from report_parts import digest, finished, sources

import experts
import go1_mtl_gym
import trainers
from student_report import budget as student_budget
from student_report import phase_free as student_phase_free
from student_report.ablation import AblationConfig, ablation
from student_report.budget import BudgetConfig, budget
from student_report.classes import ABLATION, COMMANDED, SchoolClass
from student_report.commanded import CommandedConfig, commanded
from student_report.lab import Walker
from student_report.phase_free import PhaseFreeConfig, phase_free
from student_report.pushes import KickConfig, pushes
from student_report.robustness import RobustnessConfig, robustness
from student_report.switching import SwitchingConfig, switching
from trainers.evaluation.closed_loop import controller
from trainers.policies.checkpoint import versions

SCORING = (trainers.evaluate, trainers.evaluate_transition, trainers.ClosedLoopResult, controller)
"""What stands in the files of `trainers` that a figure depends on."""


@dataclass(frozen=True)
class Section:
    """One thing that is measured per walker and gait.

    Attributes:
        measure: (policy or "expert", task, part, config, seed, **env_kwargs) -> figures.
        config: its settings; ``config.parts(task, tasks)`` names the parts of a gait among the students' gaits.
        quick: settings of ``--quick``: everything is measured, nothing is measured well.
        alone: whether nothing else may run meanwhile, because it measures time.
        school: of the students that the section makes itself; None: it measures those that it is given.
        prepare: of a section whose parts teach the students that they measure, all gaits in one: (config, folder,
            n_jobs) makes what they share in a folder that `measure` gets too. ``config.walkers(given)`` are measured.
    """

    measure: Callable[..., dict[str, Any]]
    config: Any
    quick: Any
    alone: bool = False
    school: SchoolClass | None = None
    prepare: Callable[[Any, Path, int], None] | None = None


QUICK_SWITCHING = SwitchingConfig(trials=1, before_s=0.5, after_s=3.0)
SECTIONS = {
    "commanded": Section(commanded, CommandedConfig(), CommandedConfig(2, 1, 1, 4.0, 2.0), school=COMMANDED),
    "switching": Section(switching, SwitchingConfig(), QUICK_SWITCHING),
    "robustness": Section(robustness, RobustnessConfig(), RobustnessConfig(1, 3.0, 1.5, every=2)),
    "pushes": Section(pushes, KickConfig(), KickConfig(2, grid=2, before_s=0.5, after_s=0.5)),
    "ablation": Section(ablation, AblationConfig(), AblationConfig(2, 1, 4.0, 2.0, QUICK_SWITCHING), school=ABLATION),
    "budget": Section(budget, BudgetConfig(), student_budget.QUICK, prepare=student_budget.prepare),
    "phase_free": Section(phase_free, PhaseFreeConfig(), student_phase_free.QUICK, prepare=student_phase_free.prepare),
}
"""Every section by name."""


@dataclass(frozen=True)
class StudentPart:
    """One part of one section.

    Attributes:
        name: of the section.
        section: how it is measured.
        walker: who is measured.
        task: the gait.
        what: which of the section's parts.
        seed: of everything random.
        folder: where finished parts are kept.
    """

    name: str
    section: Section
    walker: Walker
    task: str
    what: str
    seed: int
    folder: Path

    @property
    def path(self) -> Path:
        """File of the finished part; its name changes with anything that could change the figures.

        That is the policy's file, whatever its name, or else the expert's code and environment; the settings, the
        environment's code, that of the measurement, and versions.
        """
        own = self.walker
        words = (
            own.sha256 or sources(experts) + repr(sorted(own.env_kwargs.items())),
            repr((self.section.config, self.seed, versions())),
            *(inspect.getsource(inspect.getmodule(each)) for each in (self.section.measure, *SCORING)),
            sources(go1_mtl_gym),
            self.shared.name if self.section.prepare else "",
        )
        who = own.sha256[:8] or own.name
        name = f"{self.name}-{who}-{self.task}-{self.what}-{digest(words)}.json"
        return self.folder / name.replace(",", "").replace(" ", "_")

    @property
    def shared(self) -> Path:
        """Folder of demonstrations and students that the section's parts share; its name changes with the code."""
        code = (sources(experts, go1_mtl_gym, trainers), inspect.getsource(inspect.getmodule(self.section.measure)))
        return self.folder / f"{self.name}-{digest((repr(self.section.config), repr(versions()), *code))}"

    def measure(self) -> dict[str, Any]:
        """The finished part: read if it is there, else measured and written."""
        return finished(self.path, self._figures)

    def _figures(self) -> dict[str, Any]:
        who, config = self.walker.load(), self.section.config
        more = {"folder": self.shared} if self.section.prepare else self.walker.env_kwargs
        figures = self.section.measure(who, self.task, self.what, config, self.seed, **more)
        return {"section": self.name, "task": self.task, "what": self.what, "figures": figures}


def parts_of(
    name: str, section: Section, who: Sequence[Walker], pairs: Sequence[tuple[str, str]], seed: int, folder: Path
) -> list[StudentPart]:
    """All parts of a section: every walker, and those (gait, part) that it is measured in."""
    return [
        StudentPart(name, section, walker, task, what, seed, folder)
        for walker in who
        for task, what in pairs
        if what in (walker.only or (what,))
    ]
