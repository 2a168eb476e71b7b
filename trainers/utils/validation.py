"""Checks that several trainers make of what they are given."""

import math
from collections.abc import Mapping
from numbers import Real
from typing import Any

import numpy as np

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import as_float, integer_in


def positive(value: object, name: str) -> float:
    """Return a finite number above zero as a float.

    Raises:
        InvalidInputError: if it is something else.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Real) or not 0 < as_float(value) < math.inf:
        raise InvalidInputError(f"{name} must be a finite number > 0, got {value!r}")
    return float(value)


def checked_seed(seed: object) -> int:
    """Return a seed that episodes or shards can be drawn from.

    Raises:
        InvalidInputError: if it is no whole number in [0, 2^63).
    """
    return integer_in(seed, 0, 2**63 - 1, "seed")


def checked_jobs(n_jobs: object) -> int:
    """Return a number of processes as joblib has it: positive, or negative for all cores but some.

    Raises:
        InvalidInputError: if it is no whole number, or 0.
    """
    if isinstance(n_jobs, (bool, np.bool_)) or not isinstance(n_jobs, (int, np.integer)) or n_jobs == 0:
        raise InvalidInputError(f"n_jobs must be a whole number other than 0, got {n_jobs!r}")
    return int(n_jobs)


def refuse_overridden(env_kwargs: Mapping[str, Any], **instead: str) -> None:
    """Refuse arguments of an environment that a function sets itself.

    Args:
        env_kwargs: what the function was given.
        instead: name of such an argument -> what to use in its place.

    Raises:
        InvalidInputError: if one of them was given; it would be overridden in silence otherwise.
    """
    for name, other in instead.items():
        if name in env_kwargs:
            raise InvalidInputError(f"{name} is set by {other} here, got {name}={env_kwargs[name]!r}")
