"""Where the feet touch the ground and how fast they move, by the joints' angles and speeds alone."""

import numpy as np

from go1_mtl_gym import robot

_CENTER = np.zeros(3)
"""In place of the direction up: of a foot its centre, not its lowest point."""


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
    hip_speed, thigh_speed, calf_speed = dq.reshape(4, 3).T
    cos, sin = np.cos(hip), np.sin(hip)
    # In the thigh's plane: forward is x, down is -z of the trunk turned by the hip about x.
    calf_forward = -robot.CALF_LENGTH * np.sin(thigh + calf)
    calf_down = robot.CALF_LENGTH * np.cos(thigh + calf)
    leg_forward = calf_forward - robot.THIGH_LENGTH * np.sin(thigh)
    leg_down = calf_down + robot.THIGH_LENGTH * np.cos(thigh)
    sideways = robot.LEG_SIDE * robot.HIP_TO_THIGH
    x, y, z = (-robot.FOOT_RADIUS * up_b).tolist()  # from the foot's centre to its lowest point
    from_hip = np.stack([leg_forward + x, sideways * cos + leg_down * sin + y, sideways * sin - leg_down * cos + z], 1)
    # Thigh and calf turn about (0, cos, sin): v = omega (0, cos, sin) x r.
    forward = calf_speed * calf_forward + thigh_speed * leg_forward + (thigh_speed + calf_speed) * x
    down = -(calf_speed * calf_down + thigh_speed * leg_down) + (thigh_speed + calf_speed) * (cos * z - sin * y)
    velocity = np.stack(
        [down, -hip_speed * from_hip[:, 2] + sin * forward, hip_speed * from_hip[:, 1] - cos * forward], 1
    )
    return robot.HIP_POSITION_B + from_hip, velocity


def leg_kinematics(q: np.ndarray, dq: np.ndarray, angular_velocity_b: np.ndarray) -> np.ndarray:
    """Where the feet are, and what each says of the trunk's velocity if it stands still: -(J dq + omega x p).

    Args:
        q: joint positions [rad], shape (12,).
        dq: joint velocities [rad/s], shape (12,).
        angular_velocity_b: omega, of the trunk in its frame [rad/s], shape (3,).

    Returns:
        Shape (24,), in the trunk frame: the centres of the feet p [m], 4 x 3, then the velocities [m/s], 4 x 3.
    """
    feet_b, velocity_b = contact_points(q, dq, _CENTER)
    x, y, z = angular_velocity_b.tolist()
    turn = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])  # p @ turn = omega x p
    return np.concatenate([feet_b.ravel(), -(velocity_b + feet_b @ turn).ravel()])
