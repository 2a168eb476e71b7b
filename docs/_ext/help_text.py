"""What a command prints when it is asked for help; needs nothing of Sphinx's."""

import contextlib
import io
import os

from trainers.cli.program import run

COLUMNS = "96"
"""Width of the terminal."""


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
