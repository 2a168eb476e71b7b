"""Programs for the command line: an error is one sentence on stderr and an exit status, never a traceback."""

import argparse
import contextlib
import functools
import os
import shlex
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from go1_mtl_gym.errors import Go1Error, InvalidInputError
from trainers.utils.validation import positive

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
            with _interrupted_by_signals():
                program(arguments)
        except Terminated as end:
            print("\nterminated", file=sys.stderr)
            return 128 + end.number
        except KeyboardInterrupt as interrupt:
            print("; ".join(["\ninterrupted", *map(str, interrupt.args)]), file=sys.stderr)
            return INTERRUPTED
        except (Go1Error, OSError) as error:
            print(f"error: {_sentence(error)}", file=sys.stderr)
            return BAD_INPUT
        return 0

    return run


class Terminated(KeyboardInterrupt):
    """The program was told to end by another signal than Ctrl-C: by ``kill``, or since its terminal is gone.

    Args:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


@contextlib.contextmanager
def _interrupted_by_signals() -> Iterator[None]:
    """Let what would end the process at once end it as Ctrl-C does: what is done is kept."""
    names = ("SIGTERM", "SIGHUP")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():
        numbers = []  # Python has signals in its main thread alone
    own, before = os.getpid(), {number: signal.getsignal(number) for number in numbers}

    def end(number: int, frame: object) -> None:
        if os.getpid() == own:
            raise Terminated(number)
        signal.signal(number, signal.SIG_DFL)  # a process that was forked from this one
        os.kill(os.getpid(), number)

    replaced = [number for number, handler in before.items() if handler is signal.SIG_DFL]  # nohup ignores one
    for number in replaced:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in replaced:
            signal.signal(number, signal.SIG_DFL)


def positive_float(text: str) -> float:
    """A finite number above zero, as the `type` of an argument of `argparse`.

    Raises:
        argparse.ArgumentTypeError: if the text is something else.
    """
    try:
        return positive(float(text), "it")
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a finite number > 0, got {text!r}") from None


def positive_int(text: str) -> int:
    """A whole number above zero, as the `type` of an argument of `argparse`.

    Raises:
        argparse.ArgumentTypeError: if the text is something else.
    """
    try:
        positive(number := int(text), "it")
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a whole number > 0, got {text!r}") from None
    return number


def writable_file(path: str | Path) -> Path:
    """Return the path of a file after a proof that it can be written; nothing is left behind.

    Ask before long work, whose result would be lost otherwise.

    Raises:
        InvalidInputError: if it is a folder, or no file can be made beside it.
    """
    file = Path(path)
    if file.is_dir():
        raise InvalidInputError(f"the path of a file was expected, got the folder {str(path)!r}")
    _prove_writable(file.parent, file)
    return file


def writable_folder(path: str | Path) -> Path:
    """Return the path of a folder after a proof that files can be made in it, or that it can be made itself.

    Raises:
        InvalidInputError: if neither is so.
    """
    _prove_writable(Path(path), Path(path))
    return Path(path)


def _prove_writable(folder: Path, asked_for: Path) -> None:
    present = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    try:
        with tempfile.TemporaryDirectory(dir=present):
            pass
    except OSError as error:
        raise InvalidInputError(f"{str(asked_for)!r} cannot be written: {error.strerror}") from error


def interpreter() -> str:
    """What to type for the Python that runs: its path from the working directory if it lies below, else "python"."""
    try:
        return shlex.quote(Path(sys.executable).relative_to(Path.cwd()).as_posix())
    except ValueError:
        return "python"


def program() -> str:
    """What to type for the command line: its own name where the shell finds it, else the interpreter and the module."""
    found = shutil.which("go1-mtl-gym")
    beside = found is not None and Path(found).parent == Path(sys.executable).parent
    return "go1-mtl-gym" if beside else f"{interpreter()} -m trainers"


def _sentence(error: Exception) -> str:
    """The message on one line; the kind of error where there is none."""
    return " ".join(str(error).split()) or type(error).__name__
