"""Hands, demonstrations and the main job where the gait can be any."""

import numpy as np
import pytest

import trainers
from go1_mtl_gym import NAMED_GAITS, InvalidInputError
from go1_mtl_gym.env_config import ANY_GAIT_CHANNELS
from go1_mtl_gym.tasks import ANY_GAIT, any_gait_task
from trainers.data.environments import base_env
from trainers.data.operator_wrapper import OperatorWrapper
from trainers.evaluation.episodes import EpisodeSetup
from trainers.pipeline.baselines import baseline_names
from trainers.pipeline.forecast import parts

HANDS = trainers.OperatorConfig(task_interval=(0.4, 0.6), double_change=0.0, braking_change=0.0, push_interval=None)


def test_hands_ask_for_the_gaits_of_their_plan():
    env = OperatorWrapper(trainers.make_env(ANY_GAIT, None, episode_s=5.0), HANDS)
    env.reset(seed=3)
    base, asked = base_env(env), []
    for _ in range(100):
        _, _, terminated, _, info = env.step(base.expert_action())
        assert not terminated
        asked += [event for event in info["operator_events"] if event == ANY_GAIT]
        reach = np.array(any_gait_task(base.task.gait).command_range)
        assert (np.abs(base.command) <= 1.05 * reach).all(), "what the gait bears"
    begun = [gait for gait, (time_s, _) in zip(env.plan.gaits, env.plan.changes, strict=True) if time_s <= 2.0]
    assert len(asked) == len(begun) >= 3
    done = [
        each.gait
        for each, (time_s, _) in zip(env.plan.gaits, env.plan.changes, strict=True)
        if time_s + each.slew_s <= 2.0
    ]
    assert not done or base.task.gait == done[-1] or base.task.gait not in done


def test_an_episode_in_a_named_gait_is_scored_by_it():
    setup = EpisodeSetup(ANY_GAIT, 3, 6.0, gait=NAMED_GAITS["canter"], command=(0.4, 0.0, 0.0))
    record, series = setup.play("expert", {}, trainers.make_env)
    assert record.success and set(series.tasks) == {ANY_GAIT}
    np.testing.assert_allclose(record.step_rate, NAMED_GAITS["canter"].step_rate, rtol=0.15)
    with pytest.raises(InvalidInputError, match="a gait can be chosen"):
        EpisodeSetup("trot", 3, 6.0, gait=NAMED_GAITS["canter"])


def test_drawn_gaits_are_the_same_for_everybody_and_commands_fit_them():
    setup = EpisodeSetup(ANY_GAIT, 8, 2.0, command_interval=0.5)
    first, second = (setup.play("expert", {}, trainers.make_env) for _ in range(2))
    np.testing.assert_array_equal(first[1].gait_numbers, second[1].gait_numbers)
    assert first[0].commands == second[0].commands and len(first[0].commands) == 4
    reach = np.array(any_gait_task(first[1].gaits[0]).command_range)
    assert (np.abs(first[0].commands) <= reach + 1e-9).all()


def test_a_gait_that_becomes_another_one_changes_once():
    import dataclasses

    from trainers.evaluation.scoring import _changes_of_gait

    _, series = EpisodeSetup(ANY_GAIT, 8, 1.0).play("expert", {}, trainers.make_env)
    numbers = series.gait_numbers.copy()
    numbers[10:20, 0] = np.linspace(0.41, 0.5, 10)
    numbers[20:, 0] = 0.5
    numbers[35:, 0] = 0.55
    assert _changes_of_gait(dataclasses.replace(series, gait_numbers=numbers), 0) == 2


def test_the_preset_has_one_head_no_baselines_and_changes_gaits():
    config = trainers.JobConfig.from_preset(ANY_GAIT)
    assert config.is_any_gait and config.channels == ANY_GAIT_CHANNELS and not config.has_clock
    assert baseline_names(config) == [] and "baselines" not in parts(config)
    assert config.perturbation(0.06).operator.task_interval is not None


def test_any_gait_can_be_certified_tours_included():
    certificate = trainers.certify(
        "expert", tasks=(ANY_GAIT,), conditions=("operator", "tour"), episodes=1, seconds=1.0, tours=1, tour_seconds=2.0
    )
    assert certificate.settings.gaits == (ANY_GAIT,)
    assert [(cell.condition.name, cell.survived) for cell in certificate.cells] == [("operator", 1), ("tour", 1)]


@pytest.mark.slow
def test_the_main_job_learns_any_gait(tmp_path):
    config = trainers.JobConfig.from_preset(
        ANY_GAIT, rounds=1, clean_s=2.0, perturbed_s=2.0, hard_push_s=0.0, randomized_s=0.0, held_out_s=2.0,
        shard_s=2.0, dagger_s=1.2, width=16, batch_size=64, clone_steps=10, round_steps=5, episodes=2, episode_s=2.5,
        round_episodes=1, round_video_s=0.0, n_envs=1,
    )  # fmt: skip
    job = trainers.Job(config, tmp_path)
    train, held_out = job.demonstrations()
    policy = job.dagger(job.clone(train, held_out), train, held_out)
    assert policy.tasks == (ANY_GAIT,) and policy.contract.gaits == (None,)
    metrics = job.evaluate({"multi_head": policy} | job.phase_free(policy) | job.baselines(), held_out)
    assert set(metrics["tasks"][ANY_GAIT]) == {"expert", "multi_head"}
    loaded = trainers.load(job.folder.policy)
    env = loaded.make_env(ANY_GAIT)
    obs, _ = env.reset(seed=0)
    assert env.action_space.contains(loaded.predict(obs, deterministic=True)[0])
