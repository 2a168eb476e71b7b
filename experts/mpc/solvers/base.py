"""What the MPC asks of a solver, and the import of those that are optional."""

from importlib import import_module
from types import ModuleType
from typing import NamedTuple, Protocol

import numpy as np

from experts.mpc.program import QuadraticProgram


class Answer(NamedTuple):
    """A solver's answer.

    Attributes:
        z: states and inputs, shape (24 N,).
        iterations: of the solver.
        solved: whether the tolerance was met.
        usable: whether z may be used.
    """

    z: np.ndarray
    iterations: int
    solved: bool
    usable: bool


class QPSolver(Protocol):
    """What the MPC asks of a solver; made from the program whose pattern it is for."""

    def solve(self, program: QuadraticProgram, guess: np.ndarray) -> Answer:
        """Solve what the program holds now.

        Args:
            program: of the pattern that the solver was made for.
            guess: states and inputs to start from, shape (24 N,).
        """


def optional(name: str) -> ModuleType:
    """Import a solver's package.

    Raises:
        ImportError: if it is not installed; the message says how to install it.
    """
    try:
        return import_module(name)
    except ImportError as error:
        message = f"the MPC's solver {name!r} needs the package {name}: pip install {name}"
        raise ImportError(message) from error
