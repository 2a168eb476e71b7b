"""Batches and behaviour cloning."""

import numpy as np
import pytest
import torch
from imitation.algorithms import bc as imitation_bc

from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import StubEnv
from trainers import BCConfig, BCTrainer, MultiHeadPolicy, TensorBatches, make_logger, offline_metrics, train_bc


def student(**kwargs) -> MultiHeadPolicy:
    """A small untrained policy."""
    env = StubEnv()
    return MultiHeadPolicy(env.observation_space, env.action_space, n_tasks=4, width=32, seed=0, **kwargs)


def test_batches_are_balanced_sorted_and_cover_all_rows(demos):
    few = demos.take((demos.task != 2) | (np.arange(len(demos)) % 10 == 0))  # a task with a tenth of the rows
    batches = TensorBatches(few, 43, seed=0)
    seen = set()
    rows = list(batches)
    assert len(rows) == len(batches) == len(few) // 43
    for batch in rows:
        task = batch["obs"][:, -4:].argmax(1)
        assert bool((task[1:] >= task[:-1]).all())
        assert torch.bincount(task).tolist() == [11, 11, 11, 10]
        seen |= {tuple(row.tolist()) for row in batch["acts"][task == 2]}
    assert len(seen) == len(np.unique(few.acts[few.task == 2], axis=0))


def test_pairs_stay_together(demos):
    known = {tuple(o): tuple(a) for o, a in zip(demos.obs.tolist(), demos.acts.tolist())}
    batch = next(iter(TensorBatches(demos, 64, seed=1)))
    assert all(known[tuple(o)] == tuple(a) for o, a in zip(batch["obs"].tolist(), batch["acts"].tolist()))


def test_batches_differ_between_passes_and_repeat_for_a_seed(demos):
    one, other = TensorBatches(demos, 64, seed=5), TensorBatches(demos, 64, seed=5)
    first, again = next(iter(one))["acts"], next(iter(other))["acts"]
    assert torch.equal(first, again)
    assert not torch.equal(next(iter(one))["acts"], first)


def test_rows_are_drawn_as_often_as_they_weigh(demos):
    few = demos.take(np.concatenate([np.flatnonzero(demos.task == k)[:12] for k in range(4)]))
    weights = np.where(np.arange(48) % 12 < 4, 3, 1)  # per task: 4 rows of weight 3 and 8 of weight 1 are 20 draws
    batches = TensorBatches(few, 16, seed=0, weights=weights)
    drawn = [batch["obs"] for _ in range(5) for batch in batches]  # 15 batches of 4 rows per task: 3 passes
    rows = {tuple(row): i for i, row in enumerate(few.obs.tolist())}
    count = np.bincount([rows[tuple(row)] for batch in drawn for row in batch.tolist()], minlength=48)
    assert count.tolist() == (3 * weights).tolist()


def test_weights_of_one_change_nothing(demos):
    plain, weighted = TensorBatches(demos, 64, seed=5), TensorBatches(demos, 64, 5, weights=np.ones(len(demos), int))
    assert all(torch.equal(a["obs"], b["obs"]) for a, b in zip(plain, weighted))


def test_cloning_by_weights(demos):
    weights = np.where(demos.acts[:, 0] > 0, 9, 1)
    policies = [student() for _ in range(3)]
    for policy, chosen in zip(policies, (None, np.ones(len(demos), int), weights)):
        BCTrainer(policy, BCConfig(steps=20, batch_size=64)).fit(demos, weights=chosen)
    first = [next(policy.actor.parameters()) for policy in policies]
    assert torch.equal(first[0], first[1]) and not torch.equal(first[0], first[2])


@pytest.mark.parametrize("change", [lambda w: w[1:], lambda w: w * 0.5, lambda w: w * 0, lambda w: w[:, None]])
def test_bad_weights(demos, change):
    with pytest.raises(InvalidInputError, match="weights must be"):
        TensorBatches(demos, 64, seed=0, weights=change(np.ones(len(demos), int)))


def test_batch_larger_than_the_data(demos):
    with pytest.raises(InvalidInputError, match="batch_size"):
        TensorBatches(demos, len(demos) + 1, seed=0)


@pytest.mark.parametrize("space", ["radians", "normalized"])
def test_cloning_a_linear_expert(demos, space):
    policy = student()
    train, held_out = demos.split(0.2, seed=0)
    history = train_bc(policy, train, BCConfig(steps=500, batch_size=256, space=space, log_interval=100), held_out)
    assert history.steps == [100, 200, 300, 400, 500]
    scores = offline_metrics(policy, held_out)
    assert all(s["r2"] > 0.95 for s in scores.values()), scores
    assert history.r2["trot"][-1] == pytest.approx(scores["trot"]["r2"], abs=1e-6)
    assert history.loss[-1] < history.loss[0]


def test_cloning_is_deterministic_and_leaves_the_rest_alone(demos):
    results = []
    for _ in range(2):
        policy = student().train(True)
        critic = [p.clone() for p in policy.critic.parameters()]
        calls = []
        train_bc(policy, demos, BCConfig(steps=20, batch_size=64), on_batch_end=lambda calls=calls: calls.append(1))
        assert len(calls) == 20 and policy.training
        assert all(torch.equal(a, b) for a, b in zip(critic, policy.critic.parameters()))
        results.append(policy.state_dict())
    assert all(torch.equal(a, b) for a, b in zip(results[0].values(), results[1].values()))
    other = student()
    train_bc(other, demos, BCConfig(steps=20, batch_size=64, seed=1))
    assert not torch.equal(next(other.actor.parameters()), next(policy.actor.parameters()))


def test_weight_average(demos):
    plain, averaged = student(), student()
    train_bc(plain, demos, BCConfig(steps=40, batch_size=64))
    train_bc(averaged, demos, BCConfig(steps=40, batch_size=64, ema_decay=0.99))
    weights = next(plain.actor.parameters()), next(averaged.actor.parameters())
    assert not torch.equal(*weights)
    assert float((weights[0] - weights[1]).detach().abs().max()) < 0.1


def test_gradients_are_clipped(demos):
    trainer = BCTrainer(student(), BCConfig(steps=1, batch_size=64, max_grad_norm=1e-3))
    norms = []
    original = torch.nn.utils.clip_grad_norm_
    trainer.policy.fit_normalization(demos.obs, demos.acts)

    def spy(weights, limit):
        norms.append((float(original(weights, limit)), float(sum((w.grad**2).sum() for w in weights)) ** 0.5))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(torch.nn.utils, "clip_grad_norm_", spy)
        trainer.fit(demos)
    before, after = norms[0]
    assert before > 1e-3 and after == pytest.approx(1e-3, rel=1e-3)


def test_is_imitations_trainer_and_logs_to_tensorboard(demos, tmp_path):
    trainer = BCTrainer(student(), BCConfig(steps=6, batch_size=64, log_interval=2), make_logger(tmp_path, ("json",)))
    assert isinstance(trainer, imitation_bc.BC)
    trainer.fit(demos, demos)
    trainer.fit(demos)
    lines = (tmp_path / "progress.json").read_text().splitlines()
    assert len(lines) == 6 and trainer.steps_done == 12
    assert '"bc/mse/walk"' in lines[0] and '"held_out/r2/trot"' in lines[0]


def test_fixed_normalisation_is_kept(demos):
    policy = student()
    train_bc(policy, demos, BCConfig(steps=2, batch_size=64), fit_normalization=False)
    assert torch.equal(policy.obs_normalizer.scale, torch.ones_like(policy.obs_normalizer.scale))


@pytest.mark.parametrize(
    "kwargs", [{"steps": 0}, {"learning_rate": -1.0}, {"warmup": 1.0}, {"ema_decay": 1.0}, {"space": "m"}]
)
def test_bad_configuration(kwargs):
    with pytest.raises(InvalidInputError):
        BCConfig(**kwargs)
