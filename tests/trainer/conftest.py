import pytest
import torch
from stable_baselines3.common.vec_env import DummyVecEnv

from go1_mtl_gym import PAPER_TASKS
from tests.trainer.stub_env import StubEnv
from trainers import Demonstrations, MultiHeadPolicy, collect

torch.set_num_threads(1)


@pytest.fixture
def policy() -> MultiHeadPolicy:
    """A small untrained student, made the same way every time."""
    env = StubEnv()
    shape = {"width": 32, "n_tasks": len(env.tasks), "env_kwargs": {"control_hz": 50}}
    policy = MultiHeadPolicy(env.observation_space, env.action_space, seed=3, **shape)
    generator = torch.Generator().manual_seed(0)
    for head in policy.actor.heads:  # away from the small initial outputs, so that heads differ visibly
        torch.nn.init.normal_(head[-1].weight, generator=generator)
    return policy


@pytest.fixture
def student(policy: MultiHeadPolicy) -> MultiHeadPolicy:
    """The same, with all that a policy without a clock wants to know of it."""
    policy.env_kwargs |= {"tasks": PAPER_TASKS, "channels": ("command", "phase", "last_action")}
    return policy


@pytest.fixture
def venv() -> DummyVecEnv:
    """One stub environment per task."""
    return DummyVecEnv([lambda task=task: StubEnv(task) for task in StubEnv().tasks])


@pytest.fixture(scope="session")
def demos() -> Demonstrations:
    """Six perturbed episodes of the linear expert in each task."""
    from tests.trainer.stub_env import make_stub
    from trainers import PerturbationConfig

    parts = [
        collect(task, seed=seed, seconds=6.0, perturbation=PerturbationConfig(), make_env=make_stub)
        for task in StubEnv().tasks
        for seed in range(6)
    ]
    return Demonstrations.concatenate(parts)
