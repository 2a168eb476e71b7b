"""Behaviour cloning on `imitation`'s trainer, with our loss, batches, optimiser and log."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from imitation.algorithms import bc as imitation_bc
from imitation.util.logger import HierarchicalLogger

from go1_mtl_gym.errors import Go1Error
from trainers.algorithms import losses
from trainers.algorithms.config import BCConfig
from trainers.algorithms.optimizer import WeightAverage, adamw_one_cycle, matmul_precision
from trainers.data.batches import TensorBatches, check_batch_size
from trainers.data.demonstrations import Demonstrations
from trainers.data.mirror import with_mirrored
from trainers.evaluation.metrics import offline_metrics
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.utils.logging import make_logger
from trainers.utils.progress import Bar


class TrainingDivergedError(Go1Error):
    """The loss became NaN or infinite."""


@dataclasses.dataclass
class BCHistory:
    """What was logged during training, one entry per `BCConfig.log_interval` steps and one at the end.

    Attributes:
        steps: gradient steps done.
        loss: of the last batch.
        mse: task -> mean squared error of the last batch [rad^2].
        r2: task -> held-out R2 over all joints; empty without validation data.
    """

    steps: list[int] = dataclasses.field(default_factory=list)
    loss: list[float] = dataclasses.field(default_factory=list)
    mse: dict[str, list[float]] = dataclasses.field(default_factory=dict)
    r2: dict[str, list[float]] = dataclasses.field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready values."""
        return dataclasses.asdict(self)


class BCTrainer(imitation_bc.BC):
    """`imitation`'s BC loop with the multi-task loss, AdamW under a one-cycle schedule, and gradient clipping.

    Only the actor is trained. The log's step axis counts gradient steps over all calls of `fit`, so that the rounds of
    DAgger follow each other.

    Args:
        policy: the student, its normalisation already fitted.
        config: how to clone.
        logger: shared log, or None for a silent one.
        first_step: gradient steps that the policy has behind it, where the log's axis goes on.
    """

    _policy: MultiHeadPolicy
    _bc_logger: "_StepLogger"
    loss_calculator: losses.MultiTaskLoss  # type: ignore[assignment]  # imitation reads its result's `loss`, no more

    def __init__(
        self,
        policy: MultiHeadPolicy,
        config: BCConfig | None = None,
        logger: HierarchicalLogger | None = None,
        first_step: int = 0,
    ) -> None:
        self.config = config or BCConfig()
        super().__init__(
            observation_space=policy.observation_space,
            action_space=policy.action_space,
            rng=np.random.default_rng(self.config.seed),
            policy=policy,
            batch_size=self.config.batch_size,
            device=policy.device,
            custom_logger=make_logger() if logger is None else logger,
        )
        self.steps_done = first_step
        self._bc_logger = _StepLogger(self.logger)

    @property
    def policy(self) -> MultiHeadPolicy:
        """The student."""
        return self._policy

    def fit(
        self,
        dataset: Demonstrations,
        validation: Demonstrations | None = None,
        progress: bool = False,
        on_batch_end: Callable[[], None] | None = None,
        seed: int | None = None,
        weights: np.ndarray | None = None,
    ) -> BCHistory:
        """Run the whole schedule once on a data set, starting from the present weights.

        Args:
            dataset: training rows.
            validation: held-out rows whose R2 is logged, or None.
            progress: show a bar.
            on_batch_end: called after every gradient step.
            seed: of the order of the rows; None takes the configuration's.
            weights: how often each row is drawn per pass, positive integers, shape (n,); None draws each once.

        Raises:
            InvalidInputError: if the weights are not as described, or the rows do not belong to the policy's contract;
                rows whose tasks are in another order are brought into the policy's.
            TrainingDivergedError: if the loss is no longer finite.
        """
        config, policy = self.config, self.policy
        dataset = dataset.fitted_to(policy.contract)
        validation = None if validation is None else validation.fitted_to(policy.contract)
        if config.mirror:
            dataset, weights = with_mirrored(dataset, weights)
        batch_size = min(config.batch_size, len(dataset))
        self.batch_size = self.minibatch_size = batch_size
        seed = config.seed if seed is None else seed
        batches = TensorBatches(dataset, batch_size, seed, policy.device, weights)
        self.set_demonstrations(batches)  # type: ignore[arg-type]  # imitation's TypedDict is invariant
        self.loss_calculator = losses.MultiTaskLoss(
            dataset.tasks, dataset.half_range, config.space, batches.rows, config.autocast
        )
        self.optimizer, schedule = _optimizer(policy, config)
        average = WeightAverage(policy.actor, config.ema_decay) if config.ema_decay else None
        self.history = BCHistory()
        first = self.steps_done
        was_training = policy.training
        with Bar("clone", config.steps, "step", progress) as bar:

            def after_step() -> None:
                schedule.step()
                self.steps_done += 1
                if average is not None:
                    average.update()
                bar.update()
                if (self.steps_done - first) % config.log_interval == 0 or self.steps_done - first == config.steps:
                    bar.note(loss=f"{self._record(validation):.2e}")
                if on_batch_end is not None:
                    on_batch_end()

            policy.set_training_mode(True)
            try:
                with matmul_precision(config.matmul_precision):
                    self.train(n_batches=config.steps, on_batch_end=after_step, log_interval=1, progress_bar=False)
            finally:
                policy.set_training_mode(was_training)
        if average is not None:
            average.copy_to_network()
        return self.history

    def _record(self, validation: Demonstrations | None) -> float:
        """Write the last batch's losses and the held-out R2 to history and log; return the loss."""
        last = {name: float(value.detach()) for name, value in vars(self._bc_logger.metrics).items()}
        history = self.history
        if not np.isfinite(last["loss"]):
            raise TrainingDivergedError(f"the loss is {last['loss']} after {self.steps_done} steps")
        history.steps.append(self.steps_done)
        history.loss.append(last["loss"])
        for task in self.loss_calculator.tasks:
            if f"mse_{task}" in last:
                history.mse.setdefault(task, []).append(last[f"mse_{task}"])
        for name, value in last.items():
            self.logger.record(f"bc/{name.replace('mse_', 'mse/')}", value)
        if validation is not None:
            for task, scores in offline_metrics(self.policy, validation).items():
                history.r2.setdefault(task, []).append(scores["r2"])
                self.logger.record(f"held_out/r2/{task}", scores["r2"])
            self.policy.set_training_mode(True)
        self.logger.dump(self.steps_done)
        return last["loss"]


class _StepLogger(imitation_bc.BCLogger):
    """Keeps each batch's metrics instead of writing them: `BCTrainer` writes, with gradient steps as the axis."""

    metrics: losses.MultiTaskMetrics

    def log_batch(
        self, batch_num: int, batch_size: int, num_samples_so_far: int, training_metrics: Any, rollout_stats: Any
    ) -> None:
        self.metrics = training_metrics


def _optimizer(
    policy: MultiHeadPolicy, config: BCConfig
) -> tuple[torch.optim.Optimizer, torch.optim.lr_scheduler.LRScheduler]:
    """AdamW over the actor alone, which clips its gradients before each step, and its one-cycle schedule."""
    weights = list(policy.actor.parameters())
    optimizer, schedule = adamw_one_cycle(
        weights, config.learning_rate, config.weight_decay, config.steps, config.warmup
    )

    def clip(*_: Any) -> None:
        torch.nn.utils.clip_grad_norm_(weights, config.max_grad_norm)

    optimizer.register_step_pre_hook(clip)
    return optimizer, schedule


def with_images(dataset: Demonstrations, config: BCConfig) -> tuple[Demonstrations, BCConfig]:
    """Rows and their mirror images if a configuration wants them, and the configuration that wants no more."""
    if not config.mirror:
        return dataset, config
    return with_mirrored(dataset)[0], dataclasses.replace(config, mirror=False)


def train_bc(
    policy: MultiHeadPolicy,
    dataset: Demonstrations,
    config: BCConfig | None = None,
    validation: Demonstrations | None = None,
    logger: HierarchicalLogger | None = None,
    progress: bool = False,
    on_batch_end: Callable[[], None] | None = None,
    fit_normalization: bool = True,
) -> BCHistory:
    """Clone: fit the policy's normalisation to the data set, then its actor.

    Args:
        policy: the student; trained in place.
        dataset: training rows.
        config: how to clone.
        validation: held-out rows whose R2 is logged, or None.
        logger: from `trainers.make_logger`; None logs nothing.
        progress: show a bar.
        on_batch_end: called after every gradient step.
        fit_normalization: False keeps the normalisation that the policy has (its weights belong to it).

    Returns:
        Losses and held-out R2 over the steps.

    Raises:
        InvalidInputError: if the rows do not belong to the policy's contract; nothing is changed then.
    """
    config = config or BCConfig()
    dataset = dataset.fitted_to(policy.contract)
    validation = None if validation is None else validation.fitted_to(policy.contract)
    check_batch_size(min(config.batch_size, len(dataset)), dataset)
    dataset, config = with_images(dataset, config)  # once, for normalization and training alike
    if fit_normalization:
        policy.fit_normalization(dataset.obs, dataset.acts)
    return BCTrainer(policy, config, logger).fit(dataset, validation, progress, on_batch_end)
