"""Which keys are held in which tab: tabs can fall silent, and then nobody holds anything."""

from trainers.play.controls import Controls

SILENT_S = 1.0
"""A hold that was not heard of for so long is over: the tab is gone, or hidden, or the line is dead. Browsers that draw
by software may be silent for half of it [s]."""


class Holds:
    """Brings the keys that several tabs hold together, and lets those go that are held in none.

    Args:
        controls: that the keys reach.
    """

    def __init__(self, controls: Controls) -> None:
        self._controls = controls
        self._heard_s: dict[tuple[int, str], float] = {}

    def hold(self, tab: int, key: str, time_s: float) -> None:
        """A tab says that a key is held; to be said again and again.

        Args:
            tab: its number.
            key: by its name, as `Controls.key` has it.
            time_s: now, by a clock that never goes back [s].
        """
        if not self._is_held(key):
            self._controls.key(key, True)
        self._heard_s[tab, key] = time_s

    def release(self, tab: int, key: str) -> None:
        """A tab says that a key is not held any more."""
        if self._heard_s.pop((tab, key), None) is not None and not self._is_held(key):
            self._controls.key(key, False)

    def leave(self, tab: int) -> None:
        """A tab was closed."""
        for holder, key in list(self._heard_s):
            if holder == tab:
                self.release(tab, key)

    def forget_silent(self, time_s: float) -> None:
        """Let go what nobody has said anything of for `SILENT_S`."""
        for (tab, key), heard_s in list(self._heard_s.items()):
            if time_s - heard_s > SILENT_S:
                self.release(tab, key)

    def _is_held(self, key: str) -> bool:
        return any(held == key for _, held in self._heard_s)
