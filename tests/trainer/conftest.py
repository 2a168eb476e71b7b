import pytest
import torch
from stable_baselines3.common.vec_env import DummyVecEnv

from tests.trainer.stub_env import StubEnv
from trainers import Demonstrations, MultiHeadPolicy, collect

torch.set_num_threads(1)


@pytest.fixture
def policy() -> MultiHeadPolicy:
    """A small untrained student, made the same way every time."""
    env = StubEnv()
    policy = MultiHeadPolicy(env.observation_space, env.action_space, contract=env.contract, width=32, seed=3)
    generator = torch.Generator().manual_seed(0)
    for head in policy.actor.heads:  # away from the small initial outputs, so that heads differ visibly
        torch.nn.init.normal_(head[-1].weight, generator=generator)
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
