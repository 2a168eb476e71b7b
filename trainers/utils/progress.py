"""Bars: each by itself, or, inside of a stage, all of them together as the stage's one bar."""

import contextlib
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from types import TracebackType
from typing import Any, Protocol, TypeVar

from tqdm.auto import tqdm

Item = TypeVar("Item")


class Above(Protocol):
    """What a bar reports to instead of showing itself."""

    def advance(self, title: str, fraction: float) -> None:
        """Of the part that is at work now, so much is done.

        Args:
            title: of the part.
            fraction: in [0, 1]; 1 ends it.
        """

    def note(self, **figures: object) -> None:
        """Show figures beside the bar."""


_ABOVE: ContextVar[Above | None] = ContextVar("above", default=None)


@contextlib.contextmanager
def reporting_to(above: Above) -> Iterator[None]:
    """Bars that are made in this block report to something."""
    token = _ABOVE.set(above)
    try:
        yield
    finally:
        if _ABOVE.get() is above:  # a generator that was left behind may be closed much later
            _ABOVE.reset(token)


class Bar:
    """A bar of `tqdm`; inside of a stage, a part of the stage's bar.

    Args:
        title: what is done.
        total: in units.
        unit: of one.
        shown: False shows nothing.
        initial: how much is done already.
    """

    def __init__(self, title: str, total: int, unit: str = "it", shown: bool = True, initial: int = 0) -> None:
        self.title, self.total, self.n = title, total, initial
        self._above = _ABOVE.get() if shown else None
        hidden = not shown or self._above is not None
        self._bar = tqdm(desc=title, total=total, unit=unit, initial=initial, disable=hidden)
        self._reporting = contextlib.ExitStack()

    def __enter__(self) -> "Bar":
        if self._above is not None:
            self._reporting.enter_context(reporting_to(self))
            self._above.advance(self.title, self.n / max(1, self.total))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._reporting.close()
        if self._above is not None and kind is None:
            self._above.advance(self.title, 1.0)
        self._bar.close()

    def update(self, count: int = 1) -> None:
        """So many more are done."""
        self.n += count
        self._bar.update(count)
        if self._above is not None and self.n < self.total:
            self._above.advance(self.title, self.n / self.total)

    def advance(self, title: str, fraction: float) -> None:
        """Of the unit that is at work now, so much is done; of a bar inside of this one's block."""
        if self._above is not None and fraction < 1.0:
            self._above.advance(self.title, min(1.0, (self.n + fraction) / max(1, self.total)))

    def note(self, **figures: object) -> None:
        """Show figures beside the bar."""
        self._bar.set_postfix(figures)
        if self._above is not None:
            self._above.note(**figures)


def tracked(items: Iterable[Item], title: str, total: int, unit: str = "it", shown: bool = True) -> Iterator[Item]:
    """The items, with a bar that moves whenever one is done."""
    with Bar(title, total, unit, shown) as bar:
        for item in items:
            yield item
            bar.update()


def as_text(figures: dict[str, Any]) -> str:
    """Figures as they stand beside a bar."""
    return ", ".join(f"{name} {value}" for name, value in figures.items())
