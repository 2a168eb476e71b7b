"""Rotations: matrices, unit quaternions (w, x, y, z), and roll, pitch, yaw of R = Rz(yaw) Ry(pitch) Rx(roll)."""

import numpy as np


def matrix_from_quat(quat_wxyz: np.ndarray) -> np.ndarray:
    """The rotation matrix of a unit quaternion, shape (3, 3)."""
    w, x, y, z = quat_wxyz
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quat_from_matrix(rotation: np.ndarray) -> np.ndarray:
    """The unit quaternion of a rotation matrix, shape (4,)."""
    import mujoco  # here alone, so that everything else about rotations can be had without it

    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, rotation.ravel())
    return quat


def rpy_from_quat(quat_wxyz: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw [rad] of a unit quaternion, shape (3,)."""
    w, x, y, z = quat_wxyz
    return np.array(
        [
            np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0)),
            np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        ]
    )


def quat_from_rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """The unit quaternion of roll, pitch, yaw [rad], shape (4,)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll / 2, pitch / 2, yaw / 2]), np.sin([roll / 2, pitch / 2, yaw / 2])
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def matrix_from_vector(vector: np.ndarray) -> np.ndarray:
    """The rotation by a vector's length [rad] about it, shape (3, 3); O. Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    half = np.sinc(angle / (2 * np.pi)) ** 2 / 2  # (1 - cos) / angle^2
    return np.eye(3) + np.sinc(angle / np.pi) * cross + half * cross @ cross


def yaw_matrix(yaw: float) -> np.ndarray:
    """The rotation of the plane by an angle [rad], shape (2, 2): from the heading frame to the world's x and y."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, -sin], [sin, cos]])
