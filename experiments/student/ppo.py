"""PPO that goes on from the trained policy: what it gains with care, and what it forgets without."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

import trainers
from experiments import plots
from experiments.agents import STUDENT, Agent, shipped
from experiments.results import Group, Results
from experiments.student.episodes import counts
from experiments.study import Cell, Metrics, Study, digest, sources
from experiments.tables import mean, share
from experiments.training_runs import TrainedPolicy
from trainers.algorithms.optimizer import torch_threads
from trainers.data.environments import derive_seed
from trainers.policies.pretrained import FOLDER

CAREFUL, PLAIN = "ppo_from_policy", "PPO as it comes"
DRAWN = "drawn commands"
PLAIN_LOG_STD = -1.0
"""Of 0.1's policies: noise of about a radian on the joint targets."""


@dataclass(frozen=True)
class PPOOptions:
    """How long PPO goes on, and the episodes it is measured in.

    Attributes:
        steps: of all environments together.
        per_task: environments of every gait.
        training_seeds: of PPO.
        episodes: per gait, training seed and method.
        seconds: duration of each [s].
    """

    steps: int = 100_000
    per_task: int = 2
    training_seeds: tuple[int, ...] = (0, 1, 2)
    episodes: int = 20
    seconds: float = 10.0


@dataclass(frozen=True)
class PPORun:
    """One PPO that begins as the policy of the package, in environments of all its gaits.

    Attributes:
        method: `CAREFUL`, or `PLAIN`: stable-baselines3's settings, and the exploration of version 0.1.
        seed: of everything random.
        options: how long.
        root: of the policies' files.
    """

    method: str
    seed: int
    options: PPOOptions
    root: Path

    @property
    def policy(self) -> Path:
        """File of the policy that comes out."""
        start = (FOLDER / "clocked.zip").read_bytes().hex()
        code = sources("trainers.algorithms.ppo")
        name = digest([self.method, str(self.options.steps), str(self.options.per_task), start, code])
        return self.root / f"{name}-seed-{self.seed}.zip"

    def make(self) -> float:
        """Learn, unless that was done before; returns 0: no time is published."""
        if not self.policy.is_file():
            policy = trainers.load_pretrained()
            venv = trainers.make_venv(policy.tasks, self.options.per_task, policy.env_kwargs)
            with torch_threads(1):
                model = self._begin(policy, venv)
                model.learn(self.options.steps)
            model.policy.save(self.policy)
        return 0.0

    def _begin(self, policy: Any, venv: VecEnv) -> PPO:
        if self.method == CAREFUL:
            return trainers.ppo_from_policy(policy, venv, seed=self.seed)
        model = PPO(trainers.MultiHeadPolicy, venv, policy_kwargs=policy.network_kwargs(), seed=self.seed, device="cpu")
        model.policy.load_state_dict(policy.state_dict())
        model.policy.log_std.data.fill_(PLAIN_LOG_STD)
        return model


class ReinforcementLearning(Study):
    """The policy of the package before and after PPO, with our way to begin and with PPO as it comes."""

    name = "student_ppo"
    title = "Reinforcement learning from the trained policy"
    note = (
        "Successful episodes on drawn commands, velocity error and mean reward per step, before and after PPO on the "
        "environments' reward, all gaits in one run. The largest reward that a step can have is 2. "
        f"`{CAREFUL}` is `trainers.ppo_from_policy` with its defaults; the other has stable-baselines3's settings and "
        "begins with the exploration that policies of version 0.1 had. Time is counted for the measurements alone."
    )
    caption = "Success, velocity error and reward before and after PPO"
    rows = {"task": "gait", "agent": ""}
    columns = {
        "success": share(),
        "velocity error [m/s]": mean("velocity_error", ".3f"),
        "reward per step": mean("reward", ".3f"),
    }
    full = PPOOptions()
    quick = PPOOptions(steps=64, per_task=1, training_seeds=(0,), episodes=1, seconds=2.0)

    def agents(self) -> list[Agent]:
        runs = [
            PPORun(method, seed, self.options, self.cache / "ppo")
            for method in (CAREFUL, PLAIN)
            for seed in self.options.training_seeds
        ]
        refined = [TrainedPolicy(run.method, run.seed, path=run.policy, run=run) for run in runs]
        return [shipped(STUDENT, "clocked"), *refined]

    def cells(self, agent: Agent) -> list[Cell]:
        return [Cell(task, DRAWN) for task in trainers.load_pretrained().tasks]

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        """Counts of episodes, and the reward of as many others."""
        policy, options = agent.load(), self.options
        result = trainers.evaluate(policy, cell.task, options.episodes, options.seconds, seed)
        return counts(result) | {"reward": mean_reward(policy, cell.task, options.episodes, options.seconds, seed)}

    def figure(self, results: Results) -> Figure:
        metrics = {
            "success": Group.rate,
            "velocity error [m/s]": lambda members: members.mean("velocity_error"),
            "reward per step": lambda members: members.mean("reward"),
        }
        return plots.dots(
            {name: plots.panel(results.records, "agent", "task", metric) for name, metric in metrics.items()}
        )


def mean_reward(policy: Any, task: str, episodes: int, seconds: float, seed: int) -> float:
    """Mean over episodes of the reward per step, 0 for the steps after a fall."""
    env = policy.make_env(task, episode_s=seconds)
    steps = env.unwrapped.config.episode_steps
    totals = []
    for i in range(episodes):
        obs, _ = env.reset(seed=derive_seed("reward", task, seed, i))
        total, over = 0.0, False
        while not over:
            obs, reward, terminated, truncated, _ = env.step(policy.predict(obs, deterministic=True)[0])
            total, over = total + float(reward), terminated or truncated
        totals.append(total / steps)
    env.close()
    return float(np.mean(totals))
