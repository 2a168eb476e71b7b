"""A directive that puts the help of a command onto a page, as a terminal shows it.

A page asks for one by name, or for that of all commands by none:

    ```{command-help} certify
    ```
"""

from typing import ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from docs._ext.help_text import help_of


class CommandHelp(SphinxDirective):
    """Puts the help of a command onto a page."""

    optional_arguments: ClassVar[int] = 1

    def run(self) -> list[nodes.Node]:
        """A block of text."""
        text = help_of(*self.arguments)
        return [nodes.literal_block(text, text, language="text")]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("command-help", CommandHelp)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
