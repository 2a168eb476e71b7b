"""The robot in a mirror: what is on its left is on its right, so that every row is worth two."""

import dataclasses

import numpy as np

from go1_mtl_gym.contract import PolicyContract
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gaits import STAND_COMMAND, Gait
from go1_mtl_gym.sensing.gait_numbers import LEG_NUMBERS
from go1_mtl_gym.sensing.observation import FRAME_SIZE
from trainers.data.demonstrations import Demonstrations

OTHER_SIDE = np.array([1, 0, 3, 2])
"""The leg on the other side of each of FL, FR, RL, RR."""
_TRUE = np.array([1.0, -1.0, 1.0])
"""Signs of a vector in the mirror, whose plane holds forward and up."""
_AXIAL = np.array([-1.0, 1.0, -1.0])
"""Signs of an angular velocity in the mirror."""
_COMMAND = np.array([1.0, -1.0, -1.0])
_JOINTS = np.array([-1.0, 1.0, 1.0])
"""Signs of hip, thigh and calf."""
_SHIFTS = np.arange(0.0, 1.0, 0.05)


def mirror_shift(gait: Gait) -> float | None:
    """By how much the gait clock is ahead in the mirror [cycles]; None if the mirrored gait is another one.

    A clock x with offsets o in the mirror is a clock x + s with the offsets themselves: o[other side] = o + s (mod 1).
    """
    offsets = np.array(gait.offsets)
    if not np.allclose(gait.duties[OTHER_SIDE], gait.duties):
        return None
    for shift in _SHIFTS.tolist():
        turns = offsets[OTHER_SIDE] - offsets - shift
        if np.allclose(turns, np.round(turns), atol=1e-6):
            return shift
    return None


def mirrored(rows: Demonstrations) -> Demonstrations:
    """The rows as they would be if left and right were exchanged, of all gaits that are the same in the mirror.

    The readings of the inertial unit become those of one on the other side of the trunk. Where the clock rests it is at
    phase 0 in the mirror too.

    Args:
        rows: of tasks whose gaits the contract names, or with the channel "gait" and without "phase".

    Returns:
        Rows of those tasks whose gait is the same in the mirror, in order.

    Raises:
        InvalidInputError: if the gait of a row is not known.
    """
    contract, shifts = rows.contract, _shifts(rows)
    rows = rows.take(np.isfinite(shifts[rows.task]))
    return dataclasses.replace(
        rows, obs=_mirrored_obs(rows.obs, contract, shifts[rows.task]), acts=_mirrored_joints(rows.acts)
    )


def with_mirrored(rows: Demonstrations, weights: np.ndarray | None = None) -> tuple[Demonstrations, np.ndarray]:
    """Rows and their mirror images, and how often each is to be drawn.

    Args:
        rows: as of `mirrored`.
        weights: of the rows, positive integers, shape (n,); None gives every row the weight 1.
    """
    weights = np.ones(len(rows), dtype=np.int64) if weights is None else np.asarray(weights)
    image = mirrored(rows)
    has_image = np.isfinite(_shifts(rows))[rows.task]
    return Demonstrations.concatenate([rows, image]), np.concatenate([weights, weights[has_image]])


def _shifts(rows: Demonstrations) -> np.ndarray:
    """`mirror_shift` of every task [cycles], shape (K,); NaN where there is none, and where no row asks for it."""
    shifts = np.full(len(rows.tasks), np.nan)
    if "gait" in rows.contract.channels and "phase" not in rows.contract.channels:
        return np.zeros(len(rows.tasks))  # the rows say themselves what gait they are of
    for k in np.unique(rows.task).tolist():
        gait = rows.contract.gaits[k]
        if gait is None:
            raise InvalidInputError(f"rows whose gaits the contract names were expected, got some of {rows.tasks[k]!r}")
        shift = mirror_shift(gait)
        shifts[k] = np.nan if shift is None else shift
    return shifts


def _mirrored_obs(obs: np.ndarray, contract: PolicyContract, shift: np.ndarray) -> np.ndarray:
    image, where = obs.copy(), contract.slices
    frames = [0, *range(where["history"].start, where["history"].stop, FRAME_SIZE)] if "history" in where else [0]
    for start in frames:
        image[:, start : start + FRAME_SIZE] = _mirrored_frame(obs[:, start : start + FRAME_SIZE], contract)
    for name, sign in (("gravity", _TRUE), ("command", _COMMAND)):
        if name in where:
            image[:, where[name]] *= sign.astype(np.float32)
    if "last_action" in where:
        image[:, where["last_action"]] = _mirrored_joints(obs[:, where["last_action"]])
    if "leg_kinematics" in where:
        feet = obs[:, where["leg_kinematics"]].reshape(-1, 2, 4, 3)[:, :, OTHER_SIDE] * _TRUE
        image[:, where["leg_kinematics"]] = feet.reshape(len(obs), -1)
    if "gait" in where:
        image[:, where["gait"]] = _mirrored_gait(obs[:, where["gait"]])
    if "phase" in where:
        image[:, where["phase"]] = _turned(obs[:, where["phase"]], np.where(_rests(obs, contract), 0.0, shift))
    return image


def _mirrored_gait(numbers: np.ndarray) -> np.ndarray:
    """The term "gait" with left and right exchanged, shape (n, 29): each leg has the numbers of the other side's."""
    legs = numbers[:, : 4 * LEG_NUMBERS].reshape(-1, LEG_NUMBERS, 4)[:, :, OTHER_SIDE]
    return np.concatenate([legs.reshape(len(numbers), -1), numbers[:, 4 * LEG_NUMBERS :]], axis=1)


def _mirrored_frame(frame: np.ndarray, contract: PolicyContract) -> np.ndarray:
    """One frame of proprioception, shape (n, 34)."""
    where = contract.slices
    return np.concatenate(
        [
            frame[:, where["accelerometer"]] * _TRUE,
            frame[:, where["gyroscope"]] * _AXIAL,
            _mirrored_joints(frame[:, where["q"]]),
            _mirrored_joints(frame[:, where["dq"]]),
            frame[:, where["contacts"]][:, OTHER_SIDE],
        ],
        axis=1,
    )


def _rests(obs: np.ndarray, contract: PolicyContract) -> np.ndarray:
    """Where the clock rests, as far as an observation tells, bool, shape (n,)."""
    where = contract.slices
    at_zero = (obs[:, where["phase"]] == [0.0, 1.0]).all(axis=1)
    if "command" not in where:
        return at_zero
    return at_zero & (np.abs(obs[:, where["command"]]) < STAND_COMMAND).all(axis=1)


def _turned(phase: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Sine and cosine of clocks that are ahead by some shift [cycles], shape (n, 2)."""
    sin, cos = np.sin(2 * np.pi * shift), np.cos(2 * np.pi * shift)
    return np.stack([phase[:, 0] * cos + phase[:, 1] * sin, phase[:, 1] * cos - phase[:, 0] * sin], axis=1)


def _mirrored_joints(joints: np.ndarray) -> np.ndarray:
    """Joint values of the other side, shape (n, 12)."""
    return (joints.reshape(-1, 4, 3)[:, OTHER_SIDE] * _JOINTS).reshape(len(joints), -1).astype(np.float32)
