"""One process at a time in a folder whose files are read, completed and written again."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from go1_mtl_gym.errors import InvalidInputError

LOCK = ".lock"
"""File of the lock, which the system releases when its process ends, however it ends."""


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Keep other processes that ask for it out of a folder, which is made if it is missing.

    Raises:
        InvalidInputError: if another one is there already.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / LOCK, timeout=0)
    try:
        with contextlib.suppress(NotImplementedError):  # some network file systems have no locks
            lock.acquire()
    except Timeout:
        raise InvalidInputError(
            f"another process is at work in {str(folder)!r}: let it end first, or choose another folder"
        ) from None
    try:
        yield
    finally:
        lock.release()
