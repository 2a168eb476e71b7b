"""The sections of the student's report that make their own students: who is taught what, and who is then measured."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from main_job.config import PRESETS, JobConfig

from student_report.commanded import CORNERS, CORRECTED, DRAWN, PHASE_FREE
from student_report.lab import EXPERT, Walker, walkers
from student_report.school import UNUSED, Student

Found = dict[str, dict[str, dict[str, Any]]]
"""{walker: {gait: {part: figures}}}."""


@dataclass(frozen=True)
class SchoolClass:
    """The students of one section.

    Attributes:
        lessons: (training seeds, whether quick) -> {name of a student: settings of the main job that make it}.
        walkers: {name: student} -> who is measured.
        complete: (what was measured, {name: student}) -> the same with what follows from several parts.
        bars: figure -> what a student is measured against.
    """

    lessons: Callable[[Sequence[int], bool], dict[str, JobConfig]]
    walkers: Callable[[Mapping[str, Student]], list[Walker]]
    complete: Callable[[Found, Mapping[str, Student]], Found]
    bars: dict[str, float] = field(default_factory=dict)


def changed(config: JobConfig) -> dict[str, Any]:
    """The settings of a lesson that are not the main job's defaults."""
    default = dataclasses.asdict(JobConfig())
    own = dataclasses.asdict(config)
    return {name: value for name, value in own.items() if name not in UNUSED and value != default[name]}


# -- Training seeds ----------------------------------------------------------------------------------------------------

BARS = {"success_rate": 0.95, "velocity_error": 0.05, "error_ratio": 2.0}
"""Smallest success rate, largest velocity error [m/s], and largest ratio of it to the expert's."""
PHASE_FREE_VARIANTS = " without a clock"
"""Appended to a student's name."""


def seed_lessons(seeds: Sequence[int], quick: bool) -> dict[str, JobConfig]:
    """The main job's student for every training seed."""
    return {f"seed {seed}": JobConfig(**(PRESETS["smoke"] if quick else {}), seed=seed) for seed in seeds}


def seed_walkers(students: Mapping[str, Student]) -> list[Walker]:
    """Every student, the same without a clock, and the expert."""
    *clocked, expert = walkers([f"{name}={student.policy}" for name, student in students.items()])
    phase_free = [
        Walker.student(name + PHASE_FREE_VARIANTS, student.phase_free, only=(PHASE_FREE, CORRECTED))
        for name, student in students.items()
        if student.phase_free
    ]
    expected = [dataclasses.replace(walker, only=(DRAWN, CORNERS)) for walker in (*clocked, expert)]
    return [*expected[:-1], *phase_free, expected[-1]]


def judged(found: Found, students: Mapping[str, Student]) -> Found:
    """With "error_ratio", to the expert's velocity error, and "passed", {bar: whether}, of the drawn commands."""
    for name in students:
        for task, parts in found.get(name, {}).items():
            if DRAWN in parts:
                own = parts[DRAWN]
                error, expert = own["velocity_error"], found[EXPERT][task][DRAWN]["velocity_error"]
                own["error_ratio"] = error / expert if error is not None and expert else None
                own["passed"] = {figure: passes(figure, own[figure]) for figure in BARS}
    return found


def passes(figure: str, value: float | None) -> bool:
    """Whether a figure reaches its bar; an error that there is none of, for falls, does not."""
    if value is None:
        return False
    return value >= BARS[figure] - 1e-9 if figure == "success_rate" else value <= BARS[figure] + 1e-9


# -- One change each ---------------------------------------------------------------------------------------------------

DEFAULT = "default, reduced"
REDUCED = {
    "clean_s": 30.0,
    "perturbed_s": 120.0,
    "held_out_s": 15.0,
    "rounds": 1,
    "dagger_s": 60.0,
    "clone_steps": 3000,
    "round_steps": 1500,
    "phase_free_s": 0.0,
    "round_episodes": 1,
    "episode_s": 10.0,
}
"""Settings that all variants share but for their change."""
VARIANTS: dict[str, dict[str, Any]] = {
    DEFAULT: {},
    "control rate 100 Hz": {"control_hz": 100},
    "kp 20": {"kp": 20.0},
    "kp 80": {"kp": 80.0},
    "three frames": {"history": 3},
    "without command": {"channels": ("phase", "last_action")},
    "without phase": {"channels": ("command", "last_action")},
    "without last action": {"channels": ("command", "phase")},
    "with gravity": {"channels": ("command", "gravity", "phase", "last_action")},
    "no disturbed demonstrations": {"clean_s": 150.0, "perturbed_s": 0.0},
    "no randomisation": {"randomized": 0.0},
    "no changes of gait": {"task_interval": None},
    "width 64": {"width": 64},
    "width 128": {"width": 128},
    "width 512": {"width": 512},
    "no round": {"rounds": 0},
    "two rounds": {"rounds": 2},
    "three rounds": {"rounds": 3},
    "takeover at 0.1 rad": {"takeover_rad": 0.1},
}
"""Name -> what differs from the reduced job."""
QUICK_VARIANTS = (DEFAULT, "without phase", "no round")


def variant_lessons(seeds: Sequence[int], quick: bool) -> dict[str, JobConfig]:
    """The reduced job and its variants, for the first training seed."""
    base = PRESETS["smoke"] | {"phase_free_s": 0.0} if quick else REDUCED
    names = QUICK_VARIANTS if quick else VARIANTS
    return {name: JobConfig(**(base | VARIANTS[name]), seed=seeds[0]) for name in names}


def variant_walkers(students: Mapping[str, Student]) -> list[Walker]:
    """Every student; the expert is another one for other gains and rates, and is left out."""
    return [Walker.student(name, student.policy) for name, student in students.items()]


def with_held_out(found: Found, students: Mapping[str, Student]) -> Found:
    """With "held_out", the one-step errors on held-out rows of the student's own demonstrations."""
    for name, tasks in found.items():
        for task, parts in tasks.items():
            parts["held_out"] = students[name].held_out[task]
    return found


COMMANDED = SchoolClass(seed_lessons, seed_walkers, judged, BARS)
ABLATION = SchoolClass(variant_lessons, variant_walkers, with_held_out)
