"""Policies on disk: one zip of ``policy.json`` and safetensors files; reading it executes no code.

``weights.safetensors`` holds the student, ``phase.safetensors`` the phase estimator of a phase_free one.
"""

import json
import math
import zipfile
from importlib.metadata import PackageNotFoundError, version
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeVar

import numpy as np
import safetensors.torch
import torch
from gymnasium.spaces import Box

from go1_mtl_gym.errors import InvalidInputError
from trainers.utils.files import write_atomically

if TYPE_CHECKING:
    from trainers.policies.multi_head import MultiHeadPolicy
    from trainers.policies.phase_free import PhaseFreePolicy

P = TypeVar("P")
FORMAT = "go1-mtl-gym policy"
FORMAT_VERSION = 1
WEIGHTS = "weights.safetensors"
PHASE_WEIGHTS = "phase.safetensors"
PACKAGES = (
    "go1-mtl-gym",
    "numpy",
    "mujoco",
    "gymnasium",
    "pin",
    "osqp",
    "torch",
    "stable-baselines3",
    "imitation",
)


class CheckpointError(InvalidInputError):
    """A file is not a policy that this version can read."""


def save(policy: "MultiHeadPolicy | PhaseFreePolicy", path: str | PathLike[str]) -> None:
    """Write a policy; whoever reads `path` meanwhile sees the old file or the new one, never a part.

    Raises:
        InvalidInputError: if `env_kwargs` hold something that JSON cannot.
    """
    student = getattr(policy, "student", policy)
    description = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "network": student.network_kwargs(),
        "observation_space": _space_to_json(student.observation_space),
        "action_space": _space_to_json(student.action_space),
        "versions": versions(),
    }
    if student is not policy:
        estimator = policy.estimator
        description["phase_free"] = {
            "history": estimator.layout.history,
            "width": estimator.width,
            "correction": policy.correction,
        }
    try:
        text = json.dumps(description, indent=1, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"env_kwargs must be JSON values to be saved, got {policy.env_kwargs!r}") from error

    files = {"policy.json": text, WEIGHTS: _to_bytes(student)}
    if student is not policy:
        files[PHASE_WEIGHTS] = _to_bytes(policy.estimator)

    def write(file: BinaryIO) -> None:
        with zipfile.ZipFile(file, "w") as archive:
            for name, content in files.items():
                archive.writestr(zipfile.ZipInfo(name), content)  # without the time: equal policies are equal files

    write_atomically(path, write)


def load(path: str | PathLike[str], device: torch.device | str = "cpu") -> "MultiHeadPolicy | PhaseFreePolicy":
    """Read a policy that was saved, in evaluation mode.

    Args:
        path: the zip file.
        device: where its tensors go.

    Raises:
        CheckpointError: if the file is missing, damaged, or something else.
    """
    from trainers.policies.multi_head import MultiHeadPolicy

    description, weights = _read(Path(path))
    try:
        network = {name: _tuples(value) for name, value in description["network"].items()}
        spaces = [_space_from_json(description[name]) for name in ("observation_space", "action_space")]
        policy = MultiHeadPolicy(*spaces, seed=0, **network)
        policy.seed = None
        policy.load_state_dict(weights[WEIGHTS])
        if "phase_free" in description:
            policy = _phase_free(policy, description["phase_free"], weights[PHASE_WEIGHTS])
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise CheckpointError(f"{path} does not hold a consistent policy: {error}") from error
    policy.to(torch.device(device))
    policy.set_training_mode(False)
    return policy


class SavedPolicy:
    """How policies go to disk and come back, in place of stable-baselines3's pickles."""

    def save(self, path: str | PathLike[str]) -> None:
        """Write the policy to one zip file without pickles; see `trainers.policies.checkpoint.save`."""
        save(self, path)

    @classmethod
    def load(cls: type[P], path: str | PathLike[str], device: torch.device | str = "cpu") -> P:
        """Read what `save` wrote.

        Raises:
            CheckpointError: if the file is missing, damaged, or holds another kind of policy.
        """
        policy = load(path, device)
        if not isinstance(policy, cls):
            raise CheckpointError(f"{path} holds a {type(policy).__name__}, a {cls.__name__} was expected")
        return policy


def _phase_free(
    student: "MultiHeadPolicy", description: dict[str, Any], weights: dict[str, torch.Tensor]
) -> "PhaseFreePolicy":
    from trainers.policies.phase_estimator import PhaseEstimator
    from trainers.policies.phase_free import PhaseFreePolicy, phase_free_layout

    estimator = PhaseEstimator(phase_free_layout(student, description["history"]), description["width"])
    estimator.load_state_dict(weights)
    return PhaseFreePolicy(student, estimator, description["correction"])


def _to_bytes(module: torch.nn.Module) -> bytes:
    return safetensors.torch.save(
        {name: value.detach().cpu().contiguous() for name, value in module.state_dict().items()}
    )


def versions() -> dict[str, str]:
    """Installed versions of the packages that shape a result."""
    found = {}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def _read(path: Path) -> tuple[dict[str, Any], dict[str, dict[str, torch.Tensor]]]:
    """The description, and the tensors of every file of weights."""
    if not path.is_file():
        raise CheckpointError(f"no policy at {path}: there is no such file")
    try:
        with zipfile.ZipFile(path) as archive:
            if "policy.json" not in archive.namelist():
                raise CheckpointError(
                    f"{path} was not written by MultiHeadPolicy.save: there is no policy.json in it (PPO.load "
                    "reads what PPO.save wrote)"
                )
            description = json.loads(archive.read("policy.json"))
            files = [name for name in (WEIGHTS, PHASE_WEIGHTS) if name in archive.namelist()]
            weights = {name: safetensors.torch.load(archive.read(name)) for name in files}
    except CheckpointError:
        raise
    except Exception as error:  # zip, JSON and safetensors each raise their own on damage
        raise CheckpointError(f"{path} is damaged or no policy file: {error}") from error
    if not isinstance(description, dict) or description.get("format") != FORMAT:
        raise CheckpointError(f"{path} is not a {FORMAT!r} file")
    if description.get("format_version") != FORMAT_VERSION:
        got = description.get("format_version")
        raise CheckpointError(f"{path} has format version {got!r}; this package reads {FORMAT_VERSION}")
    wanted = [WEIGHTS, PHASE_WEIGHTS] if "phase_free" in description else [WEIGHTS]
    if files != wanted:
        raise CheckpointError(f"{path} is damaged: expected the weights {wanted} in it, got {files}")
    return description, weights


def _space_to_json(space: Box) -> dict[str, Any]:
    def numbers(bound: np.ndarray) -> list[float | str]:
        return [value if math.isfinite(value) else repr(value) for value in bound.astype(np.float64).tolist()]

    return {"low": numbers(space.low), "high": numbers(space.high), "dtype": str(space.dtype)}


def _space_from_json(space: dict[str, Any]) -> Box:
    low, high = (np.array([float(value) for value in space[name]], dtype=space["dtype"]) for name in ("low", "high"))
    return Box(low, high, dtype=np.dtype(space["dtype"]).type)


def _tuples(value: Any) -> Any:
    """JSON lists back to tuples, at any depth."""
    if isinstance(value, dict):
        return {name: _tuples(item) for name, item in value.items()}
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value
