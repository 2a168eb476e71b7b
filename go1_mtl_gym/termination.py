"""When an episode is over."""

from go1_mtl_gym.sensing.state import RobotState

FALLEN_HEIGHT = 0.14
"""A trunk lower than this has fallen [m]."""
FALLEN_COSINE = 0.5
"""A trunk tilted by more than arccos of this has fallen."""


def how_it_ended(state: RobotState, stable: bool, time_is_up: bool) -> str:
    """Why an episode is over: "unstable", "fall" or "time"; "" while it goes on.

    Args:
        state: the robot now.
        stable: False once the physics has diverged.
        time_is_up: whether the episode has had its length.
    """
    if not stable:
        return "unstable"
    if state.position_w[2] < FALLEN_HEIGHT or -state.gravity_b[2] < FALLEN_COSINE:
        return "fall"
    return "time" if time_is_up else ""
