"""New gaits for a trained student: one more head, which learns alone or together with the rest."""

import dataclasses
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from imitation.util.logger import HierarchicalLogger
from torch import nn

from go1_mtl_gym import TASKS
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import one_of
from trainers.algorithms.bc import BCConfig, BCHistory, train_bc
from trainers.data.demonstrations import Demonstrations
from trainers.evaluation.metrics import BATCH, offline_metrics
from trainers.policies.multi_head import MultiHeadPolicy

CRITIC_INPUT = "critic.0.weight"
"""Weights of the critic's first layer, shape (units, D): the one-hot task id is its last columns."""


def add_task(policy: MultiHeadPolicy, name: str, seed: int = 0, like: str | None = None) -> MultiHeadPolicy:
    """A copy of a policy with one more task; see `trainers.MultiHeadPolicy.add_task`."""
    tasks = tasks_of(policy)
    if policy.pooled:
        raise InvalidInputError(f"a policy with a head per task was expected, got a pooled one; it cannot add {name!r}")
    one_of(name, [task for task in TASKS if task not in tasks], "a task that the policy does not have")
    space = policy.observation_space
    grown = MultiHeadPolicy(
        **policy._get_constructor_parameters()
        | {
            "observation_space": spaces.Box(np.append(space.low, np.float32(0)), np.append(space.high, np.float32(1))),
            "n_tasks": policy.n_tasks + 1,
            "env_kwargs": policy.env_kwargs | {"tasks": (*tasks, name)},
            "seed": seed,
        }
    ).to(policy.device)
    kept = policy.state_dict()
    kept[CRITIC_INPUT] = nn.functional.pad(kept[CRITIC_INPUT], (0, 1))
    grown.load_state_dict(grown.state_dict() | kept)
    if like is not None:
        own = policy.actor.heads[tasks.index(one_of(like, tasks, "like"))]
        grown.actor.heads[-1].load_state_dict(own.state_dict())
    grown.seed = None  # no seed gives these weights
    grown.set_training_mode(policy.training)
    return grown


def learn_task(
    policy: MultiHeadPolicy,
    dataset: Demonstrations,
    config: BCConfig | None = None,
    validation: Demonstrations | None = None,
    rehearsal: Demonstrations | None = None,
    logger: HierarchicalLogger | None = None,
    progress: bool = False,
) -> BCHistory:
    """Teach a trained policy new tasks, as `trainers.MultiHeadPolicy.add_task` gave them to it.

    Without `rehearsal` only the heads of the tasks that have rows are trained. All other weights and the normalisation
    stay as they are to the bit, and so does what the policy does in other tasks. The trunk's features of all rows are
    computed once, so that a step costs no more than the heads do.

    With `rehearsal` the whole actor is trained on both sets of rows, and the old tasks change too.

    Args:
        policy: trained in place; its normalisation stays, because trunk and old heads belong to it.
        dataset: rows of the new tasks, their task id of any tasks that the policy has.
        config: how to clone.
        validation: held-out rows whose R2 is logged, or None; without `rehearsal`, of the tasks that are trained.
        rehearsal: rows of tasks that the policy knows already, or None.
        logger: from `trainers.make_logger`; None logs nothing.
        progress: show a bar.

    Returns:
        Losses and held-out R2 over the steps.

    Raises:
        InvalidInputError: if there are no rows, the policy is pooled or does not have their tasks, or observations have
            another size.
    """
    if policy.pooled or not len(dataset):
        kind = "pooled policy" if policy.pooled else "policy with heads"
        raise InvalidInputError(f"a policy with heads and rows were expected, got a {kind} and {len(dataset)} rows")
    more = {"logger": logger, "progress": progress, "fit_normalization": False}
    if rehearsal is None:
        names = tuple(dataset.per_task())
        rows = trunk_features(policy, dataset).with_tasks(names)
        own = None if validation is None else trunk_features(policy, validation).with_tasks(names)
        return train_bc(_heads_alone(policy, names), rows, config, own, **more)
    tasks = tasks_of(policy)
    rows = Demonstrations.concatenate([dataset.with_tasks(tasks), rehearsal.with_tasks(tasks)])
    own = None if validation is None else validation.with_tasks(tasks)
    return train_bc(policy, rows, config, own, **more)


def closest_task(policy: MultiHeadPolicy, dataset: Demonstrations) -> str:
    """The task of a policy whose head, asked for the actions of another task, errs least: a start for a new head.

    Args:
        policy: a trained one.
        dataset: rows of the other task; their task id does not matter.

    Raises:
        InvalidInputError: if there are no rows, or their observations do not fit the policy's.
    """
    tasks, (seen, _) = tasks_of(policy), np.split(dataset.obs, [-len(dataset.tasks)], axis=1)
    errors = {}
    for name in tasks:
        as_if = np.tile(np.eye(len(tasks), dtype=np.float32)[tasks.index(name)], (len(seen), 1))
        rows = dataclasses.replace(dataset, obs=np.hstack([seen, as_if]), tasks=tasks)
        errors |= {own: scores["mse"] for own, scores in offline_metrics(policy, rows).items()}
    if not errors:
        raise InvalidInputError("rows of the new task were expected, got none")
    return min(errors, key=errors.__getitem__)


def tasks_of(policy: Any) -> tuple[str, ...]:
    """Names of a policy's tasks in head order, from its `env_kwargs`.

    Raises:
        InvalidInputError: if they are not as many as its task id has entries.
    """
    tasks = tuple(policy.env_kwargs.get("tasks") or TASKS)
    if len(tasks) != policy.n_tasks:
        raise InvalidInputError(f"env_kwargs must name the policy's {policy.n_tasks} tasks, got {tasks}")
    return tasks


@torch.no_grad()
def trunk_features(policy: MultiHeadPolicy, dataset: Demonstrations) -> Demonstrations:
    """The same rows with what the policy's trunk makes of them in the place of what was seen.

    Args:
        policy: a trained one.
        dataset: rows with observations of shape (n, D).

    Returns:
        Observations of shape (n, width + K): features and the rows' own task id.

    Raises:
        InvalidInputError: if the observations do not fit the policy's, or a task is none of its own.
    """
    rows = dataset.with_tasks(tasks_of(policy))
    if rows.obs.shape[1:] != policy.observation_space.shape:
        size = policy.observation_space.shape[0] - policy.n_tasks
        raise InvalidInputError(
            f"observations must have {size} entries and the task id, got {rows.obs.shape[1] - policy.n_tasks}"
        )
    obs = torch.as_tensor(rows.obs).split(BATCH)
    features = [policy.actor.trunk(policy._normalized(each.to(policy.device))).cpu() for each in obs]
    seen = np.hstack([torch.cat(features).numpy(), rows.obs[:, -policy.n_tasks :]])
    return dataclasses.replace(rows, obs=seen)


def _heads_alone(policy: MultiHeadPolicy, names: tuple[str, ...]) -> MultiHeadPolicy:
    """A policy whose observations are the trunk's features; its heads are those of the policy, not copies of them."""
    tasks = tasks_of(policy)
    space = spaces.Box(-np.inf, np.inf, (policy.width + len(names),), np.float32)
    heads = MultiHeadPolicy(
        space, policy.action_space, width=policy.width, n_tasks=len(names), clip_sd=np.inf, seed=0
    ).to(policy.device)
    heads.actor.trunk = nn.Identity()
    heads.actor.heads = nn.ModuleList(policy.actor.heads[tasks.index(name)] for name in names)
    heads.act_normalizer = policy.act_normalizer
    return heads
