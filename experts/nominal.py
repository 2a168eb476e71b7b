"""The nominal periodic motion of a gait: the forces that carry the weight, and how the body moves under them.

A gait that has its feet under the centre of mass can keep the body level; one that bounds or jumps cannot. Asking such
a gait for a level body makes the controller fight its own contact plan, so the reference is the motion that the plan
itself produces.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import nnls

from go1_mtl_gym import robot
from go1_mtl_gym.gaits import Gait

SAMPLES = 96
"""Grid points per cycle."""
_MOMENT_WEIGHT = 20.0  # levelness against evenness of the load when sharing it between the feet


@dataclass(frozen=True)
class NominalMotion:
    """Periodic functions of the gait clock, sampled at phases i / SAMPLES.

    Attributes:
        load: vertical force of each foot in units of the robot's weight, shape (SAMPLES, 4).
        position: deviations (roll [rad], pitch [rad], z [m]) with zero mean, shape (SAMPLES, 3).
        velocity: their time derivatives, shape (SAMPLES, 3).
    """

    load: np.ndarray
    position: np.ndarray
    velocity: np.ndarray

    def at(self, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Deviations and their rates at phases [cycles], each of shape (len(phase), 3), by linear interpolation."""
        return _periodic(self.position, phase), _periodic(self.velocity, phase)

    def load_at(self, phase: np.ndarray) -> np.ndarray:
        """Load of each foot in units of the weight at phases [cycles], shape (len(phase), 4); the sample below."""
        return self.load[np.floor(np.mod(phase, 1.0) * SAMPLES).astype(int) % SAMPLES]


def _periodic(samples: np.ndarray, phase: np.ndarray) -> np.ndarray:
    where = np.mod(phase, 1.0) * SAMPLES
    low = np.floor(where).astype(int)
    share = (where - low)[:, None]
    return (1 - share) * samples[low % SAMPLES] + share * samples[(low + 1) % SAMPLES]


def _share_load(stance: np.ndarray, total: float) -> np.ndarray:
    """Non-negative loads of the feet on the ground that add up to `total`, nearly level and nearly even."""
    arm = robot.NOMINAL_FOOT_B[stance, :2] / 0.1
    count = int(stance.sum())
    rows = np.vstack([1e3 * np.ones(count), _MOMENT_WEIGHT * arm.T, np.eye(count)])
    target = np.concatenate([[1e3 * total, 0.0, 0.0], np.full(count, total / count)])
    load = np.zeros(4)
    load[stance] = nnls(rows, target)[0]
    return load


def _integrate(rate: np.ndarray, dt: float) -> np.ndarray:
    """Periodic antiderivative with zero mean (trapezoid rule) of samples with zero mean."""
    total = np.cumsum((rate + np.roll(rate, 1, axis=0)) / 2, axis=0) * dt
    return total - total.mean(axis=0)


@lru_cache(maxsize=64)
def nominal_motion(gait: Gait, inertia_roll: float, inertia_pitch: float) -> NominalMotion:
    """The periodic motion of a body whose feet stand under their hips.

    Newton and Euler for small angles, world frame: m zdd = sum f - m g, Ixx rolldd = sum y f, Iyy pitchdd = - sum x f.
    Accelerations have zero mean over a cycle; what is left of the mean moment is borne by horizontal forces.

    Args:
        gait: the contact plan.
        inertia_roll: Ixx of the whole robot [kg m^2].
        inertia_pitch: Iyy of the whole robot [kg m^2].
    """
    phase = np.arange(SAMPLES) / SAMPLES
    stance = gait.stance(phase)
    supported = stance.any(axis=1)
    load = np.zeros((SAMPLES, 4))
    for i in np.flatnonzero(supported):
        load[i] = _share_load(stance[i], SAMPLES / supported.sum())
    weight = robot.MASS * robot.GRAVITY
    arm = robot.NOMINAL_FOOT_B
    acceleration = np.stack(
        [
            weight * load @ arm[:, 1] / inertia_roll,
            -weight * load @ arm[:, 0] / inertia_pitch,
            robot.GRAVITY * (load.sum(axis=1) - 1.0),
        ],
        axis=1,
    )
    dt = gait.period / SAMPLES
    velocity = _integrate(acceleration - acceleration.mean(axis=0), dt)
    return NominalMotion(load=load, position=_integrate(velocity, dt), velocity=velocity)
