"""Docstrings as this project writes them, made safe for reStructuredText.

They are plain text with names between backticks: "`Gait`s" and "|vx|" are meant as they stand.
"""

import re
from typing import Any

from sphinx.application import Sphinx


def as_restructured_text(line: str) -> str:
    """A line in which a name may be followed by a letter, and bars are bars; literals stay as they are."""
    parts = re.split(r"(``.+?``)", line)
    for index in range(0, len(parts), 2):
        text = re.sub(r"(`[^`]+`)(?=\w)", r"\1\\ ", parts[index])
        parts[index] = text.replace("|", "\\|")
    return "".join(parts)


def on_docstring(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Mend a docstring in place, as `autodoc-process-docstring` hands it over."""
    lines[:] = [as_restructured_text(line) for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Look at every docstring before napoleon does."""
    app.connect("autodoc-process-docstring", on_docstring, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
