"""New gaits for a trained student: one more head, which learns alone or together with the rest."""

import dataclasses
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from imitation.util.logger import HierarchicalLogger
from torch import nn

from go1_mtl_gym.contract import ObservationTerm, PolicyContract
from go1_mtl_gym.errors import InvalidInputError
from trainers.algorithms.bc import BCHistory, train_bc, with_images
from trainers.algorithms.config import BCConfig
from trainers.data.demonstrations import Demonstrations
from trainers.evaluation.metrics import BATCH, offline_metrics
from trainers.policies.multi_head import MultiHeadPolicy


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
        InvalidInputError: if there are no rows, the policy is pooled or does not have their tasks, or their contracts
            differ in anything else.
    """
    if policy.pooled or not len(dataset):
        kind = "pooled policy" if policy.pooled else "policy with heads"
        raise InvalidInputError(f"a policy with heads and rows were expected, got a {kind} and {len(dataset)} rows")
    more: dict[str, Any] = {"logger": logger, "progress": progress, "fit_normalization": False}
    if rehearsal is None:
        # here already, because what the trunk makes of a row has no mirror image
        dataset, config = with_images(dataset, config or BCConfig())
        names = tuple(dataset.per_task())
        rows = trunk_features(policy, dataset).with_tasks(names)
        held_out = None if validation is None else trunk_features(policy, validation).with_tasks(names)
        return train_bc(_heads_alone(policy, names, rows.contract), rows, config, held_out, **more)
    rows = Demonstrations.concatenate([each.fitted_to(policy.contract) for each in (dataset, rehearsal)])
    return train_bc(policy, rows, config, validation, **more)


def closest_task(policy: MultiHeadPolicy, dataset: Demonstrations) -> str:
    """The task of a policy whose head, asked for the actions of another task, errs least: a start for a new head.

    Args:
        policy: a trained one.
        dataset: rows of the other task; their task id does not matter.

    Raises:
        InvalidInputError: if there are no rows, or their contract differs from the policy's in more than the tasks.
    """
    contract = policy.named_contract()
    contract.check(dataset.contract, "the policy", "the demonstrations", ignore=("tasks",))
    tasks, (seen, _) = contract.tasks, np.split(dataset.obs, [-len(dataset.tasks)], axis=1)
    errors: dict[str, float] = {}
    for name in tasks:
        as_if = np.tile(np.eye(len(tasks), dtype=np.float32)[tasks.index(name)], (len(seen), 1))
        rows = dataclasses.replace(dataset, obs=np.hstack([seen, as_if]), contract=contract)
        errors |= {task: scores["mse"] for task, scores in offline_metrics(policy, rows).items()}
    if not errors:
        raise InvalidInputError("rows of the new task were expected, got none")
    return min(errors, key=errors.__getitem__)


@torch.no_grad()
def trunk_features(policy: MultiHeadPolicy, dataset: Demonstrations) -> Demonstrations:
    """The same rows with what the policy's trunk makes of them in the place of what was seen.

    Args:
        policy: a trained one.
        dataset: rows of its contract, with tasks that it has.

    Returns:
        Observations of shape (n, width + K): features and the policy's task id.

    Raises:
        InvalidInputError: if the rows do not belong to the policy's contract, or a task is none of the policy's.
    """
    contract = policy.named_contract()
    rows = dataset.fitted_to(contract)
    obs = torch.as_tensor(rows.obs).split(BATCH)
    features = [policy.actor.trunk(policy.normalized(each.to(policy.device))).cpu() for each in obs]
    seen = np.hstack([torch.cat(features).numpy(), rows.obs[:, -policy.n_tasks :]])
    return dataclasses.replace(rows, obs=seen, contract=_of_features(contract, policy.width))


def _of_features(contract: PolicyContract, width: int) -> PolicyContract:
    """The contract of rows that hold a trunk's features."""
    return contract.with_terms([ObservationTerm("trunk_features", width)])


def _heads_alone(policy: MultiHeadPolicy, names: tuple[str, ...], contract: PolicyContract) -> MultiHeadPolicy:
    """A policy whose observations are the trunk's features; its heads are those of the policy, not copies of them."""
    space = spaces.Box(-np.inf, np.inf, (policy.width + len(names),), np.float32)
    heads = MultiHeadPolicy(
        space, policy.action_space, contract=contract, width=policy.width, clip_sd=np.inf, seed=0
    ).to(policy.device)
    heads.actor.trunk = nn.Identity()
    heads.actor.heads = nn.ModuleList(policy.actor.heads[policy.tasks.index(name)] for name in names)
    heads.act_normalizer = policy.act_normalizer
    return heads
