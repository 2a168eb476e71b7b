"""The baselines: one head for all gaits, and the paper's literal observation, trained on the policy's own rows."""

from pathlib import Path

import joblib
import torch

from trainers.algorithms.bc import train_bc
from trainers.data.demonstrations import Demonstrations
from trainers.pipeline.config import JobConfig
from trainers.pipeline.new_policy import new_policy
from trainers.utils.processes import keep_interrupts
from trainers.utils.progress import tracked

BASELINES = ("pooled", "paper_literal")
"""No task id; 34 + K numbers without command, phase and last action."""


def baseline_names(config: JobConfig) -> list[str]:
    """Those that differ from the policy itself."""
    if config.is_any_gait:
        return []  # there is no task id to be left out, and nothing else says which gait is asked for
    return [name for name in BASELINES if not (name == "paper_literal" and config.is_literal)]


def train_baselines(config: JobConfig, names: list[str], folder: Path, progress: bool = False) -> None:
    """Train baselines side by side, with as many gradient steps as the policy; each is saved as ``<name>.zip``.

    Args:
        config: of the job.
        names: of `BASELINES`.
        folder: holds ``all_rows.npz``, all rows that the policy learned from.
        progress: show a bar.
    """
    n_jobs = min(len(names), config.n_envs) if config.device == "cpu" else 1
    parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator_unordered")
    with keep_interrupts():
        results = parallel(
            joblib.delayed(_train_baseline)(config, name, folder, progress and n_jobs == 1) for name in names
        )
    for _ in tracked(results, "baselines", len(names), "network", progress):
        pass


def _train_baseline(config: JobConfig, name: str, folder: Path, progress: bool) -> None:
    torch.set_num_threads(config.threads)
    rows = Demonstrations.load(folder / "all_rows.npz")
    if name == "paper_literal":
        rows, policy = rows.select(), new_policy(config, config.literal_env_kwargs)
    else:
        policy = new_policy(config, config.env_kwargs, pooled=True)
    train_bc(policy, rows, config.baseline_bc, progress=progress)
    policy.save(folder / f"{name}.zip")
