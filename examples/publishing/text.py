"""Tables and pages written from the files in ``docs/results/``."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from expert_report.page import PICTURES, expert_section
from gait_report.page import NOTE, new_gaits_section, new_gaits_table
from main_job.config import PRESETS, JobConfig
from student_report.page import CHAPTERS, student_section

from go1_mtl_gym import TASKS, env_id
from publishing.runs import read_json, without_out
from trainers.utils.report import benchmark_table, markdown, paper_table, results_table, seconds_table, training_table

SETTINGS = {
    "control_hz": "control rate [Hz]",
    "channels": "channels",
    "clean_s": "clean demonstrations per gait [s]",
    "perturbed_s": "perturbed demonstrations per gait [s]",
    "randomized": "share of perturbed episodes with other physics",
    "task_interval": "time between changes of gait in them [s]",
    "held_out_s": "held-out demonstrations per gait [s]",
    "rounds": "DAgger rounds",
    "dagger_s": "per gait and round [s]",
    "width": "units per hidden layer",
    "normalization": "normalisation",
    "batch_size": "rows per gradient step",
    "clone_steps": "gradient steps of cloning",
    "round_steps": "gradient steps per round",
    "phase_free_s": "the student's walks that tell it the phase, per gait [s]",
    "episodes": "evaluation episodes per gait and learner",
    "episode_s": "duration of an episode [s]",
}
"""Rows of the table of presets: attribute of `JobConfig` and how it is called."""
OF_ROUNDS = ("dagger_s", "round_steps")
"""Those that mean nothing without a DAgger round."""


BENCHMARKS = {
    "expert": ("Expert against others", benchmark_table),
    "training": ("Training against others", training_table),
}
"""Name in ``benchmark_NAME.json`` -> title and table."""


def results_block(metrics: Mapping[str, Any]) -> str:
    """The results of the main job, for README.md."""
    return "\n\n".join([results_table(metrics), made_by(metrics)])


def new_gaits_block(data: Mapping[str, Any]) -> str:
    """New gaits for a trained policy, for README.md."""
    return "\n\n".join([new_gaits_table(data), f"{NOTE} {made_by(data)}"])


def gaits_block() -> str:
    """The built-in gaits and the ranges that commands are drawn from."""
    rows = []
    for name, task in TASKS.items():
        gait = task.gait
        offsets = " ".join(f"{value:g}" for value in gait.offsets)
        spans = [f"± {value:g}" for value in task.command_range]
        cells = [f"{gait.period:.2f}", f"{gait.duty:g}", offsets, f"{gait.step_rate:.2f}", *spans]
        rows.append([name, f"`{env_id(name).partition(':')[2]}`", *cells])
    header = ["gait", "id", "period [s]", "duty", "offsets FL FR RL RR", "steps/s", "vx [m/s]", "vy [m/s]"]
    return markdown([*header, "yaw rate [rad/s]"], rows, text_columns=2)


def presets_block() -> str:
    """What the presets of the main job do."""
    configs = [JobConfig(**settings) for settings in PRESETS.values()]
    rows = [[label, *(_setting(config, name) for config in configs)] for name, label in SETTINGS.items()]
    return markdown(["", *(f"`{name}`" for name in PRESETS)], rows)


def results_page(metrics: Mapping[str, Any], more: Sequence[str] = ()) -> str:
    """``docs/results/README.md``.

    Args:
        metrics: of the main job.
        more: paragraphs of whatever else was measured.
    """
    parts = [
        "# Results",
        "Written by `examples/publish_results.py` from the files beside it; do not edit.",
        "![The student in four gaits](gaits.gif)",
        "## Student and baselines",
        results_table(metrics),
        made_by(metrics),
        "![Joint targets of the student and of the expert](joint_targets.png)",
        "## R2 here and in the paper",
        paper_table(metrics),
        "The settings differ (another expert, other gains, rates, commands and inputs; walk was measured on hardware), "
        "so the table says how well each network fits its own expert, not which one is better.",
        "## Wall time",
        seconds_table(metrics["seconds"]),
        *more,
    ]
    versions = [[name, str(value)] for name, value in metrics["versions"].items()]
    parts += ["## Versions", markdown(["package", "version"], versions, text_columns=2)]
    return "\n\n".join(parts) + "\n"


def student_report(results: Path) -> list[str]:
    """Paragraphs of those sections of the student's report that `results` holds."""
    parts = []
    for name in CHAPTERS:
        path = results / f"student_{name}.json"
        if path.is_file():
            data = read_json(path)
            parts += student_section(name, data, made_by(data), path.with_suffix(".png").is_file())
    return ["## Student, beside the expert", *parts] if parts else []


def new_gaits(results: Path) -> list[str]:
    """Paragraphs on new gaits for a trained policy, if `results` holds them."""
    path = results / "new_gaits.json"
    if not path.is_file():
        return []
    data = read_json(path)
    return new_gaits_section(data, made_by(data), path.with_suffix(".png").is_file())


def paper(results: Path) -> list[str]:
    """Where the paper's own experiment stands, if `results` holds it."""
    if not (results / "paper.md").is_file():
        return []
    return ["## The paper's tables", "The paper's own experiment, repeated here: [paper.md](paper.md)."]


def expert_report(results: Path) -> list[str]:
    """Paragraphs of the expert's report card, if `results` holds it."""
    path = results / "expert.json"
    if not path.is_file():
        return []
    data = read_json(path)
    return expert_section(
        data, made_by(data), [name for name in PICTURES if (results / f"expert_{name}.png").is_file()]
    )


def benchmarks(results: Path) -> list[str]:
    """Paragraphs of the benchmarks that `results` holds."""
    parts = []
    for name, (title, table) in BENCHMARKS.items():
        path = results / f"benchmark_{name}.json"
        if path.is_file():
            data = read_json(path)
            parts += [f"## {title}", table(data), f"Made by `{without_out(data['command'])}`."]
    return parts


def made_by(scores: Mapping[str, Any]) -> str:
    """The sentence below a table: command, seed and time."""
    minutes = sum(scores["seconds"].values()) / 60
    command = without_out(scores["command"])
    time = "on one core" if "report" in scores else "of wall time"
    return f"Made by `{command}`, seed {scores['seed']}, in {minutes:.0f} min {time}."


def _setting(config: JobConfig, name: str) -> str:
    value = getattr(config, name)
    if value is None or (name in OF_ROUNDS and not config.rounds):
        return "-"
    if isinstance(value, tuple):
        return ", ".join(map(str, value)) or "-"
    return value if isinstance(value, str) else f"{value:g}"
