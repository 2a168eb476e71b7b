"""What a policy remembers for a caller who hands no state back."""

import warnings
from typing import NamedTuple

import numpy as np

State = tuple[np.ndarray, ...]
"""Clocks as (sine, cosine), shape (n, 2), and indices of the tasks, shape (n,)."""


class _Call(NamedTuple):
    """A call without a state.

    Attributes:
        returned: the very state that it returned.
        state: a copy of it.
        began: whether nothing was remembered in it.
        before: the last call before one that began.
    """

    returned: State
    state: State
    began: bool
    before: "_Call | None" = None


class ClockMemory:
    """The clocks of the last call without a state.

    A caller who keeps states begins without one too. He is told from one who does not as soon as he hands the first
    state back; then it is remembered again what was before his first call.
    """

    def __init__(self) -> None:
        self._last: _Call | None = None
        self._warned = False

    def forget(self) -> None:
        """Begin anew with the next call."""
        self._last = None

    def recall(self, n: int, starts: np.ndarray) -> State | None:
        """The state that a call without one goes on from; None begins anew, as for another number of observations.

        Args:
            n: observations.
            starts: where an episode begins, bool, shape (n,).
        """
        if self._last is None or starts.all():
            return None
        state = self._last.state
        if len(state[1]) == n:
            return state
        if not self._warned:
            self._warned = True
            warnings.warn(
                f"predict got {n} observations and no state after {len(state[1])}: every clock begins anew. For "
                "several robots hand back the state that predict returned; for others call reset() first; for rows "
                "that do not follow one another in time there is with_correction(1.0)",
                stacklevel=3,  # whoever called predict
            )
        return None

    def keep(self, state: State, began: bool) -> None:
        """Remember what a call without a state returned.

        Args:
            state: that it returned.
            began: whether nothing was recalled for it.
        """
        before = self._last._replace(before=None) if began and self._last is not None else None
        self._last = _Call(state, tuple(part.copy() for part in state), began, before)

    def handed_back(self, state: State) -> None:
        """Take note that a caller keeps his states himself: a call of his that began is not remembered."""
        if self._last is not None and self._last.began and state is self._last.returned:
            self._last = self._last.before
