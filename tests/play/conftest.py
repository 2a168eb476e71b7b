import pytest

import trainers
from go1_mtl_gym import robot


class Stand:
    """An expert that stands, a little lower than the robot's home pose."""

    def __init__(self, gains=None, hold_s=None):
        pass

    def reset(self, state):
        pass

    def action(self, state):
        target = robot.HOME_POSE.copy()
        target[[1, 4, 7, 10]] += 0.1
        return target


@pytest.fixture(scope="session")
def student():
    """The policy of the package."""
    return trainers.load_pretrained()
