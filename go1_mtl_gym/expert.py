"""How the environment finds its expert without knowing it."""

from collections.abc import Callable
from importlib import import_module
from typing import Protocol

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

    Raises:
        InvalidInputError: if it is neither callable nor of the form ``"module:Class"``.
    """
    if callable(expert):
        return expert
    module, _, name = expert.partition(":") if isinstance(expert, str) else ("", "", "")
    if not (module and name):
        raise InvalidInputError(f'expert must be "module:Class" or a callable, got {expert!r}')
    return expert


def load_expert(expert: str | Callable[..., Expert]) -> Callable[..., Expert]:
    """What makes an expert, from ``"module:Class"`` or from itself.

    Raises:
        InvalidInputError: if the module holds nothing of that name.
        ImportError: if the module cannot be imported.
    """
    if callable(expert):
        return expert
    module, _, name = expert.partition(":")
    try:
        return getattr(import_module(module), name)
    except AttributeError as error:
        raise InvalidInputError(f"expert {expert!r}: the module {module} holds no {name}") from error


def check_expert_fits(expert: object, gains: PDGains, hold_s: float) -> None:
    """Refuse an expert that was made for another environment.

    Args:
        expert: compared by its attributes `gains` and `hold_s`, where it has them.
        gains: of the environment's actuators.
        hold_s: time for which the environment holds an action [s].

    Raises:
        InvalidInputError: if one of them differs; names both sides.
    """
    for name, value in (("gains", gains), ("hold_s", hold_s)):
        expected = getattr(expert, name, value)
        if expected != value:
            raise InvalidInputError(
                f"the expert was made for {name} {expected}, the environment has {value}: make one with both alike"
            )
