"""Policies that come with the package."""

from importlib import resources

import torch

from go1_mtl_gym.deprecation import warn_renamed
from go1_mtl_gym.validation import one_of
from trainers.policies.loading import load
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.policies.packaged import FOLDER, PRETRAINED
from trainers.policies.phase_free import PhaseFreePolicy


def load_pretrained(name: str = "clocked", device: torch.device | str = "cpu") -> MultiHeadPolicy | PhaseFreePolicy:
    """Read a policy that comes with the package, in evaluation mode; its `make_env` makes its environment.

    Args:
        name: one of `PRETRAINED`.
        device: where its tensors go.

    Raises:
        InvalidInputError: if there is no policy of that name in the package.
    """
    if name == "clockless":
        warn_renamed('load_pretrained("clockless")', '"phase_free"')
        name = "phase_free"
    one_of(name, tuple(PRETRAINED), "name of a policy that comes with the package")
    with resources.as_file(FOLDER / f"{name}.zip") as path:
        return load(path, device)
