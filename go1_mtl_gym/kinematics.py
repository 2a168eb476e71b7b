"""Where the feet touch the ground and how fast they move, by the joints' angles and speeds alone."""

import numpy as np

from go1_mtl_gym import robot

_AXIS_X = np.broadcast_to([1.0, 0.0, 0.0], (4, 3))


def contact_points(q: np.ndarray, dq: np.ndarray, up_b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The lowest points of the four feet and their velocities against the trunk, both in its frame.

    The velocity is that of the material point: a foot that rolls on the ground without sliding has none there.

    Args:
        q: joint positions [rad], shape (12,).
        dq: joint velocities [rad/s], shape (12,).
        up_b: unit vector that points up in the world, trunk frame, shape (3,).

    Returns:
        Positions [m] and velocities [m/s], shape (4, 3) each.
    """
    hip, thigh, calf = q.reshape(4, 3).T
    cos, sin = np.cos(hip), np.sin(hip)
    zero = np.zeros(4)
    down = np.column_stack([zero, sin, -cos])  # of the thigh's plane: -z of the trunk, turned by the hip about x
    across = np.column_stack([zero, cos, sin])  # axis of thigh and calf: y, turned likewise

    def along(angle: np.ndarray) -> np.ndarray:
        """Direction of a link that hangs down at angle 0 and is turned about `across`."""
        return np.cos(angle)[:, None] * down - np.sin(angle)[:, None] * _AXIS_X

    hip_at = robot.HIP_POSITION_B
    thigh_at = hip_at + (robot.LEG_SIDE * robot.HIP_TO_THIGH)[:, None] * across
    calf_at = thigh_at + robot.THIGH_LENGTH * along(thigh)
    point = calf_at + robot.CALF_LENGTH * along(thigh + calf) - robot.FOOT_RADIUS * up_b
    speeds = dq.reshape(4, 3, 1)
    velocity = (
        speeds[:, 0] * np.cross(_AXIS_X, point - hip_at)
        + speeds[:, 1] * np.cross(across, point - thigh_at)
        + speeds[:, 2] * np.cross(across, point - calf_at)
    )
    return point, velocity


def leg_kinematics(q: np.ndarray, dq: np.ndarray, angular_velocity_b: np.ndarray) -> np.ndarray:
    """Where the feet are, and what each says of the trunk's velocity if it stands still: -(J dq + omega x p).

    Args:
        q: joint positions [rad], shape (12,).
        dq: joint velocities [rad/s], shape (12,).
        angular_velocity_b: omega, of the trunk in its frame [rad/s], shape (3,).

    Returns:
        Shape (24,), in the trunk frame: the centres of the feet p [m], 4 x 3, then the velocities [m/s], 4 x 3.
    """
    feet_b, velocity_b = contact_points(q, dq, np.zeros(3))
    return np.concatenate([feet_b.ravel(), -(velocity_b + np.cross(angular_velocity_b, feet_b)).ravel()])
