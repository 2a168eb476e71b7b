"""Worker processes that leave Ctrl-C to the process that began them."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from multiprocessing import resource_tracker


@contextlib.contextmanager
def keep_interrupts() -> Iterator[None]:
    """Processes that are begun in this block never see Ctrl-C; this one sees it when the block is over.

    The terminal sends SIGINT to every process of a program at once, and each worker would die with a traceback of its
    own. The mask of blocked signals is inherited, so that workers are safe from their first instruction on. Whoever
    began them must end them, as joblib and stable-baselines3 do.
    """
    if not hasattr(signal, "pthread_sigmask") or threading.current_thread() is not threading.main_thread():
        yield
        return
    from joblib.externals.loky.backend import resource_tracker as loky_resource_tracker  # help does not wait for it

    for tracker in (resource_tracker, loky_resource_tracker):
        tracker.ensure_running()  # starting it unblocks SIGINT on Python up to 3.11, so it must be there before
    came: list[int] = []  # the mask is this thread's alone; another one may still receive the signal
    handler = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, signal.SIG_DFL if handler is None else handler)
        if came:
            signal.raise_signal(signal.SIGINT)
