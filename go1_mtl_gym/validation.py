"""Small checks shared by everything that takes numbers from a user."""

from collections.abc import Sequence
from numbers import Real

import numpy as np

from go1_mtl_gym.errors import InvalidInputError


def finite_vector(value: object, size: int, what: str) -> np.ndarray:
    """Return `value` as a float64 vector of shape (size,).

    Args:
        value: anything numpy can read as numbers.
        size: required number of entries.
        what: how the error message names the value, e.g. ``"command (vx, vy, yaw rate)"``.

    Raises:
        InvalidInputError: if the value is not numeric, has another shape, or holds NaN or infinity.
    """
    try:
        vector = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{what} must be {size} numbers, got {value!r}") from error
    if vector.shape != (size,):
        raise InvalidInputError(f"{what} must have shape ({size},), got shape {vector.shape}")
    if not np.isfinite(vector).all():
        raise InvalidInputError(f"{what} must be finite, got {vector.tolist()}")
    return vector


def interval_s(value: object, what: str) -> tuple[float, float] | None:
    """Return `value` as a shortest and a longest time [s]; None stays None.

    Raises:
        InvalidInputError: if it is not 0 < shortest <= longest.
    """
    if value is None:
        return None
    shortest, longest = finite_vector(value, 2, f"{what} [s]").tolist()
    if not 0 < shortest <= longest:
        raise InvalidInputError(f"{what} must be 0 < shortest <= longest, got {(shortest, longest)}")
    return shortest, longest


def number_in(value: object, low: float, high: float, what: str) -> float:
    """Return `value` as a float in [low, high].

    Raises:
        InvalidInputError: if it is not a finite number in that range.
    """
    if not isinstance(value, Real):
        raise InvalidInputError(f"{what} must be a number in [{low:g}, {high:g}], got {value!r}")
    number = float(value)
    if not low <= number <= high:
        raise InvalidInputError(f"{what} must lie in [{low:g}, {high:g}], got {number:g}")
    return number


def one_of(value: object, allowed: Sequence[str], what: str) -> str:
    """Return `value` if it is one of `allowed`.

    Raises:
        InvalidInputError: otherwise.
    """
    if value not in allowed:
        raise InvalidInputError(f"{what} must be one of {', '.join(map(repr, allowed))}; got {value!r}")
    return str(value)
