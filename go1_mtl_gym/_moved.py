"""Modules of the version before: importing one works for one more release, and says where its names are now."""

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import MappingProxyType, ModuleType

from go1_mtl_gym.deprecation import warn_renamed

PACKAGE = "go1_mtl_gym"
MOVED: Mapping[str, str] = MappingProxyType(
    {
        "arguments": "env_config",
        "clock": "gaits",
        "conditions": "env_config",
        "estimator": "sensing.state_noise",
        "expert_hook": "expert",
        "leg_kinematics": "kinematics",
        "observation": "sensing.observation",
        "observer": "sensors",
        "perturbation": "wrappers",
        "randomization": "sim.domain_randomization",
        "realism": "sim.physics_params",
        "simulation": "sim.simulation",
        "state": "sensing.state",
        "state_estimator": "sensing.state_estimator",
        "termination": "episode",
    }
)
"""Old module -> new module, below the package."""
RENAMED: Mapping[str, str] = MappingProxyType({"Realism": "PhysicsParams", "EXPERTS_ALONE": "EXPERT_ONLY"})
"""Old name -> new name, of what else is called otherwise."""


class MovedModules(MetaPathFinder, Loader):
    """Finds the old modules, after all other finders have given up."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """A module that forwards, if the name is an old one."""
        package, _, name = fullname.rpartition(".")
        return ModuleSpec(fullname, self) if package == PACKAGE and name in MOVED else None

    def exec_module(self, module: ModuleType) -> None:
        """Let the old module look up everything in the new one."""
        module.__dict__["__getattr__"] = _forward(
            module.__name__, f"{PACKAGE}.{MOVED[module.__name__.rpartition('.')[2]]}"
        )


def _forward(old: str, new: str) -> Callable[[str], object]:
    def look_up(name: str) -> object:
        if name.startswith("__"):  # the import system asks for these
            raise AttributeError(f"module {old} has no attribute {name}")
        target = RENAMED.get(name, name)
        value = getattr(importlib.import_module(new), target)
        warn_renamed(f"{old}.{name}", f"{new}.{target}", stacklevel=3)
        return value

    return look_up


def install() -> None:
    """Let old modules be imported."""
    if not any(isinstance(finder, MovedModules) for finder in sys.meta_path):
        sys.meta_path.append(MovedModules())
