"""What counts as a number: the limit beyond which states and programs are refused."""

import numpy as np

LARGEST = 1e6
"""A state or a program with a larger number than this in it is refused; OSQP would take it silently and may stay stuck.
"""


def plausible(*arrays: np.ndarray) -> bool:
    """Whether every number of non-empty arrays is finite and smaller than `LARGEST`."""
    # NaN compares as False, so one comparison of the maximum finds it as well.
    return all(bool(np.abs(array).max() < LARGEST) for array in arrays)
