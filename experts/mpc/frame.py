"""The frame in which the MPC poses its problem: below the robot, facing where it does."""

import numpy as np

from experts.mpc.srbd import COM, OMEGA, RPY, VELOCITY


class Frame:
    """A frame on the ground below a point, turned about the vertical.

    Args:
        point_w: world [m], shape (3,); its height does not matter.
        yaw: [rad].
    """

    def __init__(self, point_w: np.ndarray, yaw: float) -> None:
        self.yaw = float(yaw)
        self.origin_w = np.array([point_w[0], point_w[1], 0.0])
        cos, sin = np.cos(yaw), np.sin(yaw)
        self.rotation = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])

    def points(self, points_w: np.ndarray) -> np.ndarray:
        """Points in this frame, shape (..., 3)."""
        return (points_w - self.origin_w) @ self.rotation

    def vectors(self, vectors_w: np.ndarray) -> np.ndarray:
        """Vectors in this frame, shape (..., 3)."""
        return vectors_w @ self.rotation

    def states(self, states: np.ndarray, other: "Frame") -> np.ndarray:
        """The MPC's states (n, 12) of another frame in this one."""
        turn = other.rotation.T @ self.rotation
        out = np.empty_like(states)
        out[:, RPY] = states[:, RPY]
        # Roll and pitch are about the heading, so turning the frame changes the yaw alone; by the short way round.
        out[:, 2] += np.remainder(other.yaw - self.yaw + np.pi, 2 * np.pi) - np.pi
        out[:, COM] = self.points(states[:, COM] @ other.rotation.T + other.origin_w)
        out[:, OMEGA], out[:, VELOCITY] = states[:, OMEGA] @ turn, states[:, VELOCITY] @ turn
        return out


WORLD = Frame(np.zeros(3), 0.0)
"""The frame that states are in where nothing else is said."""
