"""Docstrings as this project writes them, made safe for reStructuredText.

They are plain text with names between backticks ("`Gait`s" and "|vx|" are meant as they stand); an environment's, which
Gymnasium shows too, has Markdown's headings and tables.
"""

import re
from collections.abc import Iterator

from sphinx.application import Sphinx


def as_restructured_text(lines: list[str]) -> Iterator[str]:
    """The lines of a docstring, with directives in place of Markdown's headings and tables."""
    table: list[str] = []
    for line in [*lines, ""]:
        if line.startswith("|") and line.endswith("|"):
            table.append(line)
            continue
        if table:
            yield from _list_table(table)
            table = []
        heading = re.fullmatch("#+ (.+)", line)
        yield f".. rubric:: {heading[1]}" if heading else plain(line)


def plain(line: str) -> str:
    """A line in which a name may be followed by a letter, and bars are bars; literals stay as they are."""
    parts = re.split(r"(``.+?``)", line)
    for index in range(0, len(parts), 2):
        text = re.sub(r"(`[^`]+`)(?=\w)", r"\1\\ ", parts[index])
        parts[index] = text.replace("|", "\\|")
    return "".join(parts)


def _list_table(table: list[str]) -> Iterator[str]:
    yield from (".. list-table::", "   :header-rows: 1", "")
    for row in table[:1] + table[2:]:
        for index, cell in enumerate(row.strip("|").split("|")):
            text = re.sub(r"^[-*+]$", r"\\\g<0>", plain(cell.strip()))  # alone, it would begin a list
            yield f"   {'  ' if index else '* '}- {text}".rstrip()
    yield ""


def on_docstring(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Mend a docstring in place, as `autodoc-process-docstring` hands it over."""
    lines[:] = as_restructured_text(lines)


def setup(app: Sphinx) -> dict[str, bool]:
    """Look at every docstring before napoleon does."""
    app.connect("autodoc-process-docstring", on_docstring, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
