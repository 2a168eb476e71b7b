"""Imitation of a Go1 expert: demonstrations, a multi-head policy, behaviour cloning, DAgger and closed-loop evaluation.

The package knows environments only by "a Gymnasium environment with a method ``expert_action``"; it never imports an
expert. Names are resolved on first use, so that a worker that only collects demonstrations does not load torch.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trainers.batches import TensorBatches
    from trainers.bc import BCConfig, BCHistory, BCTrainer, train_bc
    from trainers.checkpoint import CheckpointError, load
    from trainers.clockless import ClocklessPolicy, learn_without_clock
    from trainers.collection import CollectJob, ShardMismatchError, collect, collect_all, watch
    from trainers.collector import BlockCollector
    from trainers.dagger import DAggerConfig, DAggerTrainer
    from trainers.dataset import Demonstrations
    from trainers.environments import PerturbationConfig, make_env, make_venv
    from trainers.evaluation import evaluate
    from trainers.expert_policy import ExpertPolicy
    from trainers.figures import joint_target_figure
    from trainers.learner import Learner
    from trainers.losses import MultiTaskLoss
    from trainers.metrics import offline_metrics
    from trainers.new_task import closest_task, learn_task
    from trainers.phase import PhaseConfig, PhaseEstimator, phase_errors, train_phase
    from trainers.policy import MultiHeadPolicy
    from trainers.pretrained import load_pretrained
    from trainers.recording import record_frames, save_gif, tile
    from trainers.report import paper_table, results_table
    from trainers.scoring import ClosedLoopResult, EpisodeRecord
    from trainers.switching import evaluate_switch
    from trainers.tensorboard import log_figure, log_round, log_text, make_logger

_HOME = {
    "BCConfig": "bc",
    "BCHistory": "bc",
    "BCTrainer": "bc",
    "BlockCollector": "collector",
    "CheckpointError": "checkpoint",
    "ClocklessPolicy": "clockless",
    "ClosedLoopResult": "scoring",
    "CollectJob": "collection",
    "DAggerConfig": "dagger",
    "DAggerTrainer": "dagger",
    "Demonstrations": "dataset",
    "EpisodeRecord": "scoring",
    "ExpertPolicy": "expert_policy",
    "Learner": "learner",
    "MultiHeadPolicy": "policy",
    "MultiTaskLoss": "losses",
    "PerturbationConfig": "environments",
    "PhaseConfig": "phase",
    "PhaseEstimator": "phase",
    "ShardMismatchError": "collection",
    "TensorBatches": "batches",
    "closest_task": "new_task",
    "collect": "collection",
    "collect_all": "collection",
    "evaluate": "evaluation",
    "evaluate_switch": "switching",
    "joint_target_figure": "figures",
    "learn_task": "new_task",
    "learn_without_clock": "clockless",
    "load": "checkpoint",
    "load_pretrained": "pretrained",
    "log_figure": "tensorboard",
    "log_round": "tensorboard",
    "log_text": "tensorboard",
    "make_env": "environments",
    "make_logger": "tensorboard",
    "make_venv": "environments",
    "offline_metrics": "metrics",
    "paper_table": "report",
    "phase_errors": "phase",
    "record_frames": "recording",
    "results_table": "report",
    "save_gif": "recording",
    "tile": "recording",
    "train_bc": "bc",
    "train_phase": "phase",
    "watch": "collection",
}

__all__ = [
    "BCConfig",
    "BCHistory",
    "BCTrainer",
    "BlockCollector",
    "CheckpointError",
    "ClocklessPolicy",
    "ClosedLoopResult",
    "CollectJob",
    "DAggerConfig",
    "DAggerTrainer",
    "Demonstrations",
    "EpisodeRecord",
    "ExpertPolicy",
    "Learner",
    "MultiHeadPolicy",
    "MultiTaskLoss",
    "PerturbationConfig",
    "PhaseConfig",
    "PhaseEstimator",
    "ShardMismatchError",
    "TensorBatches",
    "closest_task",
    "collect",
    "collect_all",
    "evaluate",
    "evaluate_switch",
    "joint_target_figure",
    "learn_task",
    "learn_without_clock",
    "load",
    "load_pretrained",
    "log_figure",
    "log_round",
    "log_text",
    "make_env",
    "make_logger",
    "make_venv",
    "offline_metrics",
    "paper_table",
    "phase_errors",
    "record_frames",
    "results_table",
    "save_gif",
    "tile",
    "train_bc",
    "train_phase",
    "watch",
]


def __getattr__(name: str) -> Any:
    """Import a public name from the file that holds it."""
    if name not in _HOME:
        raise AttributeError(f"module 'trainers' has no attribute {name!r}; it has {', '.join(__all__)}")
    value = getattr(import_module(f"trainers.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(__all__))
