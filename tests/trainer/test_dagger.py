"""DAgger rounds on the stub: who drives, what is recorded, resuming."""

import numpy as np
import pytest
from imitation.algorithms import dagger as imitation_dagger
from stable_baselines3.common.vec_env import DummyVecEnv

from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import SIZE, StubEnv
from tests.trainer.test_collection import LAYOUT, expected_labels
from trainers import (
    BCConfig,
    BlockCollector,
    DAggerConfig,
    DAggerTrainer,
    ShardMismatchError,
    make_logger,
    offline_metrics,
)

SMALL = BCConfig(steps=20, batch_size=64, log_interval=10)


def drive(collector: BlockCollector) -> list[np.ndarray]:
    """Step with the environments' own experts until all have their rows; the executed actions."""
    obs = collector.reset()
    executed = []
    while not collector.finished:
        obs, *_ = collector.step(np.stack(collector.venv.env_method("expert_action")))
        executed.append(obs[:, LAYOUT["last_action"]])
    return executed


def make_collector(venv, rows, beta=0.5, learner=lambda obs: np.full((len(obs), 12), 0.1), **kwargs) -> BlockCollector:
    return BlockCollector(
        venv, learner, beta, "unused", np.random.default_rng(0), rows_per_env=rows, control_hz=50, **kwargs
    )


def test_blocks_are_long_and_both_drive():
    venv = DummyVecEnv([lambda: StubEnv(episode_s=100.0)])
    collector = make_collector(venv, 2000)
    learner_drove = np.array([np.allclose(a[0], 0.1) for a in drive(collector)])
    assert 0.3 < learner_drove.mean() < 0.7
    assert collector.learner_share == pytest.approx(learner_drove.mean(), abs=1e-3)
    changes = np.flatnonzero(np.diff(learner_drove.astype(int)))
    assert np.diff(changes).min() >= 15 and len(changes) > 10


@pytest.mark.parametrize(("beta", "share"), [(0.0, 1.0), (1.0, 0.0)])
def test_extremes_of_beta(beta, share):
    collector = make_collector(DummyVecEnv([StubEnv]), 100, beta)
    drive(collector)
    assert collector.learner_share == share


def test_labels_are_the_experts_whoever_drives(venv, demos, policy, tmp_path):
    trainer = DAggerTrainer(venv, policy, demos, DAggerConfig(seconds_per_task=4.0), SMALL, scratch_dir=tmp_path)
    rows = trainer.collect_round()
    assert {name: len(part) for name, part in rows.per_task().items()} == dict.fromkeys(demos.tasks, 200)
    trot = rows.per_task()["trot"]
    np.testing.assert_allclose(trot.acts, expected_labels(trot), atol=1e-5)
    followed = trot.obs[1:, LAYOUT["last_action"]][~trot.starts[1:]] - trot.acts[:-1][~trot.starts[1:]]
    assert 0.1 < np.isclose(followed, 0, atol=1e-5).all(1).mean() < 0.9


def test_finished_environments_are_not_recorded():
    venv = DummyVecEnv([StubEnv, lambda: StubEnv("walk")])
    driven = []

    def learner(obs):
        driven.append(obs[:, SIZE:].argmax(1))
        return np.zeros((len(obs), 12))

    collector = make_collector(venv, np.array([30, 90]), beta=0.0, learner=learner)
    drive(collector)
    recorded = collector.recorded()
    assert recorded["obs"][:, SIZE:].sum(0).tolist() == [30, 0, 0, 90]
    assert all(3 in tasks for tasks in driven) and sum(0 in tasks for tasks in driven) == 30


def test_end_before_a_fall_is_dropped_and_time_limits_are_not():
    falls = make_collector(DummyVecEnv([lambda: StubEnv(expert_falls_after_s=1.0)]), 60, beta=1.0)
    drive(falls)
    recorded = falls.recorded()
    assert np.flatnonzero(recorded["starts"]).tolist() == [0, 39] and recorded["acts"][:, 2].max() < 0.9
    limited = make_collector(DummyVecEnv([lambda: StubEnv(episode_s=0.4)]), 60, beta=1.0)
    drive(limited)
    assert np.flatnonzero(limited.recorded()["starts"]).tolist() == [0, 20, 40]


def test_learner_that_always_falls():
    from trainers.collector import StarvedCollectorError

    collector = make_collector(DummyVecEnv([StubEnv]), 100, beta=0.0, learner=lambda obs: np.ones((len(obs), 12)))
    with pytest.raises(StarvedCollectorError, match="kept"):
        drive(collector)


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
    with pytest.raises(ShardMismatchError, match="other settings"):
        DAggerTrainer(venv, policy, demos, DAggerConfig(beta=0.1), scratch_dir=tmp_path)


def test_training_without_collecting(venv, demos, policy, tmp_path):
    trainer = DAggerTrainer(venv, policy, demos, scratch_dir=tmp_path)
    with pytest.raises(imitation_dagger.NeedsDemosException):
        trainer.train_round()


@pytest.mark.parametrize("kwargs", [{"beta": 2}, {"seconds_per_task": 0}, {"block_s": (1, 0.5)}, {"seed": -1}])
def test_bad_configuration(kwargs):
    with pytest.raises(InvalidInputError):
        DAggerConfig(**kwargs)


def test_beta_decays():
    assert DAggerConfig(beta=0.5, beta_decay=0.5).beta_of(2) == 0.125
