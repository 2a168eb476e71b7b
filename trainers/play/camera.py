"""Where the player looks from."""

import mujoco
import numpy as np

from go1_mtl_gym.validation import one_of

MODES = ("chase", "follow", "free")
"""Behind the robot and turning with it; beside it, not turning; where it was put."""
FOLLOW_S = 0.12
"""The camera follows the robot's place and heading with this time constant, so that steps do not shake it [s]."""
AIM_HEIGHT = 0.2
"""Of the point that is looked at in following [m]."""
NEAREST, FARTHEST = 0.3, 30.0
"""Distances from the point that is looked at [m]."""
STEEPEST = 89.0
"""Largest elevation up or down [degrees]."""


class Camera:
    """A MuJoCo camera that follows a robot, and that a mouse moves.

    Attributes:
        mjv: what MuJoCo draws from.
        mode: one of `MODES`.
        orbit: how far whoever looks has turned about the robot by other means than `rotate`, to the left [rad].
    """

    def __init__(self, mode: str = MODES[0]) -> None:
        self.mode = one_of(mode, MODES, "mode of the camera")
        self.mjv = mujoco.MjvCamera()
        self.mjv.type = mujoco.mjtCamera.mjCAMERA_FREE
        self.mjv.azimuth, self.mjv.elevation, self.mjv.distance = 40.0, -20.0, 1.7
        self.mjv.lookat[:] = [0.0, 0.0, AIM_HEIGHT]
        self.orbit = 0.0
        self._yaw, self._time_s = 0.0, 0.0

    @property
    def direction_w(self) -> float:
        """Where it looks, from the world's x axis to the left [rad]."""
        return float(np.radians(self.mjv.azimuth)) + self.orbit

    def next_mode(self) -> None:
        """Change to the mode after the present one."""
        self.mode = MODES[(MODES.index(self.mode) + 1) % len(MODES)]

    def follow(self, position_w: np.ndarray, yaw: float, time_s: float) -> None:
        """Go along with the robot; to be called with every state that is shown.

        Args:
            position_w: of the trunk [m], shape (3,).
            yaw: of the trunk [rad].
            time_s: of the state [s]; one before the last time begins anew. A robot that is nowhere, because the physics
                has diverged, is not followed.
        """
        if not np.isfinite([*position_w, yaw]).all():
            return
        passed_s, self._time_s = time_s - self._time_s, time_s
        fraction = 1.0 - np.exp(-passed_s / FOLLOW_S) if passed_s >= 0.0 else 1.0
        turn = fraction * np.arctan2(np.sin(yaw - self._yaw), np.cos(yaw - self._yaw))
        self._yaw += turn
        if self.mode == "free":
            return
        aim = np.array([position_w[0], position_w[1], AIM_HEIGHT])
        self.mjv.lookat[:] = self.mjv.lookat + fraction * (aim - self.mjv.lookat)
        if self.mode == "chase":
            self.mjv.azimuth += float(np.degrees(turn))

    # -- The mouse; distances are shares of the window's height --------------------------------------------------------

    def rotate(self, right: float, down: float) -> None:
        """Turn about the point that is looked at."""
        self.mjv.azimuth -= 180.0 * right
        self.mjv.elevation = float(np.clip(self.mjv.elevation - 180.0 * down, -STEEPEST, STEEPEST))

    def zoom(self, nearer: float) -> None:
        """Go nearer to the point that is looked at, or away from it."""
        self.mjv.distance = float(np.clip(self.mjv.distance * np.exp(-nearer), NEAREST, FARTHEST))

    def pan(self, right: float, down: float) -> None:
        """Drag the world along; ends the following."""
        self.mode = "free"
        azimuth, elevation = np.radians([self.mjv.azimuth, self.mjv.elevation])
        rightward = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
        upward = np.array(
            [-np.cos(azimuth) * np.sin(elevation), -np.sin(azimuth) * np.sin(elevation), np.cos(elevation)]
        )
        self.mjv.lookat[:] = self.mjv.lookat + self.mjv.distance * (down * upward - right * rightward)
