"""Experts that know how to move a Go1: a model predictive controller on Pinocchio dynamics, solved by OSQP."""

from experts.hardware import HARDWARE_LIKE
from experts.mpc import MPC, MPCConfig
from experts.nmpc import NMPCConfig, NMPCExpert

__all__ = ["HARDWARE_LIKE", "MPC", "MPCConfig", "NMPCConfig", "NMPCExpert"]
