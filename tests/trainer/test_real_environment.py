"""The whole chain once on the real environment and its expert, in a few seconds of robot time."""

import numpy as np

from go1_mtl_gym import BUILT_IN_TASKS, TASKS
from trainers import (
    BCConfig,
    DAggerConfig,
    DAggerTrainer,
    Demonstrations,
    MultiHeadPolicy,
    PerturbationConfig,
    collect,
    evaluate,
    evaluate_transition,
    load,
    make_env,
    make_venv,
    train_bc,
)

KWARGS = {"channels": ("command", "phase", "last_action")}


def test_expert_walks_in_every_gait():
    results = {task: evaluate("expert", task, 1, 4.0, commands=[(0.3, 0.0, 0.0)]) for task in TASKS}
    assert all(result.success_rate == 1.0 for result in results.values()), results


def test_labels_are_the_expert_at_the_state_before_the_step():
    demos = collect("trot", (0.4, 0.0, 0.0), 5, 0.6, PerturbationConfig(noise_rad=0.02), KWARGS)
    assert len(demos) == 30 and demos.tasks == BUILT_IN_TASKS
    env = make_env("trot", **KWARGS)
    layout = env.unwrapped.layout
    executed = demos.obs[1:, layout.slices["last_action"]]
    assert 0 < np.abs(executed - demos.acts[:-1]).max() < 0.1
    np.testing.assert_array_equal(demos.half_range, env.unwrapped.action_map.half_range)


def test_clone_correct_save_and_evaluate(tmp_path):
    tasks = ("trot", "walk")
    kwargs = KWARGS | {"tasks": tasks}
    demos = Demonstrations.concatenate([collect(task, seed=0, seconds=2.0, env_kwargs=kwargs) for task in tasks])
    venv = make_venv(tasks, env_kwargs=kwargs)
    policy = MultiHeadPolicy(venv.observation_space, venv.action_space, contract=demos.contract, width=32)
    config = BCConfig(steps=60, batch_size=64)
    history = train_bc(policy, demos, config, validation=demos)
    assert history.r2["trot"][-1] > 0.5
    DAggerTrainer(venv, policy, demos, DAggerConfig(seconds_per_task=1.0), config, scratch_dir=tmp_path).run(1)
    policy.save(tmp_path / "policy.zip")
    again = load(tmp_path / "policy.zip")
    one, other = (evaluate(p, "trot", 1, 1.0) for p in (policy, again))
    assert one.as_dict() == other.as_dict() and 0 < one.survival_s <= 1.0


def test_expert_changes_gait():
    for first, second in (("trot", "walk"), ("jump", "trot")):
        result = evaluate_transition("expert", first, second, 1, before_s=0.5, after_s=4.0)
        assert result.success_rate == 1.0, result
