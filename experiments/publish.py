"""Pages of results in ``docs/results/`` and the summary in ``README.md``, written from the results files.

Nothing in them is typed by hand; ``--check`` fails when what is committed is out of date.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

from experiments import main_job
from experiments.catalog import STUDIES, resolve, study_class
from experiments.copying import CERTIFICATES, FILM, FILMED, POLICIES, copy_certificate, copy_run, film, is_certificate
from experiments.plots import save_figure
from experiments.results import Results
from experiments.tables import markdown
from go1_mtl_gym.errors import InvalidInputError
from trainers import Certificate
from trainers.utils.files import write_atomically

ROOT = Path(__file__).resolve().parents[1]
SUMMARY = ("<!-- results:summary -->", "<!-- /results:summary -->")
"""Around the table in README.md."""
GENERATED = "<!-- Written by `python -m experiments publish` from the files beside it; do not edit. -->"


@dataclass(frozen=True)
class Page:
    """A page of several studies.

    Attributes:
        title: of the page.
        studies: beginning of their names.
        about: a sentence below the title.
        lead: module and function of paragraphs above the studies, made of {study: results}; empty for none.
    """

    title: str
    studies: str
    about: str
    lead: str = ""


PAGES = {
    "expert": Page("The expert", "expert_", "The MPC expert alone, gait by gait.", "experiments.expert.card:card"),
    "student": Page(
        "The student", "student_", "Policies beside the expert, each in the environment that it was made for."
    ),
    "new_gaits": Page("New gaits for a trained policy", "new_gaits", "What it takes to teach a policy one more gait."),
    "any_gait": Page("Any gait", "any_gait_", "The space of gaits, and one network for all of it."),
    "paper": Page(
        "The paper's tables",
        "paper_",
        "The tables of arXiv 2505.08574, and ours beside them. All metrics are one-step errors of the joint targets on "
        "states that the expert visited with commands that nobody was trained on. They say how well a network fits its "
        "own expert, and nothing about whether it walks.",
        "experiments.paper.study:summary",
    ),
    "driving": Page(
        "Taking hold of it",
        "driving_",
        "How long it takes until somebody drives, and how true the page in the browser is.",
    ),
    "benchmarks": Page(
        "Benchmarks",
        "benchmark_",
        "Everybody takes turns in one process, so that whatever else the machine does meets all alike; only the ratios "
        "mean something on another machine.",
    ),
}
"""Name of the file -> page; ``main_job.md`` is beside them."""


def page(name: str, folder: Path) -> str | None:
    """The text of a page; None if nothing of it was measured."""
    about, measured, sections = PAGES[name], {}, []
    for study in (each for each in STUDIES if each.startswith(about.studies)):
        path = folder / f"{study}.json"
        if path.is_file():
            measured[study] = Results.read(path)
            sections += section(study, measured[study], folder)
    if not measured:
        return None
    lead = [f"# {about.title}", GENERATED, about.about, *(resolve(about.lead)(measured) if about.lead else [])]
    return "\n\n".join([*lead, *sections, *how_it_was_made([*measured.values()])]) + "\n"


def section(name: str, results: Results, folder: Path) -> list[str]:
    """Paragraphs of one study, with those of its pictures that are in the folder."""
    cls = study_class(name)
    captions = {f"{name}{end}.png": caption for end, caption in ({"": cls.caption} | cls.more_captions).items()}
    shown = [f"![{text}]({file})" for file, text in captions.items() if text and (folder / file).is_file()]
    return [f"## {cls.title}", *cls(cls.full).paragraphs(results), *shown]


def draw(name: str, folder: Path) -> None:
    """Redraw the picture of a study from its results."""
    cls = study_class(name)
    figure = cls(cls.full).figure(Results.read(folder / f"{name}.json"))
    if figure is not None:
        save_figure(figure, folder / f"{name}.png")


def how_it_was_made(measured: list[Results]) -> list[str]:
    """Command, seed, time, processor and versions of several results."""
    rows, versions = [], {}
    for results in measured:
        processor = (results.machine or {}).get("processor", "-")
        minutes = f"{results.minutes:.0f}" if results.seconds else "-"
        rows.append([results.study, f"`{results.command}`", str(processor), str(results.seed), minutes])
        versions.setdefault(", ".join(f"{name} {value}" for name, value in results.versions.items()), results.study)
    table = markdown(["study", "made by", "processor", "seed", "one core [min]"], rows, text_columns=3)
    again = "The commands are those of the run; `python -m experiments run STUDY` measures a study again."
    many = len(versions) > 1
    lines = [f"Versions{f' (from {study} on)' * many}: {text}." for text, study in versions.items()]
    return ["## How this was made", table, again, *lines]


def main_job_page(results: Results) -> str:
    """The text of ``main_job.md``."""
    parts = ["# The main job", GENERATED, *main_job.tables(results), *how_it_was_made([results])]
    return "\n\n".join(parts) + "\n"


def summarized(text: str, table: str) -> str:
    """A text with a table between the markers of the summary.

    Raises:
        InvalidInputError: if the markers are missing, repeated or in the wrong order.
    """
    begin, end = SUMMARY
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
        raise InvalidInputError(f"README.md must hold the markers {begin} and {end} once, in this order")
    head, _, rest = text.partition(begin)
    return f"{head}{begin}\n\n{table}\n\n{end}{rest.partition(end)[2]}"


def texts(root: Path) -> dict[Path, str]:
    """Every file that is written, and what belongs into it."""
    folder, readme = root / "docs" / "results", root / "README.md"
    if not readme.is_file():
        raise InvalidInputError(f"there is no {readme}")
    files = {folder / f"{name}.md": text for name in PAGES if (text := page(name, folder)) is not None}
    for path in folder.glob(CERTIFICATES):
        certificate = Certificate.read(path)
        files[path.with_suffix(".md")] = certificate.markdown()
    path = folder / f"{main_job.NAME}.json"
    if path.is_file():
        results = Results.read(path)
        files[path.with_suffix(".md")] = main_job_page(results)
        files[readme] = summarized(readme.read_text(encoding="utf-8"), main_job.summary_table(results))
    return files


def publish_command(arguments: list[str], root: Path = ROOT) -> None:
    """``publish``: write what is out of date.

    Raises:
        InvalidInputError: if something is out of date and is only to be checked.
    """
    about = "Write docs/results/ and the summary of README.md from the results files."
    parser = argparse.ArgumentParser(prog="python -m experiments publish", description=about)
    about_folder = "of a finished main job, or of a certificate of a policy in the package; copied first"
    parser.add_argument("folder", type=Path, nargs="?", help=about_folder)
    parser.add_argument("--check", action="store_true", help="change nothing; fail if something is out of date")
    parser.add_argument("--film", action="store_true", help=f"make {FILM} anew, of the policy in the package")
    parser.add_argument("--draw", nargs="+", default=[], choices=tuple(STUDIES), help="redraw the pictures of studies")
    options = parser.parse_args(arguments)
    for name in options.draw:
        draw(name, root / "docs" / "results")
    texts(root)  # a README without markers is an error before anything is copied
    if options.folder is not None and not options.check:
        (copy_certificate if is_certificate(options.folder) else copy_run)(options.folder, root)
    if options.film and not options.check:
        film(root / "trainers" / "assets" / POLICIES[FILMED], root)
    wanted = texts(root)
    stale = [path for path, text in wanted.items() if not path.is_file() or path.read_text(encoding="utf-8") != text]
    names = ", ".join(str(path.relative_to(root)) for path in stale)
    if options.check and stale:
        raise InvalidInputError(f"out of date: {names}; python -m experiments publish writes them")
    for path in stale:
        write_atomically(path, lambda file, path=path: file.write(wanted[path].encode()))
    print(f"wrote {names}" if stale else "up to date")
