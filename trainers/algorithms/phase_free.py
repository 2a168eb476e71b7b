"""Teaching a policy to do without a clock: it is watched while it walks, and an estimator learns its phase."""

import math
from typing import Any

import numpy as np
import torch

from trainers.algorithms.config import PhaseConfig
from trainers.algorithms.optimizer import adamw_one_cycle
from trainers.data.collection import EPISODE_S, watch
from trainers.data.demonstrations import Demonstrations
from trainers.data.environments import EnvFactory, PerturbationConfig, derive_seed, make_env
from trainers.policies import normalization as norm
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.policies.phase_estimator import PhaseEstimator, inputs_and_phase
from trainers.policies.phase_free import CORRECTION, PhaseFreePolicy, phase_free_layout
from trainers.utils.progress import tracked


def train_phase(
    estimator: PhaseEstimator,
    rows: Demonstrations,
    config: PhaseConfig | None = None,
    progress: bool = False,
) -> None:
    """Fit normalisation and network to rows that hold the phase; the loss is the squared distance of (sine, cosine).

    Args:
        estimator: trained in place.
        rows: of any driver, with the channel "phase" and all that the estimator sees; whoever drove, the clock that
            drove it is what is learned.
        config: how to train.
        progress: show a bar.

    Raises:
        InvalidInputError: if the rows do not fit, or there are none.
    """
    config = config or PhaseConfig()
    rows_seen, phase = inputs_and_phase(estimator, rows)
    seen, estimator.contract = rows_seen.obs, rows_seen.contract
    device = estimator.normalizer.shift.device
    estimator.normalizer.set(*norm.fit(seen, "mean_std"))
    inputs, target = torch.as_tensor(seen, device=device), torch.as_tensor(phase, device=device)
    weights = list(estimator.network.parameters())
    optimizer, schedule = adamw_one_cycle(weights, config.learning_rate, config.weight_decay, config.steps)
    rng = np.random.default_rng(config.seed)
    for _ in tracked(range(config.steps), "phase", config.steps, "step", progress):
        batch = torch.from_numpy(rng.integers(len(seen), size=min(config.batch_size, len(seen)))).to(device)
        loss = (estimator(inputs[batch]) - target[batch]).square().sum(dim=1).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()


def train_phase_free(
    student: MultiHeadPolicy,
    seconds: float = 240.0,
    history: int = 10,
    *,
    correction: float = CORRECTION,
    perturbation: PerturbationConfig | None = None,
    config: PhaseConfig | None = None,
    seed: int = 0,
    progress: bool = False,
    make_env: EnvFactory = make_env,
    **env_kwargs: Any,
) -> PhaseFreePolicy:
    """Watch a student walk with its clock, and train an estimator of the phase from what it felt; no expert is asked.

    Args:
        student: a trained one.
        seconds: watched per task [s].
        history: frames of proprioception that the estimator reads.
        correction: of the policy that is returned; see `PhaseFreePolicy`.
        perturbation: of the walks; None is the default `PerturbationConfig`.
        config: how to train the estimator.
        seed: of the walks and of the initial weights.
        progress: show bars.
        make_env: another environment factory.
        env_kwargs: of the environment; on top of the student's own ``env_kwargs``.

    Raises:
        InvalidInputError: if the student sees no command and phase, or a figure is outside its range.
        CollectionError: if the student keeps falling.
    """
    estimator = PhaseEstimator(phase_free_layout(student, history), seed=seed)
    policy = PhaseFreePolicy(student, estimator, correction)
    shards = max(1, math.ceil(seconds / EPISODE_S))
    walks = [(task, derive_seed("watch", seed, i)) for i in range(shards) for task in estimator.layout.tasks]
    perturbation = perturbation or PerturbationConfig()
    watched = [
        watch(student, task, walk_seed, seconds / shards, perturbation, history, make_env=make_env, **env_kwargs)
        for task, walk_seed in tracked(walks, "watch", len(walks), "walk", progress)
    ]
    train_phase(estimator, Demonstrations.concatenate(watched), config, progress)
    return policy
