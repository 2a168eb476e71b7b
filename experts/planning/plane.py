"""Geometry of the ground plane in complex numbers: x + iy. Turning by an angle is multiplying by exp(i angle)."""

import cmath

import numpy as np


def to_complex(vector: np.ndarray) -> np.ndarray | complex:
    """x + iy of planar vectors (..., 2) or of the horizontal part of spatial ones (..., 3)."""
    if vector.ndim == 1:
        return complex(vector[0], vector[1])
    return vector[..., 0] + 1j * vector[..., 1]


def turn(yaw: np.ndarray | float) -> np.ndarray | complex:
    """The factor exp(i yaw) that turns a planar vector by an angle [rad]."""
    return np.exp(1j * yaw) if isinstance(yaw, np.ndarray) else cmath.rect(1.0, yaw)


def carried(arm: np.ndarray, yaw_rate: float) -> np.ndarray:
    """Velocity of planar points at complex arms [m] of a body that turns at a rate [rad/s]: i yaw_rate arm."""
    return 1j * yaw_rate * arm
