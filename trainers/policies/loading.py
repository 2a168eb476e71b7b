"""Reading a policy of whatever kind a file holds."""

from os import PathLike

import torch

from trainers.policies.checkpoint import CheckpointError, checked_device, read_checkpoint, rebuild
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.policies.phase_free import PhaseFreePolicy

KINDS: dict[str, type[MultiHeadPolicy] | type[PhaseFreePolicy]] = {
    cls.kind: cls for cls in (MultiHeadPolicy, PhaseFreePolicy)
}


def load(path: str | PathLike[str], device: torch.device | str = "cpu") -> MultiHeadPolicy | PhaseFreePolicy:
    """Read a policy that was saved, in evaluation mode.

    Args:
        path: the zip file.
        device: where its tensors go.

    Raises:
        InvalidInputError: if there is no such device, or `path` is none.
        CheckpointError: if the file is missing, damaged, or something else.
    """
    where, checkpoint = checked_device(device), read_checkpoint(path)
    if not isinstance(checkpoint.kind, str) or checkpoint.kind not in KINDS:
        raise CheckpointError(f"{path} holds a policy of kind {checkpoint.kind!r}; this package knows {sorted(KINDS)}")
    return rebuild(KINDS[checkpoint.kind], checkpoint, path, where)
