"""How the environment finds its expert without knowing it."""

import sys
from collections.abc import Callable
from importlib import import_module
from numbers import Real
from typing import Any, Protocol

import numpy as np

from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.state import RobotState

DEFAULT_EXPERT = "experts.nmpc:NMPCExpert"


class Expert(Protocol):
    """What the environment asks of an expert."""

    def reset(self, state: RobotState) -> None:
        """Begin an episode."""

    def action(self, state: RobotState) -> np.ndarray:
        """Joint targets [rad], shape (12,)."""


def check_expert(expert: object) -> str | Callable[..., Expert]:
    """Return what `load_expert` takes, without importing anything.

    A class or function that other processes and files can find by its module and name is returned as that name.

    Raises:
        InvalidInputError: if it is neither callable nor of the form ``"module:name"``.
    """
    if callable(expert):
        return _importable_name(expert) or expert
    module, _, name = expert.partition(":") if isinstance(expert, str) else ("", "", "")
    if not (module and name):
        raise InvalidInputError(f'expert must be "module:name" or a callable, got {expert!r}')
    return f"{module}:{name}"


def _importable_name(expert: Callable[..., Any]) -> str | None:
    """``"module:name"`` of a class or function at the top level of a module; None for anything else."""
    module, name = getattr(expert, "__module__", None), getattr(expert, "__qualname__", None)
    if not module or not name or module == "__main__":  # a script is called otherwise where it is imported
        return None
    target: Any = sys.modules.get(module)
    for part in name.split("."):
        target = getattr(target, part, None)
    return f"{module}:{name}" if target is expert else None


def load_expert(expert: str | Callable[..., Expert]) -> Callable[..., Expert]:
    """What makes an expert, from ``"module:name"`` or from itself.

    Raises:
        InvalidInputError: if the module holds nothing of that name.
        ImportError: if the module cannot be imported.
    """
    if not isinstance(expert, str):
        return expert
    module, _, name = expert.partition(":")
    target: Any = import_module(module)
    try:
        for part in name.split("."):
            target = getattr(target, part)
    except AttributeError as error:
        raise InvalidInputError(f"expert {expert!r}: the module {module} holds no {name}") from error
    return target


def make_expert(expert: str | Callable[..., Expert], gains: PDGains, hold_s: float) -> Expert:
    """An expert for an environment.

    Args:
        expert: what `check_expert` returned.
        gains: of the environment's actuators.
        hold_s: time for which the environment holds an action [s].

    Raises:
        InvalidInputError: if the expert is made for another environment.
    """
    made = load_expert(expert)(gains=gains, hold_s=hold_s)
    check_expert_fits(made, gains, hold_s)
    return made


def check_expert_fits(expert: object, gains: PDGains, hold_s: float) -> None:
    """Refuse an expert that was made for another environment.

    Args:
        expert: compared by its attributes `gains` and `hold_s`, where it has them as `PDGains` and as a number.
        gains: of the environment's actuators.
        hold_s: time for which the environment holds an action [s].

    Raises:
        InvalidInputError: if one of them differs; names both sides.
    """
    for name, value, kind in (("gains", gains, PDGains), ("hold_s", hold_s, Real)):
        expected = getattr(expert, name, None)
        if isinstance(expected, kind) and expected != value:
            raise InvalidInputError(
                f"the expert was made for {name} {expected}, the environment has {value}: make one with both alike"
            )
