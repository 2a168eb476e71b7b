"""Students that come with the package."""

from importlib import resources
from typing import TYPE_CHECKING

from go1_mtl_gym.errors import InvalidInputError

if TYPE_CHECKING:
    import torch

    from trainers.policies.multi_head import MultiHeadPolicy
    from trainers.policies.phase_free import PhaseFreePolicy

PRETRAINED = ("clocked", "phase_free")
"""The student of the main job's default preset, and the same without a clock."""
FOLDER = resources.files("trainers") / "assets"


def load_pretrained(name: str = "clocked", device: "torch.device | str" = "cpu") -> "MultiHeadPolicy | PhaseFreePolicy":
    """Read a policy that comes with the package, in evaluation mode; its `env_kwargs` make its environment.

    Args:
        name: one of `PRETRAINED`.
        device: where its tensors go.

    Raises:
        InvalidInputError: if there is no policy of that name in the package.
    """
    from trainers.policies.checkpoint import load

    there = [known for known in PRETRAINED if (FOLDER / f"{known}.zip").is_file()]
    if name not in there:
        raise InvalidInputError(f"the policies that come with the package are {there}, got {name!r}")
    with resources.as_file(FOLDER / f"{name}.zip") as path:
        return load(path, device)
