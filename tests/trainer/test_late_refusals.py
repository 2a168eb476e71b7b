"""What cannot be or does not belong together is refused before any work; what only looks odd is brought into form."""

import dataclasses
import functools

import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

import trainers
from experts import NMPCConfig, NMPCExpert
from go1_mtl_gym import TASKS, InvalidInputError, SensorNoise
from tests.trainer.stub_env import StubEnv, make_stub
from trainers import (
    CollectJob,
    DAggerTrainer,
    MultiHeadPolicy,
    PhaseConfig,
    PhaseEstimator,
    PhaseFreePolicy,
    ShardMismatchError,
    collect,
    collect_all,
    evaluate,
    evaluate_transition,
    joint_target_figure,
    make_env,
    phase_errors,
    ppo_from_policy,
    record_frames,
    train_phase,
)
from trainers.data.environments import settings_of
from trainers.policies.phase_free import phase_free_layout
from trainers.utils.files import json_form


def test_numpys_numbers_are_taken(tmp_path):
    rows = collect("trot", np.array([0.1, 0, 0]), np.int64(3), np.float32(0.5), make_env=make_stub)
    rows.save(tmp_path / "rows.npz")
    assert rows.meta["job"]["seed"] == 3 and rows.meta["job"]["command"] == [0.1, 0.0, 0.0] and len(rows) == 25


def test_an_expert_with_settings_of_its_own_can_be_told_to_a_shard(tmp_path):
    expert = functools.partial(NMPCExpert, config=NMPCConfig(com_height=0.27))
    rows = collect("trot", seconds=0.1, env_kwargs={"expert": expert, "noise": SensorNoise(q=0.01)})
    rows.save(tmp_path / "rows.npz")
    job = trainers.Demonstrations.load(tmp_path / "rows.npz").meta["job"]
    named = job["env_kwargs"]["expert"]
    assert named["partial"] == "experts.nmpc:NMPCExpert" and named["keywords"]["config"]["com_height"] == 0.27
    assert job["env_kwargs"]["noise"]["q"] == 0.01


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": -1}, "seed"),
        ({"seed": 1.5}, "seed"),
        ({"seconds": 0}, "seconds must be a finite number > 0"),
        ({"seconds": np.inf}, "seconds"),
        ({"seconds": True}, "seconds"),
        ({"seconds": "3"}, "seconds"),
        ({"command": (1, 2)}, "command"),
        ({"perturbation": True}, "perturbation must be"),
        ({"env_kwargs": {"expert": lambda **_: None}}, r"env_kwargs\['expert'\] must be"),
    ],
)
def test_a_job_that_cannot_be_is_refused_when_it_is_described(arguments, message):
    with pytest.raises(InvalidInputError, match=message):
        CollectJob("trot", **{"seed": 0, **arguments})


def test_an_unknown_task_is_refused_by_name():
    for use in (collect, make_env):
        with pytest.raises(InvalidInputError, match="register_task adds others.*must be one of 'trot'.*got 'trto'"):
            use("trto")


def test_arguments_that_would_be_overridden_are_refused():
    for use in (
        lambda: evaluate("expert", "trot", episode_s=5.0),
        lambda: evaluate_transition("expert", "trot", "walk", episode_s=5.0),
        lambda: record_frames("expert", "trot", episode_s=5.0),
    ):
        with pytest.raises(InvalidInputError, match="episode_s is set by .* here, got episode_s=5.0"):
            use()


def test_json_form_of_nested_things():
    value = {"a": (np.float32(0.5), None), "b": SensorNoise(), "c": np.arange(2), "d": NMPCExpert}
    form = json_form(value, "value")
    assert form["a"] == [0.5, None] and form["c"] == [0, 1] and form["d"] == "experts.nmpc:NMPCExpert"
    assert form["b"]["gyroscope"] == SensorNoise().gyroscope
    for bad in (np.nan, object(), {"x": float("inf")}):
        with pytest.raises(InvalidInputError, match="value.* must be something that JSON can hold"):
            json_form(bad, "value")


# -- Joined in silence -------------------------------------------------------------------------------------------------


def test_a_figure_asks_the_heads_that_the_rows_are_of(policy, demos):
    swapped = demos.with_tasks(demos.tasks[::-1])
    lines = [
        joint_target_figure(policy, rows).axes[0].get_lines()[1].get_ydata()
        for rows in (demos.per_task()["trot"], swapped.per_task()["trot"])
    ]
    np.testing.assert_array_equal(*lines)
    with pytest.raises(InvalidInputError, match="rows of the task 'walk' were expected under that name"):
        joint_target_figure(policy, {"walk": demos.per_task()["trot"]})
    other = dataclasses.replace(demos, contract=dataclasses.replace(demos.contract, kp=40.0))
    with pytest.raises(InvalidInputError, match="the policy and the demonstrations do not belong"):
        joint_target_figure(policy, other)


def test_a_phase_estimator_knows_the_rate_and_the_gains_it_was_trained_for(policy, demos):
    estimator = PhaseEstimator(phase_free_layout(policy, 1), width=8)
    train_phase(estimator, demos, PhaseConfig(steps=1))
    other = dataclasses.replace(demos, contract=dataclasses.replace(demos.contract, control_hz=100))
    for use in (train_phase, phase_errors):
        with pytest.raises(InvalidInputError, match="the phase estimator and the demonstrations.*control_hz"):
            use(estimator, other)
    faster = StubEnv(control_hz=100)
    student = MultiHeadPolicy(faster.observation_space, faster.action_space, contract=faster.contract, width=8)
    with pytest.raises(InvalidInputError, match="the student and the phase estimator.*control_hz"):
        PhaseFreePolicy(student, estimator)


def test_a_ppo_model_is_measured_as_its_policy_is(policy, venv):
    model = ppo_from_policy(policy, venv, critic_steps=0, n_steps=16, batch_size=32)
    with pytest.raises(InvalidInputError, match="the policy and the environment do not belong.*control_hz"):
        evaluate(model, "trot", 1, 0.4, make_env=make_stub, control_hz=100)
    assert evaluate(model, "trot", 1, 0.4, make_env=make_stub).episodes


def test_environments_that_change_observations_are_refused(policy, demos, venv, tmp_path):
    for use in (
        lambda: ppo_from_policy(policy, VecNormalize(venv)),
        lambda: DAggerTrainer(VecNormalize(venv), policy, demos, scratch_dir=tmp_path),
    ):
        with pytest.raises(InvalidInputError, match="norm_obs=False"):
            use()
    ppo_from_policy(policy, VecNormalize(venv, norm_obs=False), critic_steps=0, n_steps=16, batch_size=32)


def test_shards_of_another_environment_under_the_same_description_are_refused(tmp_path):
    job = CollectJob("trot", 0, 0.2)
    collect_all([job], tmp_path, make_env=make_stub)

    def make_faster(task, perturbation=None, **env_kwargs):
        return make_stub(task, perturbation, **{**env_kwargs, "control_hz": 100})

    with pytest.raises(ShardMismatchError, match="make_faster"):
        collect_all([job], tmp_path, make_env=make_faster)
    make_faster.__module__, make_faster.__qualname__ = make_stub.__module__, make_stub.__qualname__
    with pytest.raises(ShardMismatchError, match="another contract.*control_hz"):
        collect_all([job], tmp_path, make_env=make_faster)


def test_nothing_is_made_if_one_job_is_impossible(tmp_path):
    jobs = [CollectJob("trot", 0, 0.1), CollectJob("trot", 1, 0.1, env_kwargs={"kp": -1.0})]
    with pytest.raises(InvalidInputError, match="kp"):
        collect_all(jobs, tmp_path)
    assert not list(tmp_path.iterdir())


def test_rounds_of_another_policy_or_other_environments_are_not_resumed(policy, demos, venv, tmp_path):
    DAggerTrainer(venv, policy, demos, scratch_dir=tmp_path)
    other = StubEnv()
    stranger = MultiHeadPolicy(other.observation_space, other.action_space, contract=other.contract, width=32, seed=9)
    with pytest.raises(ShardMismatchError, match="made with another policy"):
        DAggerTrainer(venv, stranger, demos, scratch_dir=tmp_path)
    real = trainers.make_venv(("trot",), 1, {"friction": 0.5})
    assert settings_of(real) != settings_of(trainers.make_venv(("trot",))) and "friction=0.5" in settings_of(real)[0]


def test_a_round_without_an_environment_of_a_task_is_refused(policy, demos, tmp_path):
    trainer = DAggerTrainer(DummyVecEnv([lambda: StubEnv("trot")]), policy, demos, scratch_dir=tmp_path)
    with pytest.raises(InvalidInputError, match="no environment begins in bound, jump, walk"):
        trainer.collect_round()


def test_a_policy_is_unharmed_by_a_training_that_is_refused(policy, demos):
    before = {name: value.clone() for name, value in policy.state_dict().items()}
    other = dataclasses.replace(demos, contract=dataclasses.replace(demos.contract, kp=40.0))
    for arguments in ({"validation": other}, {"config": trainers.BCConfig(batch_size=1)}):
        with pytest.raises(InvalidInputError):
            trainers.train_bc(policy, demos, **arguments)
    assert all(torch.equal(value, before[name]) for name, value in policy.state_dict().items())


def test_lists_and_tensors_are_checked_as_arrays_are(policy):
    obs = StubEnv().reset(seed=0)[0]
    expected = policy.predict(obs, deterministic=True)[0]
    for same in (obs.tolist(), torch.from_numpy(obs)):
        np.testing.assert_array_equal(policy.predict(same, deterministic=True)[0], expected)
    for bad in (np.append(obs[:-4], [0, 0, 0, 0]).tolist(), torch.full((55,), torch.nan), obs[1:].tolist(), "x"):
        with pytest.raises(InvalidInputError):
            policy.predict(bad)


def test_env_kwargs_cannot_contradict_the_contract():
    env = StubEnv()
    with pytest.raises(InvalidInputError, match="by the contract kp is 50.0, env_kwargs say 40.0"):
        MultiHeadPolicy(env.observation_space, env.action_space, contract=env.contract, env_kwargs={"kp": 40.0})


def test_a_policy_of_a_task_that_is_not_registered_says_how_to_register_it():
    env = StubEnv()
    crawl = dataclasses.replace(TASKS["walk"].gait, name="crawl")
    contract = env.contract.with_tasks(("trot", "bound", "jump", "crawl"), {"crawl": crawl})
    policy = MultiHeadPolicy(env.observation_space, env.action_space, contract=contract, width=8)
    with pytest.raises(InvalidInputError, match=r"'crawl' is not registered.*register_task\(Task\('crawl', Gait"):
        policy.make_env("crawl")


def test_commands_and_numbers_are_checked_before_the_first_episode(policy, monkeypatch):
    for arguments, message in (
        ({"commands": [(0.1, 0, 0), (9, 0)]}, "vx, vy, yaw rate"),
        ({"episodes": 1.5}, "episodes"),
        ({"seconds": "1"}, "seconds"),
        ({"seed": -1}, "seed"),
        ({"n_jobs": 0}, "n_jobs"),
        ({"command_interval": "a"}, "command_interval"),
    ):
        with pytest.raises(InvalidInputError, match=message):
            evaluate(policy, "trot", make_env=None, **arguments)
    monkeypatch.setattr("trainers.evaluation.closed_loop.run_all", None)
    with pytest.raises(InvalidInputError, match="must lie within"):
        evaluate(policy, "trot", commands=[(0.1, 0, 0), (9, 0, 0)])


def test_a_result_prints_as_one_line(policy):
    text = str(evaluate(policy, "trot", 2, 0.4, make_env=make_stub))
    assert text.startswith("trot: 0 of 2 episodes of 0.4 s succeed") and "\n" not in text
