"""The nominal periodic motion of a gait: the forces that carry the weight, and how the body moves under them.

A gait that has its feet under the centre of mass can keep the body level; one that bounds or jumps cannot. Asking such
a gait for a level body makes the controller fight its own contact plan, so the reference is the motion that the plan
itself produces.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.optimize import nnls

from go1_mtl_gym import robot
from go1_mtl_gym.gaits import Gait

SAMPLES = 96
"""Grid points per cycle."""
SWAY = 0.3
"""Largest nominal horizontal force, as a fraction of the vertical one."""
_MOMENT_WEIGHT = 20.0  # levelness against evenness of the load when sharing it between the feet


@dataclass(frozen=True)
class NominalMotion:
    """Periodic functions of the gait clock in the heading frame, sampled at phases i / SAMPLES.

    Attributes:
        force: of each foot in units of the robot's weight, shape (SAMPLES, 4, 3).
        position: deviations (roll, pitch, yaw [rad], x, y, z [m]) with zero mean, shape (SAMPLES, 6).
        velocity: their time derivatives, shape (SAMPLES, 6).
    """

    force: np.ndarray
    position: np.ndarray
    velocity: np.ndarray

    def at(self, phase: np.ndarray) -> np.ndarray:
        """Deviations and, after them, their rates at phases [cycles], shape (len(phase), 12), interpolated linearly."""
        where = np.mod(phase, 1.0) * SAMPLES
        low = where.astype(int)
        samples, slopes = self._table
        return samples[low] + (where - low)[:, None] * slopes[low]

    def sway_velocity(self, phase: float) -> complex:
        """Horizontal velocity at one phase [cycles], heading frame, x + iy [m/s]; as `at` says, without its arrays."""
        where = phase % 1.0 * SAMPLES
        low = int(where)
        samples, slopes = self._table
        x, y = samples[low, 9:11] + (where - low) * slopes[low, 9:11]
        return complex(x, y)

    def force_at(self, phase: np.ndarray) -> np.ndarray:
        """Forces in units of the weight at phases [cycles], shape (len(phase), 4, 3); the sample below."""
        return self.force[(np.mod(phase, 1.0) * SAMPLES).astype(int) % SAMPLES]

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        """Samples and their differences to the next, one more than a cycle: rounding can bring a phase to 1."""
        cycle = np.hstack([self.position, self.velocity])
        samples = np.vstack([cycle, cycle[:2]])
        return samples[:-1], np.diff(samples, axis=0)


def _distribute_load(stance: np.ndarray, feet_b: np.ndarray, total: float) -> np.ndarray:
    """Non-negative loads of the feet on the ground that add up to `total`, nearly level and nearly even."""
    # Least squares in three parts: the sum, which is as good as exact, then level, then even.
    arm = feet_b[stance, :2] / 0.1
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
def nominal_motion(
    gait: Gait, inertia: tuple[float, float, float], height: float, mass: float | None = None
) -> NominalMotion:
    """The periodic motion of a body whose feet stand under their hips.

    Newton and Euler for small angles, F = sum f, feet at (x_i, y_i, -h) from the centre of mass:

        m a = F + m g,   Ixx rolldd = sum y_i f_z,i + h F_y,   Iyy pitchdd = - sum x_i f_z,i - h F_x,
        Izz yawdd = sum x_i f_y,i - y_i f_x,i.

    The horizontal force is the one that keeps the body level, F_y = - sum y_i f_z,i / h and F_x = - sum x_i f_z,i / h,
    as far as `SWAY` allows; what is left of the moment turns the body. Accelerations are given zero mean over a cycle.

    Args:
        gait: the contact plan.
        inertia: Ixx, Iyy, Izz of the whole robot [kg m^2].
        height: h [m].
        mass: m [kg]; None for the unloaded robot's.
    """
    phase = np.arange(SAMPLES) / SAMPLES
    stance = gait.stance(phase)
    supported = stance.any(axis=1)
    load = np.zeros((SAMPLES, 4))
    for i in np.flatnonzero(supported):
        # What is missing while all feet are in the air has to be made up for while some stand.
        load[i] = _distribute_load(stance[i], gait.nominal_feet_b, SAMPLES / supported.sum())
    total = load.sum(axis=1, keepdims=True)
    # sum x_i f_z,i and sum y_i f_z,i, and the center of pressure.
    lever = load @ gait.nominal_feet_b[:, :2]
    horizontal = np.clip(-lever / height, -SWAY * total, SWAY * total)
    center = lever / np.maximum(total, 1e-9)
    moment = np.column_stack(
        [
            lever[:, 1] + height * horizontal[:, 1],
            -lever[:, 0] - height * horizontal[:, 0],
            center[:, 0] * horizontal[:, 1] - center[:, 1] * horizontal[:, 0],
        ]
    )
    weight = (robot.MASS if mass is None else mass) * robot.GRAVITY
    acceleration = np.column_stack(
        [
            weight * moment / np.array(inertia),
            robot.GRAVITY * horizontal,
            robot.GRAVITY * (total - 1.0),
        ]
    )
    # Without a zero mean the motion would not be periodic.
    dt = gait.period / SAMPLES
    velocity = _integrate(acceleration - acceleration.mean(axis=0), dt)
    fraction = load / np.maximum(total, 1e-9)
    force = np.concatenate([fraction[..., None] * horizontal[:, None], load[..., None]], axis=2)
    return NominalMotion(force=force, position=_integrate(velocity, dt), velocity=velocity)


@lru_cache(maxsize=64)
def standing_motion(gait: Gait) -> NominalMotion:
    """No motion, and the weight on all four feet of a gait's stance."""
    load = _distribute_load(np.ones(4, bool), gait.nominal_feet_b, 1.0)
    force = np.zeros((SAMPLES, 4, 3))
    force[..., 2] = load
    still = np.zeros((SAMPLES, 6))
    return NominalMotion(force=force, position=still, velocity=still)
