"""A new gait for a trained student: what is copied, what is left alone to the bit, and what learns."""

import dataclasses

import numpy as np
import pytest
import torch

from go1_mtl_gym import PAPER_TASKS
from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import SIZE, StubEnv, make_stub
from trainers import (
    BCConfig,
    Demonstrations,
    MultiHeadPolicy,
    PhaseEstimator,
    PhaseFreePolicy,
    closest_task,
    collect,
    learn_task,
    load,
    offline_metrics,
)
from trainers.algorithms.add_task import trunk_features
from trainers.data.mirror import mirrored
from trainers.policies.phase_free import phase_free_layout

TASKS = (*PAPER_TASKS, "pace")
QUICK = BCConfig(steps=60, batch_size=128, learning_rate=5e-3, weight_decay=0.1, log_interval=30)


@pytest.fixture
def trained(policy, demos) -> MultiHeadPolicy:
    """A policy that sees its inputs and outputs normalized."""
    policy.fit_normalization(demos.obs, demos.acts)
    return policy


@pytest.fixture(scope="module")
def pace() -> Demonstrations:
    """A linear expert's pace, as an environment of this one task shows it."""
    kwargs = {"tasks": ("pace",)}
    return Demonstrations.concatenate(
        [collect("pace", None, seed, 4.0, env_kwargs=kwargs, make_env=make_stub) for seed in range(4)]
    )


def observations(tasks: list[int], n_tasks: int) -> np.ndarray:
    """Observations of the tasks given; equal but for the task id, whatever the number of tasks."""
    rows = np.random.default_rng(0).normal(size=(len(tasks), SIZE))
    return np.hstack([rows, np.eye(n_tasks)[tasks]]).astype(np.float32)


def weights(policy: MultiHeadPolicy) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in policy.state_dict().items()}


def changed(before: dict[str, torch.Tensor], policy: MultiHeadPolicy) -> set[str]:
    """Names of the tensors that are not equal to the bit."""
    return {name for name, value in policy.state_dict().items() if not torch.equal(before[name], value)}


# -- Growing -----------------------------------------------------------------------------------------------------------


def test_a_new_policy_knows_one_task_more_and_the_old_one_stays(trained):
    before = weights(trained)
    grown = trained.add_task("pace", seed=1)
    assert grown.env_kwargs == trained.env_kwargs | {"tasks": TASKS} and grown.n_tasks == 5
    assert trained.n_tasks == 4 and trained.env_kwargs["tasks"] == PAPER_TASKS and not changed(before, trained)
    assert grown.observation_space == StubEnv(tasks=TASKS).observation_space.__class__(
        np.append(trained.observation_space.low, 0.0).astype(np.float32),
        np.append(trained.observation_space.high, 1.0).astype(np.float32),
    )
    torch.nn.init.zeros_(grown.actor.trunk[0].weight)
    assert not changed(before, trained), "no weights are shared"


@pytest.mark.parametrize("tasks", [[0], [3], [0, 1, 2, 3], [2, 0, 3, 0], [1, 1, 1]])
def test_old_tasks_are_done_as_before_to_the_bit(trained, tasks):
    grown = trained.add_task("pace").add_task("gallop")
    old, new = observations(tasks, 4), observations(tasks, 6)
    expected = trained.predict(old, deterministic=True)[0]
    np.testing.assert_array_equal(grown.predict(new, deterministic=True)[0], expected)
    torch.testing.assert_close(
        grown.predict_values(torch.from_numpy(new)), trained.predict_values(torch.from_numpy(old))
    )
    assert torch.equal(grown.log_std, trained.log_std)


def test_the_new_head_is_near_the_mean_action_and_fixed_by_its_seed(trained):
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    first, again, other = (trained.add_task("pace", seed) for seed in (1, 1, 2))
    assert torch.equal(torch.rand(1), expected), "the global generator is left alone"
    assert not changed(weights(first), again)
    assert changed(weights(first), other) == {
        "actor.heads.4.0.weight",
        "actor.heads.4.0.bias",
        "actor.heads.4.2.weight",
    }
    means = first.mean_actions(torch.from_numpy(observations([4], 5)))
    assert (means - trained.act_normalizer.shift).abs().max() < 0.02


def test_a_new_head_can_begin_as_a_copy(trained):
    grown = trained.add_task("pace", like="jump")
    obs = observations([2, 4], 5)
    obs[1, :SIZE] = obs[0, :SIZE]
    jump, pace = (grown.predict(row, deterministic=True)[0] for row in obs)
    np.testing.assert_array_equal(pace, jump)
    torch.nn.init.zeros_(grown.actor.heads[4][-1].weight)
    np.testing.assert_array_equal(grown.predict(obs[0], deterministic=True)[0], jump, "it is no more than a copy")
    with pytest.raises(InvalidInputError, match="like must be one of 'trot'.*got 'pace'"):
        trained.add_task("pace", like="pace")


def test_the_closest_task_is_the_one_that_already_does_it(trained, pace):
    for k, name in enumerate(PAPER_TASKS):
        as_if = np.tile(np.eye(4, dtype=np.float32)[k], (len(pace), 1))
        acts = trained.predict(np.hstack([pace.obs[:, :-1], as_if]), deterministic=True)[0]
        assert closest_task(trained, dataclasses.replace(pace, acts=acts)) == name
    with pytest.raises(InvalidInputError, match="rows of the new task"):
        closest_task(trained, pace.take(np.zeros(0, dtype=int)))


def test_who_has_it_or_cannot_have_it_is_told(trained):
    with pytest.raises(InvalidInputError, match="does not have.*'pace'.*got 'trot'"):
        trained.add_task("trot")
    with pytest.raises(InvalidInputError, match="got 'crawl'"):
        trained.add_task("crawl")
    with pytest.raises(InvalidInputError, match="got 'pace'"):
        trained.add_task("pace").add_task("pace")
    env = StubEnv()
    pooled = MultiHeadPolicy(env.observation_space, env.action_space, contract=env.contract, pooled=True)
    with pytest.raises(InvalidInputError, match="pooled"):
        pooled.add_task("pace")
    unnamed = MultiHeadPolicy(env.observation_space, env.action_space, n_tasks=4)
    with pytest.raises(InvalidInputError, match="without one its tasks have no names"):
        unnamed.add_task("pace")


def test_a_grown_policy_is_saved_and_rebuilt(trained, tmp_path):
    grown = trained.add_task("pace", seed=3)
    grown.save(tmp_path / "grown.zip")
    rebuilt = MultiHeadPolicy(**grown._get_constructor_parameters())
    rebuilt.load_state_dict(grown.state_dict())
    obs = observations([4, 0, 4, 2], 5)
    for other in (load(tmp_path / "grown.zip"), rebuilt):
        np.testing.assert_array_equal(*(p.predict(obs, deterministic=True)[0] for p in (grown, other)))
        assert other.env_kwargs["tasks"] == TASKS


def test_without_a_clock_it_needs_an_estimator_of_the_new_tasks(trained):
    grown = trained.add_task("pace")
    with pytest.raises(InvalidInputError, match="pace"):
        PhaseFreePolicy(grown, PhaseEstimator(phase_free_layout(trained, 2), width=8))
    phase_free = PhaseFreePolicy(grown, PhaseEstimator(phase_free_layout(grown, 2), width=8, seed=0))
    env = StubEnv("pace", **phase_free.env_kwargs)
    action, state = phase_free.predict(env.reset(seed=0)[0], deterministic=True)
    assert action.shape == (12,) and state[1].tolist() == [4]


# -- Learning ----------------------------------------------------------------------------------------------------------


def test_alone_the_new_head_learns_and_nothing_else_moves(trained, pace):
    grown = trained.add_task("pace")
    before, r2 = weights(grown), offline_metrics(grown, pace.with_tasks(TASKS))["pace"]["r2"]
    history = learn_task(grown, pace, QUICK, validation=pace)
    assert changed(before, grown) == {
        f"actor.heads.4.{layer}.{kind}" for layer in (0, 2) for kind in ("weight", "bias")
    }
    assert history.r2["pace"][-1] > 0.8 > r2
    own = offline_metrics(grown, pace.with_tasks(TASKS))["pace"]["r2"]
    assert own == pytest.approx(history.r2["pace"][-1], abs=1e-5), "what was trained is what drives"
    obs = observations([0, 3, 1, 2], 4)
    np.testing.assert_array_equal(
        grown.predict(observations([0, 3, 1, 2], 5), deterministic=True)[0], trained.predict(obs, deterministic=True)[0]
    )


def test_the_new_head_learns_from_the_mirror_too(trained, pace):
    """Rows that all step from the left; in the mirror they step from the right."""
    one_sided = pace.take(pace.obs[:, pace.contract.slices["command"]][:, 1] > 0.0)
    errors = []
    for mirror in (False, True):
        grown = trained.add_task("pace", seed=2)
        before = weights(grown)
        learn_task(grown, one_sided, dataclasses.replace(QUICK, mirror=mirror))
        image = mirrored(one_sided).with_tasks(TASKS)
        errors.append(offline_metrics(grown, image)["pace"]["mse"])
        assert all(name.startswith("actor.heads.4.") for name in changed(before, grown))
    assert errors[1] < 0.8 * errors[0]


def test_old_gaits_are_rehearsed_in_the_mirror_too(trained, pace, demos):
    losses = []
    for mirror in (False, True):
        grown = trained.add_task("pace")
        history = learn_task(grown, pace, dataclasses.replace(QUICK, mirror=mirror), rehearsal=demos)
        assert set(history.mse) == set(TASKS)
        losses.append(history.loss[-1])
    assert losses[0] != losses[1]


def test_with_rehearsal_all_learn_and_old_tasks_are_kept(trained, pace, demos):
    grown = trained.add_task("pace")
    before = weights(grown)
    history = learn_task(grown, pace, QUICK, validation=demos, rehearsal=demos)
    moved = changed(before, grown)
    assert {"actor.trunk.0.weight", "actor.heads.0.2.weight", "actor.heads.4.2.weight"} <= moved
    assert not any(name.startswith(("obs_normalizer", "act_normalizer", "critic", "log_std")) for name in moved)
    assert set(history.mse) == set(TASKS) and set(history.r2) == set(PAPER_TASKS)
    assert all(values[-1] > 0.9 for values in history.r2.values())


def test_equal_seeds_teach_equal_heads(trained, pace):
    heads = []
    for seed in (0, 0, 1):
        grown = trained.add_task("pace")
        learn_task(grown, pace, dataclasses.replace(QUICK, steps=5, seed=seed))
        heads.append(grown.state_dict()["actor.heads.4.2.weight"].clone())
    assert torch.equal(heads[0], heads[1]) and not torch.equal(heads[0], heads[2])


def test_features_are_what_the_heads_see(trained, pace):
    grown = trained.add_task("pace")
    features = trunk_features(grown, pace)
    assert features.obs.shape == (len(pace), 32 + 5) and features.tasks == TASKS
    rows = torch.from_numpy(features.obs[:, :-5])
    actions = grown.act_normalizer.inverse(grown.actor.heads[4](rows))
    torch.testing.assert_close(actions, grown.mean_actions(torch.from_numpy(pace.with_tasks(TASKS).obs)))


def test_rows_that_do_not_fit_are_refused(trained, pace):
    grown = trained.add_task("pace")
    with pytest.raises(InvalidInputError, match="hold .*pace"):
        learn_task(trained, pace, QUICK)
    with pytest.raises(InvalidInputError, match="the policy and the demonstrations do not belong.*terms"):
        learn_task(grown, pace.select(), QUICK)
    faster = dataclasses.replace(pace, contract=dataclasses.replace(pace.contract, control_hz=100))
    for use in (lambda: learn_task(grown, faster, QUICK), lambda: closest_task(trained, faster)):
        with pytest.raises(InvalidInputError, match="control_hz: 50 against 100"):
            use()
    with pytest.raises(InvalidInputError, match="0 rows"):
        learn_task(grown, pace.take(np.zeros(0, dtype=int)), QUICK)


# -- Task ids ----------------------------------------------------------------------------------------------------------


def test_task_ids_are_moved_to_the_places_of_other_tasks(demos):
    kwargs = {"tasks": ("walk", "trot")}
    rows = Demonstrations.concatenate(
        [collect(t, None, 0, 0.1, env_kwargs=kwargs, make_env=make_stub) for t in kwargs["tasks"]]
    )
    other = rows.with_tasks(("trot", "pace", "walk"))
    assert other.task.tolist() == [2] * 5 + [0] * 5 and other.tasks == ("trot", "pace", "walk")
    np.testing.assert_array_equal(other.obs[:, -3:].sum(1), 1.0)
    np.testing.assert_array_equal(other.obs[:, :-3], rows.obs[:, :-2])
    np.testing.assert_array_equal(other.with_tasks(rows.tasks).obs, rows.obs)
    assert other.per_task()["walk"].with_tasks(("walk",)).obs[:, -1].tolist() == [1.0] * 5


@pytest.mark.parametrize("tasks", [("trot",), (), ("trot", "bound", "jump", "walk", "walk"), ("pace", "gallop")])
def test_task_ids_cannot_lose_a_rows_task_or_repeat_one(demos, tasks):
    with pytest.raises(InvalidInputError, match="tasks must differ"):
        demos.with_tasks(tasks)
