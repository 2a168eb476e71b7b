"""Policy files of version 0.1, as this version has them.

0.1 wrote no contract, centered actions on the middle of the joints' range instead of on the home pose, and called a
phase-free policy clockless. Both maps from actions to joint targets are affine, and so are the policy's normalizations
of its action and of the last action that it sees: the change of map is folded into them, exactly but for rounding.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from go1_mtl_gym import TASKS
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.contract import PolicyContract
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout

Weights = dict[str, dict[str, torch.Tensor]]


def upgraded(description: Mapping[str, Any], weights: Weights) -> tuple[dict[str, Any], Weights]:
    """Description and weights of a policy file of format version 1 in the form of version 2.

    Raises:
        InvalidInputError: if the file does not name its tasks, or one of them is not registered.
        KeyError, TypeError: if the file is damaged.
    """
    network = dict(description["network"])
    given = dict(network.pop("env_kwargs"))
    contract = _contract(given)
    names = ("tasks", "channels", "history", "control_hz", "kp", "kd")
    student = {
        "network": {name: value for name, value in network.items() if name != "n_tasks"},
        "contract": contract.as_dict(),
        "env_kwargs": {name: value for name, value in given.items() if name not in names},
        "observation_space": description["observation_space"],
        "action_space": description["action_space"],
    }
    old, new = (map_of(PDGains(contract.kp, contract.kd)) for map_of in (ActionMap.of_version_0_1, ActionMap.for_gains))
    policy_weights = dict(weights["weights"])
    _move(policy_weights, "act_normalizer", slice(0, 12), old, new)
    policy_weights["log_std"] = policy_weights["log_std"] + _float32(np.log(old.half_range / new.half_range))
    phase_free = description.get("clockless")
    slices = contract.slices
    if "last_action" in slices:
        _move(policy_weights, "obs_normalizer", slices["last_action"], old, new)
    if phase_free is None:
        return {"kind": "multi_head", "policy": student}, {"weights": policy_weights}
    phase_weights = dict(weights["phase"])
    if "last_action" in slices:
        before = slices["phase"].stop - slices["phase"].start  # the phase, which the estimator does not see
        seen = slice(slices["last_action"].start - before, slices["last_action"].stop - before)
        _move(phase_weights, "normalizer", seen, old, new)
    policy = {"student": student, "phase": dict(phase_free)}
    return {"kind": "phase_free", "policy": policy}, {"weights": policy_weights, "phase": phase_weights}


def _contract(env_kwargs: Mapping[str, Any]) -> PolicyContract:
    """The contract of the environment that version 0.1 made with some arguments."""
    tasks = tuple(env_kwargs.get("tasks") or ())
    unknown = [name for name in tasks if name not in TASKS]
    if not tasks or unknown:
        raise InvalidInputError(
            f"a policy of version 0.1 was expected to name its tasks, all of them registered; it names {tasks}, "
            f"of which {unknown} are not (go1_mtl_gym.register_task registers one)"
        )
    gains = PDGains(env_kwargs.get("kp", 50.0), env_kwargs.get("kd", 2.0))
    return PolicyContract.of_environment(
        ObservationLayout(tasks, env_kwargs.get("channels", ()), env_kwargs.get("history", 1)),
        [TASKS[name].gait for name in tasks],
        env_kwargs.get("control_hz", 50),
        gains,
        ActionMap.for_gains(gains),
    )


def _move(tensors: dict[str, torch.Tensor], normalizer: str, entries: slice, old: ActionMap, new: ActionMap) -> None:
    """Let a normalizer x -> (x - shift) / scale of old actions be one of new actions, in place.

    With x_old = (c_new + h_new x_new - c_old) / h_old both shift and scale stay numbers per entry.
    """
    shift, scale = tensors[f"{normalizer}.shift"].clone(), tensors[f"{normalizer}.scale"].clone()
    ratio = old.half_range / new.half_range
    shift[entries] = _float32((old.center - new.center) / new.half_range + ratio * shift[entries].numpy())
    scale[entries] = _float32(ratio * scale[entries].numpy())
    tensors[f"{normalizer}.shift"], tensors[f"{normalizer}.scale"] = shift, scale


def _float32(values: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(np.asarray(values, dtype=np.float32))
