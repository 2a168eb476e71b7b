"""Small checks shared by everything that takes numbers from a user."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from go1_mtl_gym.errors import InvalidInputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Parameters = TypeVar("Parameters")

_NUMBER_KINDS = "iufO"
"""Kinds of numpy arrays that hold numbers, or things that may be numbers; not booleans, text or complex numbers."""


LONGEST_REPR = 60
"""Characters of a value in a message."""


def finite_vector(value: object, size: int, label: str) -> np.ndarray:
    """Return `value` as a new float64 vector of shape (size,).

    Args:
        value: anything numpy can read as numbers.
        size: required number of entries.
        label: how the error message names the value, e.g. ``"command (vx, vy, yaw rate)"``.

    Raises:
        InvalidInputError: if the value is not numeric, has another shape, or holds NaN or infinity.
    """
    try:
        raw = np.asarray(value)
        vector = raw.astype(np.float64) if raw.dtype.kind in _NUMBER_KINDS else None
    except Exception as error:  # foreign arrays raise what they like; a tensor with a gradient, a RuntimeError
        raise InvalidInputError(f"{label} must be {size} numbers, got {value!r} ({error})") from error
    if vector is None:
        raise InvalidInputError(f"{label} must be {size} numbers, got {value!r}")
    if vector.shape != (size,):
        raise InvalidInputError(f"{label} must have shape ({size},), got shape {vector.shape}")
    if not np.isfinite(vector).all():
        raise InvalidInputError(f"{label} must be finite, got {vector.tolist()}")
    return vector


def interval_s(value: object, label: str) -> tuple[float, float] | None:
    """Return `value` as a shortest and a longest time [s]; None stays None.

    Raises:
        InvalidInputError: if it is not 0 < shortest <= longest.
    """
    if value is None:
        return None
    shortest, longest = finite_vector(value, 2, f"{label} [s]").tolist()
    if not 0 < shortest <= longest:
        raise InvalidInputError(f"{label} must be 0 < shortest <= longest, got {(shortest, longest)}")
    return shortest, longest


def number_in(value: object, low: float, high: float, label: str) -> float:
    """Return `value` as a float in [low, high].

    Raises:
        InvalidInputError: if it is not a finite number in that range; True and False are no numbers.
    """
    if not isinstance(value, Real) or isinstance(value, bool):
        raise InvalidInputError(f"{label} must be a number in [{low:g}, {high:g}], got {value!r}")
    number = as_float(value)
    if not low <= number <= high:
        raise InvalidInputError(f"{label} must lie in [{low:g}, {high:g}], got {number:g}")
    return number


def integer_in(value: object, low: int, high: int, label: str) -> int:
    """Return `value` as an int in [low, high].

    Raises:
        InvalidInputError: if it is no whole number, or outside the range.
    """
    whole = isinstance(value, Real) and not isinstance(value, bool) and as_float(value).is_integer()
    if not whole or not low <= value <= high:  # type: ignore[operator]
        raise InvalidInputError(f"{label} must be an integer from {low} to {high}, got {_brief(value)}")
    return int(value)  # type: ignore[call-overload]


def as_float(value: Any) -> float:
    """Return a real number as a float; infinity if it is too large for one."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _brief(value: object) -> str:
    """How a message shows a value; of a number with hundreds of digits only the size."""
    try:
        text = repr(value)
    except ValueError:  # more digits than Python writes
        return "an integer of thousands of digits"
    return text if len(text) <= LONGEST_REPR else f"{text[:LONGEST_REPR]}... ({len(text)} characters)"


class Limits(NamedTuple):
    """What a number may be.

    Attributes:
        low, high: the smallest and the largest value.
        unit: how messages name it, such as " [s]".
    """

    low: float
    high: float
    unit: str = ""


def check_numbers(
    parameters: "DataclassInstance", limits: Limits | Mapping[str, Limits], prefix: str = "", suffix: str = ""
) -> None:
    """Check numbers of a frozen dataclass, and make them floats, equal to what comes back from a file.

    Args:
        parameters: the dataclass, while it is made. A field whose default is None may be None.
        limits: of all fields, or of some by name.
        prefix: how the message names the dataclass, before the field's name.
        suffix: likewise, after it.

    Raises:
        InvalidInputError: if a number is none, or outside its limits.
    """
    every = limits if isinstance(limits, Mapping) else {each.name: limits for each in fields(parameters)}
    default = {each.name: each.default for each in fields(parameters)}
    for name, (low, high, unit) in every.items():
        value = getattr(parameters, name)
        if value is not None or default[name] is not None:
            object.__setattr__(parameters, name, number_in(value, low, high, f"{prefix}{name}{unit}{suffix}"))


def one_of(value: object, allowed: Sequence[str], label: str) -> str:
    """Return `value` if it is one of `allowed`.

    Raises:
        InvalidInputError: otherwise.
    """
    if not isinstance(value, str) or value not in allowed:
        known = ", ".join(map(repr, allowed))
        raise InvalidInputError(f"{label} must be one of {known}; got {value!r}{did_you_mean(value, allowed)}")
    return str(value)


def did_you_mean(word: object, known: Sequence[str]) -> str:
    """What a message adds where a word looks like a misspelled one: "; did you mean 'trot'?", or nothing.

    Args:
        word: what came.
        known: words that were expected.
    """
    closest = get_close_matches(word.lower(), known, n=1) if isinstance(word, str) else []
    return f"; did you mean {closest[0]!r}?" if closest else ""


def yes_or_no(value: object, label: str) -> bool:
    """Return `value` as a bool.

    Raises:
        InvalidInputError: if it is neither True nor False.
    """
    if not isinstance(value, (bool, np.bool_)):
        raise InvalidInputError(f"{label} must be True or False, got {value!r}")
    return bool(value)


def switch(value: object, kind: type[Parameters], label: str) -> Parameters | None:
    """Return parameters that can be switched on: True gives the defaults of their kind; None and False give None.

    Args:
        value: what a user gave; a dictionary holds fields, as JSON has them.
        kind: a dataclass of parameters.
        label: how messages name it.

    Raises:
        InvalidInputError: if it is something else.
    """
    if value is None or value is False:
        return None
    return kind() if value is True else parameters_of(value, kind, label, "None, True, False or ")


def parameters_of(value: object, kind: type[Parameters], label: str, others: str = "") -> Parameters:
    """Return parameters of a kind, made from a dictionary of their fields if need be.

    Args:
        value: what a user gave.
        kind: a dataclass of parameters.
        label: how messages name it.
        others: what else messages say it may be.

    Raises:
        InvalidInputError: if it is something else.
    """
    if isinstance(value, Mapping):
        for name in value:
            one_of(name, tuple(each.name for each in fields(kind)), f"field of {label}")  # type: ignore[arg-type]
        return kind(**value)
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        raise InvalidInputError(f"{label} must be {others}{article} {kind.__name__}, got {value!r}")
    return value
