"""Names of the version before: they work for one more release, and say what to write instead."""

import functools
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

Made = TypeVar("Made", bound=type)


def warn_renamed(old: str, new: str, stacklevel: int = 2) -> None:
    """Say that a name is an old one.

    Args:
        old, new: the names.
        stacklevel: whose line the warning shows, counted from the caller of this function.
    """
    warnings.warn(f"{old} is an old name; write {new}", DeprecationWarning, stacklevel=stacklevel + 1)


def renamed_arguments(**names: str) -> Callable[[Made], Made]:
    """A class decorator: keyword arguments of the constructor go by their old names too, and so do attributes.

    Args:
        names: old name -> new name.
    """

    def decorate(kind: Made) -> Made:
        init = kind.__init__  # type: ignore[misc]

        @functools.wraps(init)
        def translate(self: Any, *positional: Any, **keyword: Any) -> None:
            for old in names.keys() & keyword.keys():
                warn_renamed(f"{kind.__name__}({old}=)", names[old])
                keyword[names[old]] = keyword.pop(old)
            init(self, *positional, **keyword)

        kind.__init__ = translate  # type: ignore[misc]
        for old, new in names.items():
            setattr(kind, old, _renamed_attribute(f"{kind.__name__}.{old}", new))
        return kind

    return decorate


def _renamed_attribute(old: str, new: str) -> property:
    def read(self: Any) -> Any:
        warn_renamed(old, new)
        return getattr(self, new)

    return property(read)
