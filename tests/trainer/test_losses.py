"""The loss, against numbers worked by hand."""

import numpy as np
import pytest
import torch

from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import StubEnv
from tests.trainer.test_policy import observations
from trainers import MultiTaskLoss

TASKS = StubEnv().tasks


def constant_policy(policy, value: float):
    """Make every head answer `value` on every joint."""
    for head in policy.actor.heads:
        torch.nn.init.zeros_(head[-1].weight)
        torch.nn.init.constant_(head[-1].bias, value)
    return policy


def test_sum_over_tasks_of_mean_squares_in_radians(policy):
    constant_policy(policy, 0.0)
    obs = torch.from_numpy(observations([1, 0, 0, 1, 0]))
    acts = torch.zeros(5, 12)
    acts[0], acts[1, 0] = 0.1, 0.6  # task 1: every joint of one of two rows; task 0: one joint of one of three rows
    half_range = np.full(12, 2.0)
    metrics = MultiTaskLoss(TASKS, half_range)(policy, obs, acts)
    assert float(metrics.mse_bound) == pytest.approx((0.2**2) / 2, rel=1e-5)
    assert float(metrics.mse_trot) == pytest.approx((1.2**2) / 12 / 3, rel=1e-5)
    assert float(metrics.loss.detach()) == pytest.approx(0.02 + 0.04, rel=1e-5)
    assert not hasattr(metrics, "mse_jump")


def test_normalised_space_divides_by_the_action_scale(policy):
    constant_policy(policy, 0.0)
    policy.act_normalizer.set(np.zeros(12), np.full(12, 0.5))
    acts = torch.full((2, 12), 0.1)
    metrics = MultiTaskLoss(TASKS, np.full(12, 2.0), "normalized")(policy, torch.from_numpy(observations([0, 0])), acts)
    assert float(metrics.loss.detach()) == pytest.approx(0.2**2, rel=1e-5)
    assert float(metrics.mse_trot) == pytest.approx(0.2**2, rel=1e-5)


def test_gradient_is_that_of_the_loss(policy):
    obs = torch.from_numpy(observations([0, 1, 2, 3]))
    loss = MultiTaskLoss(TASKS, np.linspace(0.5, 1.6, 12))
    bias = policy.actor.heads[2][-1].bias
    loss(policy, obs, torch.zeros(4, 12)).loss.backward()
    step = 1e-2
    values = []
    with torch.no_grad():
        for sign in (1, -1):
            bias[4] += sign * step
            values.append(float(loss(policy, obs, torch.zeros(4, 12)).loss))
            bias[4] -= sign * step
    assert (values[0] - values[1]) / (2 * step) == pytest.approx(float(bias.grad[4]), rel=1e-2)


def test_order_of_rows_does_not_matter(policy):
    obs, acts = observations([3, 1, 0, 1, 2]), np.random.default_rng(0).normal(size=(5, 12)).astype(np.float32)
    loss = MultiTaskLoss(TASKS, np.ones(12))
    order = [4, 2, 0, 1, 3]
    one = loss(policy, torch.from_numpy(obs), torch.from_numpy(acts)).loss
    other = loss(policy, torch.from_numpy(obs[order]), torch.from_numpy(acts[order])).loss
    assert float(one.detach()) == pytest.approx(float(other.detach()), rel=1e-5)


def test_bad_arguments():
    with pytest.raises(InvalidInputError, match="space"):
        MultiTaskLoss(TASKS, np.ones(12), "degrees")
    with pytest.raises(InvalidInputError, match="half_range"):
        MultiTaskLoss(TASKS, np.zeros(12))
