"""Gymnasium environments of a Unitree Go1 quadruped with many gaits and a model predictive expert.

Importing the package registers ``Go1Trot-v0``, ``Go1Bound-v0``, ``Go1Jump-v0``, ``Go1Walk-v0`` and ``Go1MultiGait-v0``
(a task drawn per episode). ``gymnasium.make("go1_mtl_gym:Go1Trot-v0")`` imports and makes in one go.
"""

from importlib.metadata import PackageNotFoundError, version

import gymnasium

from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.errors import Go1Error, InvalidInputError
from go1_mtl_gym.gaits import GAITS, Gait
from go1_mtl_gym.observation import ObservationLayout, SensorNoise
from go1_mtl_gym.perturbation import PerturbationWrapper
from go1_mtl_gym.state import RobotState
from go1_mtl_gym.tasks import TASKS, Task

__all__ = [
    "GAITS",
    "TASKS",
    "Gait",
    "Go1Env",
    "Go1Error",
    "InvalidInputError",
    "ObservationLayout",
    "PerturbationWrapper",
    "RobotState",
    "SensorNoise",
    "Task",
    "env_id",
]

try:
    __version__ = version("go1-mtl-gym")
except PackageNotFoundError:  # a source tree that was not installed
    __version__ = "0+unknown"


def env_id(task: str | None) -> str:
    """The id under which a task's environment can be made from anywhere; None names the multi-gait environment."""
    return f"go1_mtl_gym:Go1{'MultiGait' if task is None else task.capitalize()}-v0"


for _task in (None, *TASKS):
    gymnasium.register(
        id=env_id(_task).partition(":")[2],
        entry_point="go1_mtl_gym.env:Go1Env",
        kwargs={"task": _task},
    )
