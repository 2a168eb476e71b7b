"""Limits of a ground force as linear rows: the friction pyramid, as both quadratic programs of the expert pose it."""

import numpy as np

ROWS_PER_FOOT = 5
"""Rows of `friction_pyramid`."""
NORMAL_ROW = 4
"""The row of `friction_pyramid` that is f_z itself."""


def friction_pyramid(mu: float) -> np.ndarray:
    """Rows F of one foot, shape (5, 3), with |f_x| <= mu f_z and |f_y| <= mu f_z where the first four of F f are >= 0.

    The fifth row is f_z, for its own bounds. (The inner linearization of the friction cone, as in J. Di Carlo et al.,
    IROS 2018.)

    Args:
        mu: coefficient of friction.
    """
    return np.array([[1.0, 0, mu], [-1.0, 0, mu], [0, 1.0, mu], [0, -1.0, mu], [0, 0, 1.0]])
