"""Programs for the command line: an error is one sentence on stderr and an exit status, never a traceback."""

import functools
import sys
from collections.abc import Callable, Sequence

from go1_mtl_gym.errors import Go1Error

BAD_INPUT = 2
"""Exit status after an error that the user can mend, as `argparse` has it."""
INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells have it: 128 + SIGINT."""

Program = Callable[[Sequence[str] | None], None]
"""Takes the words after the program's name; None stands for those of this process."""


def main(program: Program) -> Callable[..., int]:
    """Make a program end with an exit status instead of a traceback.

    It decorates the function that a script runs::

        @main
        def run(arguments=None):
            ...

        if __name__ == "__main__":
            raise SystemExit(run())

    Errors that this project raises on purpose, and files that cannot be read or written, are the user's to mend; any
    other error is a bug, and keeps its traceback.

    Args:
        program: may raise ``KeyboardInterrupt("what is kept")`` to tell what to do after Ctrl-C.

    Returns:
        A function of the same arguments that returns the exit status: 0, `BAD_INPUT` or `INTERRUPTED`.
    """

    @functools.wraps(program)
    def run(arguments: Sequence[str] | None = None) -> int:
        try:
            program(arguments)
        except KeyboardInterrupt as interrupt:
            print("; ".join(["\ninterrupted", *map(str, interrupt.args)]), file=sys.stderr)
            return INTERRUPTED
        except (Go1Error, OSError) as error:
            print(f"error: {_sentence(error)}", file=sys.stderr)
            return BAD_INPUT
        return 0

    return run


def _sentence(error: Exception) -> str:
    """The message on one line; the kind of error where there is none."""
    return " ".join(str(error).split()) or type(error).__name__
