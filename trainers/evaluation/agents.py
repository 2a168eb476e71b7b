"""Policies and experts by whatever a user names them with, and what tells one from another."""

import hashlib
from os import PathLike
from pathlib import Path
from typing import Any

from trainers.evaluation.rollout import checked_agent
from trainers.policies.loading import load
from trainers.policies.packaged import FOLDER, PRETRAINED
from trainers.policies.pretrained import load_pretrained


def opened(policy_or_expert: Any) -> Any:
    """What can be followed or asked.

    Args:
        policy_or_expert: as in `trainers.evaluate`; or the path of a policy's file; or one of `PRETRAINED`.

    Raises:
        InvalidInputError: if it is nothing of these.
        CheckpointError: if a file holds no policy.
    """
    if not _is_named(policy_or_expert):
        return checked_agent(policy_or_expert)
    return load_pretrained(policy_or_expert) if policy_or_expert in PRETRAINED else load(policy_or_expert)


def identity(policy_or_expert: Any) -> dict[str, str]:
    """A "name", and a "sha256" of what makes a policy or expert behave as it does.

    Of a file that is its bytes; of a policy in memory its class, contract and parameters; of an expert its class and
    configuration.

    Args:
        policy_or_expert: as in `opened`.
    """
    if _is_named(policy_or_expert):
        packaged = policy_or_expert in PRETRAINED
        file = FOLDER / f"{policy_or_expert}.zip" if packaged else Path(policy_or_expert)
        name = policy_or_expert if packaged else Path(policy_or_expert).name
        return {"name": name, "sha256": hashlib.sha256(file.read_bytes()).hexdigest()}
    agent = checked_agent(policy_or_expert)
    name = agent if isinstance(agent, str) else type(agent).__name__
    kind = f"{type(agent).__module__}:{type(agent).__qualname__}"
    digest = hashlib.sha256(f"{kind} {getattr(agent, 'config', '')!r} {getattr(agent, 'contract', '')!r}".encode())
    network = agent if hasattr(agent, "state_dict") else getattr(agent, "policy", None)
    parameters: dict[str, Any] = getattr(network, "state_dict", dict)()
    for key, tensor in sorted(parameters.items()):
        digest.update(key.encode() + tensor.detach().cpu().numpy().tobytes())
    return {"name": name, "sha256": digest.hexdigest()}


def _is_named(given: Any) -> bool:
    return isinstance(given, PathLike) or (isinstance(given, str) and given != "expert")
