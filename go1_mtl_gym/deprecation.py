"""Names of the version before: they work for one more release, and say what to write instead."""

import functools
import warnings
from collections.abc import Callable
from dataclasses import is_dataclass
from typing import TypeVar

Made = TypeVar("Made", bound=type)


def warn_renamed(old: str, new: str, stacklevel: int = 2) -> None:
    """Say that a name is an old one.

    Args:
        old: what was written.
        new: what to write instead.
        stacklevel: whose line the warning shows, counted from the caller of this function.
    """
    warnings.warn(f"{old} is an old name; write {new}", DeprecationWarning, stacklevel=stacklevel + 1)


def renamed_arguments(**names: str) -> Callable[[Made], Made]:
    """A class decorator: keyword arguments of the constructor go by their old names too, and fields of dataclasses.

    Args:
        names: old name -> new name.
    """

    def decorate(kind: Made) -> Made:
        init = kind.__init__  # type: ignore[misc]

        @functools.wraps(init)
        def translate(self: object, *positional: object, **keyword: object) -> None:
            for old in names.keys() & keyword.keys():
                warn_renamed(f"{kind.__name__}({old}=)", names[old])
                keyword[names[old]] = keyword.pop(old)
            init(self, *positional, **keyword)

        kind.__init__ = translate  # type: ignore[misc]
        for old, new in names.items() if is_dataclass(kind) else ():
            setattr(kind, old, renamed_attribute(f"{kind.__name__}.{old}", new))
        return kind

    return decorate


def renamed_attribute(old: str, new: str) -> property:
    """An attribute that is read by its old name.

    Args:
        old: the name, as the message has it.
        new: of the attribute.
    """

    def read(self: object) -> object:
        warn_renamed(old, new)
        return getattr(self, new)

    return property(read)
