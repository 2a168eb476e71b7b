"""Compiles the expert's small loops with Numba, and keeps the machine code on disk wherever that can be had.

Numba writes what it compiled next to the source, below the user's home, or into ``NUMBA_CACHE_DIR``. Where none of
these can be written to, it refuses to make a cached function; where a file of the cache is damaged, each call fails
until somebody deletes it. Neither is a reason not to walk: the function is then compiled for this process alone.

What a loop takes from other modules it takes as an argument: Numba freezes globals into the machine code and looks only
at a function's own file to tell whether the code is stale.
"""

import warnings
from collections.abc import Callable
from functools import update_wrapper
from typing import Any, TypeVar, cast

from numba import njit, typeof

_Function = TypeVar("_Function", bound=Callable[..., Any])


def compiled(function: _Function) -> _Function:
    """Compile what Python calls; the machine code is kept on disk if possible.

    Compiled code cannot call the result: that is what `inlined` is for.
    """
    return cast(_Function, _Guarded(function))


def inlined(function: _Function) -> _Function:
    """Compile what `compiled` functions of the same file call; it becomes part of their machine code."""
    helper: Any = njit(function)
    return cast(_Function, helper)


class _Guarded:
    """A compiled function that is compiled once more, without the cache, should the cache fail.

    Args:
        function: in Python.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self._function = function
        try:
            self._dispatcher = njit(cache=True)(function)
        except RuntimeError:  # no place for the cache: "no locator available for file ..."
            self._dispatcher = njit(function)

    def __call__(self, *args: object) -> object:
        """Run the machine code; the first call for new types of arguments loads or compiles it."""
        try:
            return self._dispatcher(*args)
        except Exception as error:
            # What a damaged file raises depends on where it is damaged: EOFError, UnpicklingError, ValueError, ...
            folder = self._dispatcher.stats.cache_path
            if folder is None or tuple(map(typeof, args)) in self._dispatcher.signatures:
                raise  # it was there, and ran: the error is the function's
            self._dispatcher = njit(self._function)
            answer = self._dispatcher(*args)
            message = (
                f"compiled {self._function.__name__} for this process alone: Numba's cache in {folder} is unusable"
            )
            warnings.warn(f"{message} ({type(error).__name__}: {error}); delete it", RuntimeWarning, stacklevel=2)
            return answer
