"""Policies on disk: one zip of ``policy.json`` and safetensors files; reading it executes no code."""

import hashlib
import json
import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO, ClassVar, TypeVar

import numpy as np
import safetensors.torch
import torch
from gymnasium.spaces import Box

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import did_you_mean
from trainers.policies.packaged import PRETRAINED
from trainers.policies.upgrade import upgraded
from trainers.utils.files import write_atomically

P = TypeVar("P", bound="SavedPolicy")
FORMAT = "go1-mtl-gym policy"
FORMAT_VERSION = 2
DESCRIPTION = "policy.json"
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


@dataclass(frozen=True)
class Checkpoint:
    """What a file holds.

    Attributes:
        kind: of policy; see `SavedPolicy.kind`.
        policy: JSON values that rebuild it, but for its weights.
        weights: name of a file of weights without its suffix -> tensors by name.
    """

    kind: str
    policy: dict[str, Any]
    weights: dict[str, dict[str, torch.Tensor]]


class SavedPolicy:
    """How policies go to disk and come back, in place of stable-baselines3's pickles.

    Attributes:
        kind: name of the kind of policy in its files.
        weight_files: names of its files of weights, without their suffix.
    """

    kind: ClassVar[str]
    weight_files: ClassVar[tuple[str, ...]]

    def to_checkpoint(self) -> Checkpoint:
        """All that `from_checkpoint` needs."""
        raise NotImplementedError

    @classmethod
    def from_checkpoint(cls: type[P], checkpoint: Checkpoint) -> P:
        """An equal policy."""
        raise NotImplementedError

    def save(self, path: str | PathLike[str]) -> None:
        """Write the policy to one zip file without pickles.

        Whoever reads `path` meanwhile sees the old file or the new one, never a part.
        """
        write_checkpoint(self.to_checkpoint(), path)

    @classmethod
    def load(cls: type[P], path: str | PathLike[str], device: torch.device | str = "cpu") -> P:
        """Read what `save` wrote, in evaluation mode.

        Args:
            path: the zip file.
            device: where its tensors go.

        Raises:
            InvalidInputError: if there is no such device.
            CheckpointError: if the file is missing, damaged, or holds another kind of policy.
        """
        where, checkpoint = checked_device(device), read_checkpoint(path)
        if checkpoint.kind != cls.kind:
            raise CheckpointError(f"{path} holds a {checkpoint.kind} policy, a {cls.kind} one was expected")
        return rebuild(cls, checkpoint, path, where)


def rebuild(cls: type[P], checkpoint: Checkpoint, path: str | PathLike[str], device: torch.device) -> P:
    """A policy of a class from a checkpoint, in evaluation mode.

    Raises:
        CheckpointError: if the checkpoint does not hold together.
    """
    if set(checkpoint.weights) != set(cls.weight_files):
        expected, got = ([f"{name}.safetensors" for name in names] for names in (cls.weight_files, checkpoint.weights))
        raise CheckpointError(f"{path} is damaged: expected the weights {expected} in it, got {got}")
    try:
        policy = cls.from_checkpoint(checkpoint)
    except (KeyError, TypeError, ValueError, RuntimeError, AttributeError) as error:
        raise CheckpointError(f"{path} does not hold a consistent policy: {error}") from error
    policy.to(device)  # type: ignore[attr-defined]  # every saved policy is a torch module
    policy.set_training_mode(False)  # type: ignore[attr-defined]  # ... of stable-baselines3
    return policy


def checked_device(device: torch.device | str) -> torch.device:
    """A device that torch knows and has.

    Raises:
        InvalidInputError: if it is none.
    """
    try:
        return torch.empty(0, device=torch.device(device)).device
    except (RuntimeError, TypeError, AssertionError) as error:
        reason = str(error).partition("\n")[0]
        raise InvalidInputError(
            f'device must be one that torch has, such as "cpu", got {device!r}: {reason}'
        ) from error


# -- Files -------------------------------------------------------------------------------------------------------------


def write_checkpoint(checkpoint: Checkpoint, path: str | PathLike[str]) -> None:
    """Write one zip file; it is complete or not there, and equal policies are equal files."""
    description = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "kind": checkpoint.kind,
        "policy": checkpoint.policy,
        "versions": versions(),
    }
    files: dict[str, str | bytes] = {DESCRIPTION: json.dumps(description, indent=1, allow_nan=False)}
    files |= {f"{name}.safetensors": safetensors.torch.save(tensors) for name, tensors in checkpoint.weights.items()}

    def write(file: BinaryIO) -> None:
        with zipfile.ZipFile(file, "w") as archive:
            for name, content in files.items():
                archive.writestr(zipfile.ZipInfo(name), content)  # without the time

    write_atomically(path, write)


def read_checkpoint(path: str | PathLike[str]) -> Checkpoint:
    """Read what `write_checkpoint` wrote, or what version 0.1 did.

    Raises:
        CheckpointError: if the file is missing, damaged, or something else.
    """
    description, weights = _read_zip(_existing(path))
    if not isinstance(description, dict) or description.get("format") != FORMAT:
        raise CheckpointError(f"{path} is not a {FORMAT!r} file")
    format_version = description.get("format_version")
    try:
        if format_version == 1:
            description, weights = upgraded(description, weights)
        elif format_version != FORMAT_VERSION:
            raise CheckpointError(f"{path} has format version {format_version!r}; this package reads {FORMAT_VERSION}")
        return Checkpoint(description["kind"], description["policy"], weights)
    except CheckpointError:
        raise
    except InvalidInputError as error:
        raise CheckpointError(f"{path}: {error}") from error
    except (KeyError, TypeError, AttributeError) as error:
        raise CheckpointError(f"{path} is damaged: {error!r} in its description") from error


def _existing(path: object) -> Path:
    if not isinstance(path, (str, PathLike)):
        raise InvalidInputError(f"path must be a string or a path, got {path!r}")
    file = Path(path)
    if not file.is_file():
        hint = did_you_mean(str(file), (*PRETRAINED, "expert"))
        raise CheckpointError(f"no policy at {file}: there is no such file{hint}")
    return file


def _read_zip(path: Path) -> tuple[Any, dict[str, dict[str, torch.Tensor]]]:
    """The description, and the tensors of every file of weights."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            if DESCRIPTION not in names:
                raise CheckpointError(
                    f"{path} was not written by MultiHeadPolicy.save: there is no {DESCRIPTION} in it (PPO.load reads "
                    "what PPO.save wrote)"
                )
            files = [name for name in names if name.endswith(".safetensors")]
            weights = {name.removesuffix(".safetensors"): safetensors.torch.load(archive.read(name)) for name in files}
            return json.loads(archive.read(DESCRIPTION)), weights
    except CheckpointError:
        raise
    except Exception as error:  # zip, JSON and safetensors each raise their own on damage
        raise CheckpointError(f"{path} is damaged or no policy file: {error}") from error


# -- Parts of a description --------------------------------------------------------------------------------------------


def tensors_of(module: torch.nn.Module) -> dict[str, torch.Tensor]:
    """The weights and buffers of a module, as safetensors wants them."""
    return {name: value.detach().cpu().contiguous() for name, value in module.state_dict().items()}


def fingerprint(module: torch.nn.Module) -> str:
    """A digest of the weights and buffers of a module."""
    return hashlib.sha256(safetensors.torch.save(tensors_of(module))).hexdigest()


def versions() -> dict[str, str]:
    """Installed versions of the packages that shape a result."""
    installed = {}
    for name in PACKAGES:
        try:
            installed[name] = version(name)
        except PackageNotFoundError:
            installed[name] = "not installed"
    return installed


def space_to_json(space: Box) -> dict[str, Any]:
    """A flat Box as JSON values."""

    def numbers(bound: np.ndarray) -> list[float | str]:
        return [value if math.isfinite(value) else repr(value) for value in bound.astype(np.float64).tolist()]

    return {"low": numbers(space.low), "high": numbers(space.high), "dtype": str(space.dtype)}


def space_from_json(space: Mapping[str, Any]) -> Box:
    """The inverse of `space_to_json`."""
    low, high = (np.array([float(value) for value in space[name]], dtype=space["dtype"]) for name in ("low", "high"))
    return Box(low, high, dtype=np.dtype(space["dtype"]).type)


def tuples(value: Any) -> Any:
    """JSON lists back to tuples, at any depth."""
    if isinstance(value, dict):
        return {name: tuples(item) for name, item in value.items()}
    return tuple(tuples(item) for item in value) if isinstance(value, list) else value
