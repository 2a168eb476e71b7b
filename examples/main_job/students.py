"""The students of the main job: making one, and training the two baselines in processes of their own."""

import dataclasses
from pathlib import Path
from typing import Any

import torch

import trainers
from go1_mtl_gym import InvalidInputError
from main_job.config import JobConfig


def new_policy(config: JobConfig, env_kwargs: dict[str, Any], pooled: bool = False) -> trainers.MultiHeadPolicy:
    """An untrained student for the environments that `env_kwargs` describe.

    Raises:
        InvalidInputError: if there can be no such environment or student, or the device is not there.
    """
    check_device(config.device)
    env = trainers.make_env(config.tasks[0], **env_kwargs)
    policy = trainers.MultiHeadPolicy(
        env.observation_space,
        env.action_space,
        width=config.width,
        n_tasks=len(config.tasks),
        pooled=pooled,
        normalization=config.normalization,
        env_kwargs=env_kwargs,
        seed=config.seed,
    )
    env.close()
    return policy.to(torch.device(config.device))


def check_device(device: str) -> str:
    """Return the name of a device that can be trained on.

    Raises:
        InvalidInputError: if it is neither the CPU nor a GPU that is there.
    """
    if device != "cpu" and not (device.startswith("cuda") and torch.cuda.is_available()):
        raise InvalidInputError(f"device must be cpu, or cuda where PyTorch finds a GPU; got {device!r}")
    return device


def train_baseline(config: JobConfig, name: str, out: Path, progress: bool) -> None:
    """Train "pooled" or "paper_literal" on all rows of a run and save it there.

    Args:
        config: of the run.
        name: which baseline.
        out: folder of the run.
        progress: show a bar.
    """
    torch.set_num_threads(config.threads)
    rows = trainers.Demonstrations.load(out / "parts" / "all_rows.npz")
    literal = name == "paper_literal"
    policy = new_policy(config, config.literal_env_kwargs if literal else config.env_kwargs, pooled=name == "pooled")
    steps = config.clone_steps + config.rounds * config.round_steps
    own = rows.proprioceptive() if literal else rows
    trainers.train_bc(policy, own, dataclasses.replace(config.bc, steps=steps), progress=progress)
    policy.save(out / "parts" / f"{name}.zip")
