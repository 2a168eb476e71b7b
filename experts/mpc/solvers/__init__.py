"""Solvers of the MPC's quadratic program: OSQP, which is the default, and two exact ones to hold against it.

Each is set up once for a program's pattern, solves what the program holds at the time, and starts from the same guess
every time, never from its previous answer: equal problems give equal bits whatever was solved before.
"""

from collections.abc import Callable

from experts.mpc.program import QuadraticProgram
from experts.mpc.solvers.base import QPSolver
from experts.mpc.solvers.daqp import DAQPSolver
from experts.mpc.solvers.osqp import OSQPSolver
from experts.mpc.solvers.piqp import PIQPSolver

SOLVERS: dict[str, Callable[[QuadraticProgram], QPSolver]] = {
    "osqp": OSQPSolver,
    "piqp": PIQPSolver,
    "daqp": DAQPSolver,
}
"""Solver classes by the names of `MPCConfig.solver`."""
