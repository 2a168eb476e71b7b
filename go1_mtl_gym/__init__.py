"""Gymnasium environments of a Unitree Go1 quadruped with many gaits and a model predictive expert.

Importing the package registers ``Go1Trot-v0``, ``Go1Bound-v0``, ``Go1Jump-v0``, ``Go1Walk-v0``, ``Go1Pace-v0``,
``Go1Gallop-v0``, ``Go1MultiGait-v0`` (a task drawn per episode) and ``Go1AnyGait-v0`` (a gait drawn per episode);
`register_task` adds your own.
``gymnasium.make("go1_mtl_gym:Go1Trot-v0")`` imports and makes in one go.
"""

from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from go1_mtl_gym import _moved
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.contract import PolicyContract
from go1_mtl_gym.env_config import EnvConfig
from go1_mtl_gym.errors import Go1Error, InvalidInputError
from go1_mtl_gym.gait_space import NAMED as NAMED_GAITS
from go1_mtl_gym.gait_space import GaitSpace
from go1_mtl_gym.gaits import GAITS, Gait
from go1_mtl_gym.registration import env_id, register_built_in, register_task
from go1_mtl_gym.rewards import RewardWeights
from go1_mtl_gym.sensing.observation import ObservationLayout, SensorNoise
from go1_mtl_gym.sensing.sensor_faults import SensorParams
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.sensing.state_estimator import StateEstimatorConfig
from go1_mtl_gym.sensing.state_noise import EstimatorNoise
from go1_mtl_gym.sim.domain_randomization import DomainRandomization
from go1_mtl_gym.sim.physics_params import PhysicsParams
from go1_mtl_gym.tasks import BUILT_IN_TASKS, PAPER_TASKS, TASKS, Task
from go1_mtl_gym.wrappers import PerturbationWrapper

if TYPE_CHECKING:
    from go1_mtl_gym.env import Go1Env

__all__ = [
    "GAITS",
    "BUILT_IN_TASKS",
    "NAMED_GAITS",
    "PAPER_TASKS",
    "TASKS",
    "DomainRandomization",
    "EnvConfig",
    "EstimatorNoise",
    "Gait",
    "GaitSpace",
    "Go1Env",
    "Go1Error",
    "InvalidInputError",
    "ObservationLayout",
    "PDGains",
    "PerturbationWrapper",
    "PhysicsParams",
    "PolicyContract",
    "RewardWeights",
    "RobotState",
    "SensorNoise",
    "SensorParams",
    "StateEstimatorConfig",
    "Task",
    "env_id",
    "register_task",
]

try:
    __version__ = version("go1-mtl-gym")
except PackageNotFoundError:  # a source tree that was not installed
    __version__ = "0+unknown"

_moved.install()
register_built_in()


def __getattr__(name: str) -> Any:
    """Import the environment on first use: whoever only asks what there is does not wait for MuJoCo."""
    if name == "Go1Env":
        from go1_mtl_gym.env import Go1Env

        globals()[name] = Go1Env
        return Go1Env
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(__all__))
