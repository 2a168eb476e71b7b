"""Geometry of the ground plane: turning vectors, and velocities of points on a turning body."""

import numpy as np


def turned(vector: np.ndarray, yaw: np.ndarray | float) -> np.ndarray:
    """Planar vectors (..., 2) turned by angles [rad] of their leading shape; the two are broadcast."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y = vector[..., 0], vector[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def carried(arm: np.ndarray, yaw_rate: float) -> np.ndarray:
    """Velocity of planar points at arms (..., 2) [m] of a body that turns at a rate [rad/s]."""
    return yaw_rate * np.stack([-arm[..., 1], arm[..., 0]], axis=-1)
