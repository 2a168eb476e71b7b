"""Put the numbers of a run where visitors see them: ``docs/results/`` and the marked blocks of ``README.md``.

    python examples/publish_results.py RUN_DIR      copy a run of examples/dagger.py and its students, then write both
    python examples/publish_results.py              write both from what docs/results/ holds already
    python examples/publish_results.py --check      change nothing; fail if README.md or the page is out of date

No table of results in README.md is typed by hand: runs come from ``metrics.json``, ``expert.json`` and
``benchmark_expert.json`` in ``docs/results/``, gaits and presets from the code.
"""

import argparse
import json
import shlex
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from expert_report.page import PICTURES, expert_block, expert_section
from main_job.config import PRESETS, JobConfig
from student_report.page import CHAPTERS, student_block, student_section

from go1_mtl_gym import TASKS, env_id
from go1_mtl_gym.errors import InvalidInputError
from trainers.files import write_atomically, write_json
from trainers.report import benchmark_table, markdown, paper_table, results_table, seconds_table

ROOT = Path(__file__).resolve().parents[1]
COPIED = ("joint_targets.png", "gaits.gif")
"""Files of a run that are published as they are, next to ``metrics.json``."""
STUDENTS = {"policy.zip": "clocked.zip", "clockless.zip": "clockless.zip"}
"""Policies of a run, and their names in ``trainers/assets/``, from where `trainers.load_pretrained` reads them."""
PUBLISHED_PRESET = "default"
FOLDERS = ("--out", "--out-dir", "--parts")
"""Options of a command that say where its files go."""
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
    "clockless_s": "the student's walks that tell it the phase, per gait [s]",
    "episodes": "evaluation episodes per gait and learner",
    "episode_s": "duration of an episode [s]",
}
"""Rows of the table of presets: attribute of `JobConfig` and how it is called."""
OF_ROUNDS = ("dagger_s", "round_steps")
"""Those that mean nothing without a DAgger round."""


# -- A run's files -----------------------------------------------------------------------------------------------------


def copy_run(run: Path, root: Path) -> None:
    """Copy what is published of a run; the output folder, which only its machine knows, is cut from the command.

    Args:
        run: output folder of the main job.
        root: of the checkout; results go to ``docs/results``, students to ``trainers/assets``.

    Raises:
        InvalidInputError: if files are missing (all are named), the metrics cannot be read, or the run is not one of
            the preset that is published.
    """
    results, students = root / "docs" / "results", root / "trainers" / "assets"
    missing = [name for name in ("metrics.json", *COPIED, *STUDENTS) if not (run / name).is_file()]
    if missing:
        raise InvalidInputError(
            f"{run} lacks {', '.join(missing)}; expected the --out folder of a finished examples/dagger.py"
            + (" (gaits.gif needs OpenGL)" if "gaits.gif" in missing else "")
        )
    metrics = read_json(run / "metrics.json")
    results_table(metrics)
    preset = metrics.get("config", {}).get("preset")
    if preset != PUBLISHED_PRESET:
        raise InvalidInputError(f"a run of the preset {PUBLISHED_PRESET!r} was expected, {run} is one of {preset!r}")
    metrics["command"] = without_out(metrics.get("command", "python examples/dagger.py"))
    write_json(results / "metrics.json", metrics)
    for name in COPIED:
        shutil.copyfile(run / name, results / name)
    students.mkdir(parents=True, exist_ok=True)
    for name, published in STUDENTS.items():
        shutil.copyfile(run / name, students / published)


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file.

    Raises:
        InvalidInputError: if the file is missing or holds something else.
    """
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InvalidInputError(f"there is no {path}") from error
    except ValueError as error:
        raise InvalidInputError(f"{path} is not JSON: {error}") from error
    if not isinstance(value, dict):
        raise InvalidInputError(f"{path} must hold a JSON object, got {type(value).__name__}")
    return value


def without_out(command: str) -> str:
    """A command line without the options that name folders of its machine (`FOLDERS`), and without their values."""
    words, kept = iter(shlex.split(command)), []
    for word in words:
        if word in FOLDERS:
            next(words, None)
        elif word.partition("=")[0] not in FOLDERS:
            kept.append(word)
    return shlex.join(kept)


# -- Text --------------------------------------------------------------------------------------------------------------


def results_block(metrics: Mapping[str, Any]) -> str:
    """The results of the main job, for README.md."""
    return "\n\n".join([results_table(metrics), _made_by(metrics)])


def paper_block(metrics: Mapping[str, Any]) -> str:
    """R2 here and in the paper, for README.md."""
    return paper_table(metrics)


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


def results_page(
    metrics: Mapping[str, Any],
    expert: Mapping[str, Any] | None,
    pictures: Sequence[str] = (),
    benchmark: Mapping[str, Any] | None = None,
    student: Sequence[str] = (),
) -> str:
    """``docs/results/README.md``.

    Args:
        metrics: of the main job.
        expert: its report, if there is one.
        pictures: names of the expert's pictures that are there.
        benchmark: of the expert against others, if there is one.
        student: paragraphs of the student's report, if there is one.
    """
    parts = [
        "# Results",
        "Written by `examples/publish_results.py` from the files beside it; do not edit.",
        "![The student in four gaits](gaits.gif)",
        "## Student and baselines",
        results_table(metrics),
        _made_by(metrics),
        "![Joint targets of the student and of the expert](joint_targets.png)",
        "## R2 here and in the paper",
        paper_table(metrics),
        "The settings differ (another expert, other gains, rates, commands and inputs; walk was measured on hardware), "
        "so the table says how well each network fits its own expert, not which one is better.",
        "## Wall time",
        seconds_table(metrics["seconds"]),
        *student,
    ]
    if expert is not None:
        parts += expert_section(expert, _made_by(expert), pictures)
    if benchmark is not None:
        parts += ["## Expert against others", benchmark_table(benchmark), f"Made by `{benchmark['command']}`."]
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
            parts += student_section(name, data, _made_by(data), path.with_suffix(".png").is_file())
    return ["## Student, beside the expert", *parts] if parts else []


def rewrite(text: str, blocks: Mapping[str, str]) -> str:
    """`text` with what stands between ``<!-- NAME:begin -->`` and ``<!-- NAME:end -->`` replaced by each block.

    Raises:
        InvalidInputError: if a block's markers are missing, repeated or in the wrong order.
    """
    for name, block in blocks.items():
        begin, end = f"<!-- {name}:begin -->", f"<!-- {name}:end -->"
        if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
            raise InvalidInputError(f"README.md must hold the markers {begin} and {end} once, in this order")
        head, _, rest = text.partition(begin)
        text = head + begin + f"\n\n{block}\n\n" + end + rest.partition(end)[2]
    return text


def current_blocks(results: Path) -> dict[str, str]:
    """Text of every block of README.md that can be written from the code and from what `results` holds."""
    blocks = {"gaits": gaits_block(), "presets": presets_block()}
    if (results / "metrics.json").is_file():
        metrics = read_json(results / "metrics.json")
        blocks |= {"results": results_block(metrics), "paper": paper_block(metrics)}
    if (results / "expert.json").is_file():
        expert = read_json(results / "expert.json")
        blocks["expert"] = expert_block(expert, _made_by(expert))
    if (results / "student_commanded.json").is_file():
        commanded = read_json(results / "student_commanded.json")
        blocks["student"] = student_block(commanded, _made_by(commanded))
    return blocks


def pages(root: Path) -> dict[Path, str]:
    """Every file that `main` writes, and what belongs into it."""
    readme, results = root / "README.md", root / "docs" / "results"
    if not readme.is_file():
        raise InvalidInputError(f"there is no {readme}")
    texts = {readme: rewrite(readme.read_text(encoding="utf-8"), current_blocks(results))}
    if (results / "metrics.json").is_file():
        files = [results / f"{name}.json" for name in ("metrics", "expert", "benchmark_expert")]
        metrics, expert, benchmark = (read_json(path) if path.is_file() else None for path in files)
        pictures = [name for name in PICTURES if (results / f"expert_{name}.png").is_file()]
        texts[results / "README.md"] = results_page(metrics, expert, pictures, benchmark, student_report(results))
    return texts


def _made_by(scores: Mapping[str, Any]) -> str:
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


def _write(path: Path, text: str) -> None:
    write_atomically(path, lambda file: file.write(text.encode()))


def main(arguments: list[str] | None = None, root: Path = ROOT) -> int:
    """Run from the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description="Write docs/results/ and the marked blocks of README.md.")
    parser.add_argument("run", type=Path, nargs="?", help="output folder of a finished examples/dagger.py")
    parser.add_argument("--check", action="store_true", help="change nothing; fail if something is out of date")
    options = parser.parse_args(arguments)
    try:
        pages(root)  # a README without markers is an error before anything is copied
        if options.run is not None and not options.check:
            copy_run(options.run, root)
        texts = pages(root)
    except InvalidInputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    stale = [path for path, text in texts.items() if not path.is_file() or path.read_text(encoding="utf-8") != text]
    names = ", ".join(str(path.relative_to(root)) for path in stale)
    if options.check:
        print(f"out of date: {names}" if stale else "up to date")
        return int(bool(stale))
    for path in stale:
        _write(path, texts[path])
    print(f"wrote {names}" if stale else "nothing to change")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
