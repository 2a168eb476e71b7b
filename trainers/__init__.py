"""Imitation of a Go1 expert: demonstrations, a multi-head policy, behavior cloning, DAgger and closed-loop evaluation.

The package knows environments only by "a Gymnasium environment with a method ``expert_action`` and a ``contract``"; it
never imports an expert. Names are resolved on first use, so that a worker that only collects demonstrations does not
load torch. The sub-packages stand in the order of the data: `trainers.data`, `policies`, `evaluation`, `algorithms`,
`pipeline`.
"""

import warnings
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trainers.algorithms.add_task import closest_task, learn_task
    from trainers.algorithms.bc import BCHistory, BCTrainer, train_bc
    from trainers.algorithms.config import BCConfig, DAggerConfig, PhaseConfig
    from trainers.algorithms.dagger import DAggerTrainer
    from trainers.algorithms.dagger_collector import BlockCollector
    from trainers.algorithms.losses import MultiTaskLoss
    from trainers.algorithms.phase_free import train_phase, train_phase_free
    from trainers.algorithms.ppo import ppo_from_policy
    from trainers.data.batches import TensorBatches
    from trainers.data.collection import CollectJob, ShardMismatchError, collect, collect_all, watch
    from trainers.data.demonstrations import Demonstrations
    from trainers.data.environments import PerturbationConfig, make_env, make_venv
    from trainers.data.mirror import mirrored
    from trainers.data.operator import OperatorConfig
    from trainers.data.operator_plan import draw_plan
    from trainers.data.operator_wrapper import OperatorWrapper
    from trainers.data.stateful import Learner
    from trainers.evaluation.certificate import Certificate
    from trainers.evaluation.certify import certify
    from trainers.evaluation.closed_loop import evaluate
    from trainers.evaluation.conditions import Condition
    from trainers.evaluation.figures import joint_target_figure
    from trainers.evaluation.gait_transitions import evaluate_transition
    from trainers.evaluation.metrics import offline_metrics
    from trainers.evaluation.replay import replay
    from trainers.evaluation.scoring import ClosedLoopResult, EpisodeRecord
    from trainers.evaluation.script import Move, Script
    from trainers.evaluation.tour import film_tour, save_tour
    from trainers.evaluation.video import record_frames, save_gif, save_webp, tile
    from trainers.pipeline.config import JobConfig
    from trainers.pipeline.job import Job
    from trainers.policies.checkpoint import CheckpointError
    from trainers.policies.expert_policy import ExpertPolicy
    from trainers.policies.loading import load
    from trainers.policies.multi_head import MultiHeadPolicy
    from trainers.policies.original_obs import OriginalObs
    from trainers.policies.phase_estimator import PhaseEstimator, phase_errors
    from trainers.policies.phase_free import PhaseFreePolicy
    from trainers.policies.pretrained import load_pretrained
    from trainers.utils.logging import log_figure, log_round, log_text, make_logger
    from trainers.utils.report import paper_table, results_table

_HOME = {
    "BCConfig": "algorithms.config",
    "BCHistory": "algorithms.bc",
    "BCTrainer": "algorithms.bc",
    "BlockCollector": "algorithms.dagger_collector",
    "Certificate": "evaluation.certificate",
    "CheckpointError": "policies.checkpoint",
    "ClosedLoopResult": "evaluation.scoring",
    "CollectJob": "data.collection",
    "Condition": "evaluation.conditions",
    "DAggerConfig": "algorithms.config",
    "DAggerTrainer": "algorithms.dagger",
    "Demonstrations": "data.demonstrations",
    "EpisodeRecord": "evaluation.scoring",
    "ExpertPolicy": "policies.expert_policy",
    "Job": "pipeline.job",
    "JobConfig": "pipeline.config",
    "Learner": "data.stateful",
    "Move": "evaluation.script",
    "MultiHeadPolicy": "policies.multi_head",
    "MultiTaskLoss": "algorithms.losses",
    "OperatorConfig": "data.operator",
    "OperatorWrapper": "data.operator_wrapper",
    "OriginalObs": "policies.original_obs",
    "PerturbationConfig": "data.environments",
    "PhaseConfig": "algorithms.config",
    "PhaseEstimator": "policies.phase_estimator",
    "PhaseFreePolicy": "policies.phase_free",
    "Script": "evaluation.script",
    "ShardMismatchError": "data.collection",
    "TensorBatches": "data.batches",
    "certify": "evaluation.certify",
    "closest_task": "algorithms.add_task",
    "collect": "data.collection",
    "collect_all": "data.collection",
    "draw_plan": "data.operator_plan",
    "evaluate": "evaluation.closed_loop",
    "evaluate_transition": "evaluation.gait_transitions",
    "film_tour": "evaluation.tour",
    "joint_target_figure": "evaluation.figures",
    "learn_task": "algorithms.add_task",
    "load": "policies.loading",
    "load_pretrained": "policies.pretrained",
    "log_figure": "utils.logging",
    "log_round": "utils.logging",
    "log_text": "utils.logging",
    "make_env": "data.environments",
    "make_logger": "utils.logging",
    "make_venv": "data.environments",
    "mirrored": "data.mirror",
    "offline_metrics": "evaluation.metrics",
    "paper_table": "utils.report",
    "phase_errors": "policies.phase_estimator",
    "ppo_from_policy": "algorithms.ppo",
    "record_frames": "evaluation.video",
    "replay": "evaluation.replay",
    "results_table": "utils.report",
    "save_gif": "evaluation.video",
    "save_tour": "evaluation.tour",
    "save_webp": "evaluation.video",
    "tile": "evaluation.video",
    "train_bc": "algorithms.bc",
    "train_phase": "algorithms.phase_free",
    "train_phase_free": "algorithms.phase_free",
    "watch": "data.collection",
}
_RENAMED = {
    "ClocklessPolicy": "PhaseFreePolicy",
    "evaluate_switch": "evaluate_transition",
    "learn_without_clock": "train_phase_free",
}
"""Names of version 0.1, which go in 0.3."""

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    """Import a public name from the file that holds it."""
    if name in _RENAMED:
        warnings.warn(f"trainers.{name} is now trainers.{_RENAMED[name]}", DeprecationWarning, stacklevel=2)
        return __getattr__(_RENAMED[name])
    if name not in _HOME:
        raise AttributeError(f"module 'trainers' has no attribute {name!r}; it has {', '.join(__all__)}")
    value = getattr(import_module(f"trainers.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(__all__))
