"""What makes a step fast: rows known beforehand, and less precision for those who ask for it."""

import numpy as np
import pytest
import torch

from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import StubEnv
from tests.trainer.test_policy import observations
from trainers import BCConfig, BCTrainer, MultiHeadPolicy, MultiTaskLoss, TensorBatches
from trainers.algorithms.optimizer import matmul_precision
from trainers.data.batches import shuffled_by_numpy, shuffled_by_torch

TASKS = StubEnv().tasks
SORTED = [0, 0, 0, 1, 3, 3]
ROWS = (3, 1, 0, 2)
"""Of each task in `SORTED`."""


def student(**kwargs) -> MultiHeadPolicy:
    """A small untrained policy."""
    env = StubEnv()
    return MultiHeadPolicy(env.observation_space, env.action_space, n_tasks=4, width=32, seed=0, **kwargs)


def batch() -> tuple[torch.Tensor, torch.Tensor]:
    """Six rows in the order of `SORTED`."""
    acts = np.random.default_rng(0).normal(size=(len(SORTED), 12)).astype(np.float32)
    return torch.from_numpy(observations(SORTED)), torch.from_numpy(acts)


@pytest.mark.parametrize("space", ["radians", "normalized"])
@pytest.mark.parametrize("pooled", [False, True])
def test_known_rows_change_no_bit(space, pooled):
    results = []
    for rows in (None, ROWS):
        policy = student(pooled=pooled)
        metrics = MultiTaskLoss(TASKS, np.linspace(0.5, 1.6, 12), space, rows)(policy, *batch())
        metrics.loss.backward()
        gradients = [p.grad for p in policy.actor.parameters() if p.grad is not None]
        mse = {name: float(value) for name, value in vars(metrics).items() if name != "loss"}
        results.append((metrics.loss.detach(), gradients, mse))
    (loss, gradients, mse), (loss_known, gradients_known, mse_known) = results
    assert torch.equal(loss, loss_known) and mse == mse_known and len(mse) == 3
    assert len(gradients) == len(gradients_known) > 0
    assert all(torch.equal(a, b) for a, b in zip(gradients, gradients_known))


def test_a_step_with_known_rows_reads_nothing_back():
    """Tensors without values cannot be read: a step that runs on them never waits for a GPU."""
    policy = student().to("meta")
    obs, acts = (part.to("meta") for part in batch())
    loss = MultiTaskLoss(TASKS, np.ones(12), rows=ROWS)(policy, obs, acts).loss
    loss.backward()
    assert policy.actor.heads[3][-1].bias.grad.shape == (12,) and policy.actor.heads[2][-1].bias.grad is None
    with pytest.raises((RuntimeError, NotImplementedError)):
        MultiTaskLoss(TASKS, np.ones(12))(policy, obs, acts)


def test_a_sorted_batch_is_split_without_moving_rows(monkeypatch):
    policy, (obs, _) = student(), batch()
    shuffled = [4, 0, 3, 1, 5, 2]
    expected = policy.mean_actions(obs[shuffled])

    def refuse(*args, **kwargs):
        raise AssertionError("rows were sorted")

    monkeypatch.setattr(torch, "argsort", refuse)
    torch.testing.assert_close(policy.mean_actions(obs)[shuffled], expected, atol=1e-6, rtol=0)
    with pytest.raises(AssertionError, match="rows were sorted"):
        policy.mean_actions(obs[shuffled])


def test_rows_must_fit_tasks_and_batch():
    for rows in ((3, 1, 2), (3, 1, -1, 3)):
        with pytest.raises(InvalidInputError, match="rows must be 4 counts"):
            MultiTaskLoss(TASKS, np.ones(12), rows=rows)
    with pytest.raises(InvalidInputError, match=r"batch of 6 rows, \(3, 1, 0, 2\) per task; got 5"):
        MultiTaskLoss(TASKS, np.ones(12), rows=ROWS)(student(), *(part[1:] for part in batch()))


def test_batches_tell_the_rows_of_every_task(demos):
    batches = TensorBatches(demos.take(demos.task != 1), 32, seed=0)
    assert batches.rows == (11, 0, 11, 10)
    task = next(iter(batches))["obs"][:, -4:].argmax(1)
    assert tuple(torch.bincount(task, minlength=4).tolist()) == batches.rows


@pytest.mark.parametrize(
    "make", [shuffled_by_numpy, lambda seed: shuffled_by_torch(seed, torch.device("cpu"))], ids=["numpy", "torch"]
)
def test_shuffling_permutes_anew_and_repeats_for_a_seed(make):
    rows = torch.arange(0, 200, 2)
    one, other, third = make(3), make(3), make(4)
    first, second = one(rows), one(rows)
    assert torch.equal(first.sort().values, rows) and torch.equal(second.sort().values, rows)
    assert not torch.equal(first, second) and not torch.equal(first, third(rows)) and torch.equal(first, other(rows))
    assert torch.equal(rows, torch.arange(0, 200, 2)), "the rows themselves stay in order"


def test_matmul_precision_holds_while_training_only(demos):
    seen = []
    before = torch.get_float32_matmul_precision()
    config = BCConfig(steps=2, batch_size=64, matmul_precision="medium")
    trainer = BCTrainer(student(), config)
    trainer.fit(demos, on_batch_end=lambda: seen.append(torch.get_float32_matmul_precision()))
    assert seen == ["medium", "medium"] and torch.get_float32_matmul_precision() == before
    with pytest.raises(ZeroDivisionError):
        trainer.fit(demos, on_batch_end=lambda: 1 / 0)
    assert torch.get_float32_matmul_precision() == before


def test_matmul_precision_gives_back_whatever_was_there():
    with matmul_precision("high"):
        with matmul_precision("medium"):
            assert torch.get_float32_matmul_precision() == "medium"
        assert torch.get_float32_matmul_precision() == "high"


def fitted(demos, **kwargs) -> tuple[MultiHeadPolicy, float]:
    """A student after 200 steps, and its last loss."""
    policy = student()
    policy.fit_normalization(demos.obs, demos.acts)
    history = BCTrainer(policy, BCConfig(steps=200, batch_size=128, **kwargs)).fit(demos)
    return policy, history.loss[-1]


def test_autocast_computes_in_bfloat16_keeps_float32_weights_and_learns(demos):
    policy = student()
    dtypes = []
    policy.actor.trunk[2].register_forward_hook(lambda module, inputs, output: dtypes.append(output.dtype))
    BCTrainer(policy, BCConfig(steps=3, batch_size=64, autocast=True)).fit(demos)
    assert dtypes == [torch.bfloat16] * 3
    assert {p.dtype for p in policy.parameters()} == {torch.float32}
    (exact, loss), (rounded, loss_rounded) = fitted(demos), fitted(demos, autocast=True)
    assert loss_rounded == pytest.approx(loss, rel=0.5) and loss_rounded != loss
    obs = torch.from_numpy(demos.obs[:256])
    with torch.no_grad():
        difference = (exact.mean_actions(obs) - rounded.mean_actions(obs)).abs().max()
    assert 0 < float(difference) < 0.2


@pytest.mark.parametrize("kwargs", [{"matmul_precision": "low"}, {"matmul_precision": "tf32"}])
def test_bad_precision(kwargs):
    with pytest.raises(InvalidInputError, match="matmul_precision must be one of highest, high, medium"):
        BCConfig(**kwargs)
