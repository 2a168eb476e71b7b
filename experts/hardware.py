"""Data as a robot would give them: the rates, noise and delay of the paper's hardware, in simulation."""

from types import MappingProxyType

from experts.nmpc import NMPCConfig, NMPCExpert
from go1_mtl_gym.actuation import PDGains

MPC_HZ = 100.0
"""Rate at which forces are planned [Hz] (arXiv 2505.08574)."""


def hardware_expert(gains: PDGains | None = None, hold_s: float = 0.002) -> NMPCExpert:
    """An expert that plans forces at 100 Hz and solves the whole body at every call; it remembers its plan.

    Args:
        gains: of the PD actuators that will track the targets.
        hold_s: for how long each target is held [s].
    """
    return NMPCExpert(gains, hold_s, NMPCConfig(mpc_hz=MPC_HZ))


HARDWARE_LIKE = MappingProxyType(
    {
        "expert": "experts.hardware:hardware_expert",
        "control_hz": 500,
        "noise": True,
        "estimator_noise": True,
        "action_delay_s": 0.004,
    }
)
"""Keyword arguments of `go1_mtl_gym.Go1Env`: MPC at 100 Hz, whole body and joint targets at 500 Hz as in the paper,
noise on sensors and on the expert's estimate of the state, and 4 ms from a target to its effect."""
