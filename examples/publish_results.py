"""Put the numbers of a run where visitors see them: ``docs/results/`` and the marked blocks of ``README.md``.

    python examples/publish_results.py RUN_DIR      copy a run of examples/dagger.py and its students, then write both
    python examples/publish_results.py              write both from what docs/results/ holds already
    python examples/publish_results.py --check      change nothing; fail if README.md or the page is out of date

No table of results in README.md is typed by hand: runs come from the JSON files in
``docs/results/``, gaits and presets from the code.
"""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

from expert_report.page import expert_block
from paper_report.page import summary_table
from publishing.runs import copy_run, read_json
from publishing.text import (
    benchmarks,
    expert_report,
    gaits_block,
    made_by,
    new_gaits,
    new_gaits_block,
    paper,
    presets_block,
    results_block,
    results_page,
    student_report,
)
from student_report.page import student_block

from go1_mtl_gym.errors import InvalidInputError
from trainers.utils.files import write_atomically

ROOT = Path(__file__).resolve().parents[1]


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
        blocks["results"] = results_block(read_json(results / "metrics.json"))
    if (results / "new_gaits.json").is_file():
        blocks["new_gaits"] = new_gaits_block(read_json(results / "new_gaits.json"))
    if (results / "paper.json").is_file():
        blocks["paper"] = summary_table(read_json(results / "paper.json")["tables"])
    if (results / "expert.json").is_file():
        expert = read_json(results / "expert.json")
        blocks["expert"] = expert_block(expert, made_by(expert))
    if (results / "student_commanded.json").is_file():
        commanded = read_json(results / "student_commanded.json")
        blocks["student"] = student_block(commanded, made_by(commanded))
    return blocks


def pages(root: Path) -> dict[Path, str]:
    """Every file that `main` writes, and what belongs into it."""
    readme, results = root / "README.md", root / "docs" / "results"
    if not readme.is_file():
        raise InvalidInputError(f"there is no {readme}")
    texts = {readme: rewrite(readme.read_text(encoding="utf-8"), current_blocks(results))}
    if (results / "metrics.json").is_file():
        sections = (student_report, new_gaits, paper, expert_report, benchmarks)
        more = [paragraph for section in sections for paragraph in section(results)]
        texts[results / "README.md"] = results_page(read_json(results / "metrics.json"), more)
    return texts


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
