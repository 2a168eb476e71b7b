"""What a multi-head policy refuses: when it is made, and when it is asked."""

from typing import Any

import numpy as np
from gymnasium import spaces

from go1_mtl_gym.contract import PolicyContract
from go1_mtl_gym.errors import InvalidInputError
from trainers.policies.modes import MODES


def number_of_tasks(contract: PolicyContract | None, n_tasks: int | None) -> int:
    """How many tasks a policy is for, by its contract where it has one.

    Raises:
        InvalidInputError: if neither is given.
    """
    if n_tasks is not None:
        return n_tasks
    if contract is None:
        raise InvalidInputError(
            "a contract (or, for an environment without one, n_tasks) must be given, got neither; with PPO: "
            "policy_kwargs={'contract': env.unwrapped.contract}"
        )
    return contract.n_tasks


def check_spaces(contract: PolicyContract, observation_space: Any, action_space: Any, n_tasks: int) -> None:
    """Refuse spaces that are not the contract's.

    Raises:
        InvalidInputError: says the contract's terms, and both shapes.
    """
    sizes = (observation_space.shape, action_space.shape, n_tasks)
    expected = ((contract.observation_size,), (len(contract.joints),), contract.n_tasks)
    if sizes != expected:
        raise InvalidInputError(
            f"by the contract ({contract.describe()}) the shapes of observation and action space and n_tasks are "
            f"{expected}, got {sizes}"
        )


def check_arguments(
    observation_space: Any,
    action_space: Any,
    width: int,
    n_tasks: int,
    normalization: str,
    clip_sd: float,
    sde: bool,
) -> None:
    """Refuse what no policy can be made with.

    Raises:
        InvalidInputError: says what came and what was expected.
    """
    if isinstance(n_tasks, bool) or not isinstance(n_tasks, (int, np.integer)) or n_tasks < 1:
        raise InvalidInputError(f"n_tasks must be a positive integer, got {n_tasks!r}")
    if not isinstance(width, (int, np.integer)) or width < 1:
        raise InvalidInputError(f"width must be a positive integer, got {width!r}")
    for space, smallest, label in (
        (observation_space, n_tasks, "observation_space"),
        (action_space, 0, "action_space"),
    ):
        if not isinstance(space, spaces.Box) or len(space.shape) != 1 or space.shape[0] <= smallest:
            raise InvalidInputError(f"{label} must be a flat Box of more than {smallest} entries, got {space}")
    if normalization not in MODES:
        raise InvalidInputError(f"normalization must be one of {', '.join(MODES)}; got {normalization!r}")
    if not clip_sd > 0:
        raise InvalidInputError(f"clip_sd must be positive, got {clip_sd!r}")
    if sde:
        raise InvalidInputError("use_sde is not supported: the exploration noise does not depend on the state")


def check_observation(obs: np.ndarray, contract: PolicyContract | None, size: int, n_tasks: int) -> None:
    """Refuse observations that a policy was not made for.

    Args:
        obs: what came.
        contract: of the policy, for the message.
        size: of an observation, D.
        n_tasks: length of the task id.

    Raises:
        InvalidInputError: if an observation has another size or is not finite, or does not end in a one-hot task id.
    """
    if obs.ndim not in (1, 2) or obs.shape[-1] != size:
        meant = f" ({contract.describe()}; policy.make_env() makes the environment)" if contract else ""
        raise InvalidInputError(f"observations must have shape ({size},) or (n, {size}){meant}, got {obs.shape}")
    if not np.isfinite(obs).all():
        raise InvalidInputError("observation must be finite, got NaN or infinity")
    check_task_ids(obs[..., -n_tasks:].reshape(-1, n_tasks))


def check_task_ids(task: np.ndarray) -> None:
    """Refuse what is no task id, before a head is chosen by it; most often the observation was normalized.

    Args:
        task: the last K entries of observations, shape (n, K).

    Raises:
        InvalidInputError: says what came, and how observations stay as they are.
    """
    one_hot = (task.sum(-1) == 1.0) & (task.max(-1) == 1.0)
    if not one_hot.all():
        raise InvalidInputError(
            f"the last {task.shape[-1]} entries of an observation must be a one-hot task id, got "
            f"{task[~one_hot][0].tolist()}; if VecNormalize changed it, give that norm_obs=False (the policies "
            "normalize by themselves) or ask trainers.OriginalObs(policy, venv)"
        )
