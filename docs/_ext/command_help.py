"""A directive that puts the help of a command onto a page, as a terminal shows it.

A page asks for one by name, or for that of all commands by none:

    ```{command-help} certify
    ```
"""

import contextlib
import io
import os
from typing import ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from trainers.cli.program import run

COLUMNS = "96"
"""Width of the terminal."""


class CommandHelp(SphinxDirective):
    """Puts the help of a command onto a page."""

    optional_arguments: ClassVar[int] = 1

    def run(self) -> list[nodes.Node]:
        """A block of text."""
        text = help_of(*self.arguments)
        return [nodes.literal_block(text, text, language="text")]


def help_of(*command: str) -> str:
    """What ``go1-mtl-gym COMMAND --help`` prints, without colors."""
    printed = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")  # a terminal that has lines
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = COLUMNS
    try:
        with contextlib.redirect_stdout(printed), contextlib.suppress(SystemExit):
            run([*command, "--help"])
    finally:
        os.environ.pop("COLUMNS")
        if before is not None:
            os.environ["COLUMNS"] = before
    printed.seek(0)
    return printed.read().strip()


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("command-help", CommandHelp)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
