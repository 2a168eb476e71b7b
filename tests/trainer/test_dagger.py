"""DAgger rounds on the stub: labels, aggregation, notes, resuming."""

import dataclasses
import json

import numpy as np
import pytest
from imitation.algorithms import dagger as imitation_dagger
from stable_baselines3.common.vec_env import DummyVecEnv

from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import StubEnv
from tests.trainer.test_collection import LAYOUT, trot_labels
from trainers import (
    BCConfig,
    DAggerConfig,
    DAggerTrainer,
    MultiHeadPolicy,
    ShardMismatchError,
    TensorBatches,
    make_logger,
    offline_metrics,
)

SMALL = BCConfig(steps=20, batch_size=64, log_interval=10)


def test_labels_are_the_experts_whoever_drives(venv, demos, policy, tmp_path):
    trainer = DAggerTrainer(venv, policy, demos, DAggerConfig(seconds_per_task=4.0), SMALL, scratch_dir=tmp_path)
    rows = trainer.collect_round()
    assert {name: len(part) for name, part in rows.per_task().items()} == dict.fromkeys(demos.tasks, 200)
    trot = rows.per_task()["trot"]
    np.testing.assert_allclose(trot.acts, trot_labels(trot.obs), atol=1e-5)
    followed = trot.obs[1:, LAYOUT["last_action"]][~trot.starts[1:]] - trot.acts[:-1][~trot.starts[1:]]
    assert 0.1 < np.isclose(followed, 0, atol=1e-5).all(1).mean() < 0.9


def test_rounds_aggregate_train_and_log(venv, demos, policy, tmp_path):
    policy.fit_normalization(demos.obs, demos.acts)
    before = offline_metrics(policy, demos)["trot"]["mse"]
    logger = make_logger(tmp_path / "log", ("json",))
    trainer = DAggerTrainer(
        venv, policy, demos, DAggerConfig(seconds_per_task=2.0), SMALL, scratch_dir=tmp_path / "dagger", logger=logger
    )
    assert isinstance(trainer, imitation_dagger.DAggerTrainer)
    seen = []
    trained = trainer.run(2, callback=lambda t, done: seen.append((done, t.bc_trainer.steps_done)))
    assert trained is policy and seen == [(1, 20), (2, 40)]
    assert offline_metrics(policy, demos)["trot"]["mse"] < before
    log = (tmp_path / "log" / "progress.json").read_text()
    assert all(f'"dagger/rows": {len(demos) + new}' in log for new in (400, 800))


def test_falls_and_takeovers_are_noted_and_resuming_does_not_mind(venv, demos, policy, tmp_path):
    def trainer(limit, folder, **kwargs):
        config = DAggerConfig(seconds_per_task=1.0, takeover_rad=limit)
        return DAggerTrainer(venv, policy, demos, config, SMALL, scratch_dir=tmp_path / folder, **kwargs)

    free, logger = trainer(None, "free").collect_round(), make_logger(tmp_path / "log", ("json",))
    safe = trainer(1e-6, "safe", logger=logger).collect_round()
    logger.dump(0)
    assert free.meta["takeovers"] == 0 and free.meta["falls"] > 0
    assert safe.meta["takeovers"] > 0 and safe.meta["falls"] == 0
    log = json.loads((tmp_path / "log" / "progress.json").read_text())
    assert (
        log["dagger/takeovers"] == safe.meta["takeovers"] and log["dagger/falls"] == log["dagger/learner_fraction"] == 0
    )
    again = trainer(1e-6, "safe").collect_round()
    np.testing.assert_array_equal(again.obs, safe.obs)
    assert again.meta == safe.meta
    with pytest.raises(ShardMismatchError, match="now asked for"):
        trainer(1e-6, "safe").collect_round(seconds_per_task=2.0)


def test_rows_of_rounds_weigh_more(venv, demos, policy, tmp_path):
    config = DAggerConfig(seconds_per_task=1.0, round_weight=5)
    trainer = DAggerTrainer(venv, policy, demos, config, SMALL, scratch_dir=tmp_path)
    trainer.collect_round()
    with pytest.MonkeyPatch.context() as patch:
        given = []
        patch.setattr("trainers.algorithms.bc.TensorBatches", lambda *args: given.append(args) or TensorBatches(*args))
        trainer.train_round()
    data, weights = given[0][0], given[0][-1]
    assert len(data) == len(weights) == len(demos) + 200
    assert set(weights[: len(demos)]) == {1} and set(weights[len(demos) :]) == {5}


def test_resume_reuses_finished_parts(demos, policy, tmp_path):
    import copy

    def fresh():
        venv = DummyVecEnv([lambda task=task: StubEnv(task) for task in demos.tasks])
        student = copy.deepcopy(policy)
        config = DAggerConfig(seconds_per_task=1.0)
        return venv, DAggerTrainer(venv, student, demos, config, SMALL, scratch_dir=tmp_path)

    _, trainer = fresh()
    trainer.run(2)
    (tmp_path / "policy-001.zip").unlink()
    (tmp_path / "demos" / "round-001" / "demonstrations.npz").write_bytes(b"half")
    venv, again = fresh()
    again.collect_round()
    assert sum(env.asked for env in venv.envs) == 0 and again.train_round() is None
    again.run(2)
    assert sum(env.asked for env in venv.envs) == 4 * 50
    obs = demos.obs[:50]
    one, other = (t.policy.predict(obs, deterministic=True)[0] for t in (trainer, again))
    np.testing.assert_array_equal(one, other)


def test_folder_of_other_settings(venv, demos, policy, tmp_path):
    DAggerTrainer(venv, policy, demos, scratch_dir=tmp_path)
    for other in ({"beta": 0.1}, {"takeover_rad": 0.1}, {"round_weight": 2}):
        with pytest.raises(ShardMismatchError, match="made with another config;"):
            DAggerTrainer(venv, policy, demos, DAggerConfig(**other), scratch_dir=tmp_path)


def test_folder_of_another_base_of_equal_length(venv, demos, policy, tmp_path):
    DAggerTrainer(venv, policy, demos, scratch_dir=tmp_path)
    other = dataclasses.replace(demos, acts=demos.acts[::-1])
    with pytest.raises(ShardMismatchError, match="made with another base;"):
        DAggerTrainer(venv, policy, other, scratch_dir=tmp_path)


def test_other_environments_than_the_bases(demos, policy, tmp_path):
    venv = DummyVecEnv([lambda: StubEnv("trot", control_hz=100)])
    with pytest.raises(InvalidInputError, match="the base and the environments do not.*control_hz: 50 against 100"):
        DAggerTrainer(venv, policy, demos, scratch_dir=tmp_path)
    assert not list(tmp_path.iterdir())


def test_another_policy_than_the_bases(venv, demos, tmp_path):
    for kwargs, message in ({"control_hz": 100}, "control_hz"), ({"tasks": demos.tasks[::-1]}, "tasks"):
        env = StubEnv(**kwargs)
        other = MultiHeadPolicy(env.observation_space, env.action_space, contract=env.contract, width=8)
        with pytest.raises(InvalidInputError, match=message):
            DAggerTrainer(venv, other, demos, scratch_dir=tmp_path)


def test_folder_from_before_an_option_was_there(venv, demos, policy, tmp_path):
    DAggerTrainer(venv, policy, demos, scratch_dir=tmp_path)
    path = tmp_path / "config.json"
    settings = json.loads(path.read_text())
    del settings["config"]["takeover_rad"], settings["config"]["round_weight"]
    del settings["bc_config"]["matmul_precision"], settings["bc_config"]["autocast"]
    path.write_text(json.dumps(settings))
    DAggerTrainer(venv, policy, demos, scratch_dir=tmp_path)
    with pytest.raises(ShardMismatchError, match="another config"):
        DAggerTrainer(venv, policy, demos, DAggerConfig(round_weight=2), scratch_dir=tmp_path)
    with pytest.raises(ShardMismatchError, match="another bc_config"):
        DAggerTrainer(venv, policy, demos, bc_config=BCConfig(autocast=True), scratch_dir=tmp_path)


def test_training_without_collecting(venv, demos, policy, tmp_path):
    trainer = DAggerTrainer(venv, policy, demos, scratch_dir=tmp_path)
    with pytest.raises(imitation_dagger.NeedsDemosException):
        trainer.train_round()


@pytest.mark.parametrize(
    "kwargs",
    [
        {"beta": 2},
        {"seconds_per_task": 0},
        {"block_s": (1, 0.5)},
        {"seed": -1},
        {"takeover_rad": 0.0},
        {"round_weight": 0},
        {"round_weight": 1.5},
    ],
)
def test_bad_configuration(kwargs):
    with pytest.raises(InvalidInputError):
        DAggerConfig(**kwargs)


def test_beta_decays():
    assert DAggerConfig(beta=0.5, beta_decay=0.5).beta_of(2) == 0.125
