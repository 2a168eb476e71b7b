"""The model predictive controller: single rigid body, quadratic program, solvers, and what one call remembers."""

from experts.mpc.config import MPCConfig
from experts.mpc.controller import MPC

__all__ = ["MPC", "MPCConfig"]
