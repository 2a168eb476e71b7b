"""Training runs, the paper's tables, new gaits and benchmarks."""

import dataclasses
import itertools
import pickle

import numpy as np
import pytest
import torch

import trainers
from experiments.agents import PolicyFile
from experiments.benchmarks import expert as expert_benchmark
from experiments.benchmarks import loops, rows, training, turns
from experiments.benchmarks.peers import Go2ConvexMPC, MissingPeerError
from experiments.new_gaits import learning
from experiments.new_gaits import study as new_gaits
from experiments.paper import networks, settings
from experiments.paper import study as paper
from experiments.results import Group
from experiments.study import Cell
from experiments.training_runs import TrainedPolicy, TrainingRun, changed
from go1_mtl_gym import TASKS, InvalidInputError
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.robot import HOME_POSE
from trainers import BCConfig, BCTrainer, TensorBatches
from trainers.pipeline.config import JobConfig
from trainers.pipeline.job import Job
from trainers.pipeline.new_policy import new_policy

# -- Training runs -----------------------------------------------------------------------------------------------------

TINY = JobConfig(
    tasks=("trot", "walk"),
    seed=2,
    n_envs=2,
    rounds=1,
    clean_s=1.0,
    perturbed_s=1.0,
    hard_push_s=1.0,
    randomized_s=1.0,
    held_out_s=1.0,
    shard_s=1.0,
    dagger_s=0.4,
    width=8,
    batch_size=32,
    clone_steps=20,
    round_steps=10,
    phase_free_s=0.5,
    phase_free_steps=5,
    round_episodes=1,
    episode_s=0.5,
)


def test_a_run_is_named_by_what_makes_its_policy(tmp_path):
    def folder(**settings):
        return TrainingRun(JobConfig(**({"seed": 3} | settings)), tmp_path).folder

    assert folder().name.startswith("seed-3-")
    assert TrainingRun(pickle.loads(pickle.dumps(JobConfig(seed=3))), tmp_path).folder == folder()
    for unused in (
        {"n_envs": 7},
        {"device": "cuda"},
        {"episodes": 1},
        {"preset": "smoke"},
        {"video_s": 9.0},
        {"phase_free_s": 0.0},
    ):
        assert folder(**unused) == folder()
    used = ({"seed": 4}, {"width": 64}, {"kp": 20.0}, {"rounds": 2}, {"takeover_rad": 0.1})
    assert len({folder(), *(folder(**own) for own in used)}) == 6
    assert changed(JobConfig(kp=20.0, n_envs=1)) == {"kp": 20.0}


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> TrainingRun:
    run = TrainingRun(TINY, tmp_path_factory.mktemp("runs"))
    threads = torch.get_num_threads()
    assert run.make() > 0.0 and torch.get_num_threads() == threads
    return run


@pytest.mark.slow
def test_a_run_leaves_the_main_jobs_policy_and_is_made_once(finished, tmp_path):
    job = Job(dataclasses.replace(TINY, n_envs=1), tmp_path / "job")
    train, held_out = job.demonstrations()
    policy = job.dagger(job.clone(train, held_out), train, held_out)
    assert finished.policy.read_bytes() == job.folder.policy.read_bytes()
    for gait, errors in trainers.offline_metrics(policy, held_out).items():
        assert finished.held_out[gait] == pytest.approx(errors)
    before = {path: path.stat().st_mtime_ns for path in finished.folder.rglob("*")}
    assert TrainedPolicy("a", 2, path=finished.policy, run=finished).prepare() > 0.0
    assert before == {path: path.stat().st_mtime_ns for path in finished.folder.rglob("*")}


# -- The paper's tables ------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Slow(paper.PaperStudy):
    """Two gaits at 50 Hz."""

    name = "paper_slow"
    title = "Slow"
    table_of = settings.Table(
        "simulation",
        "simulation",
        ("trot", "bound"),
        {"control_hz": 50},
        dict.fromkeys(("trot", "bound"), (0.5, 0.2, 0)),
    )


PAPER = dataclasses.replace(settings.QUICK, seconds=0.4, widths=(8,), steps=12, batch_size=16, curve_rows=5, seeds=(1,))


@pytest.fixture(scope="module")
def slow(tmp_path_factory) -> Slow:
    study = Slow(PAPER, cache=tmp_path_factory.mktemp("paper"))
    study.prepare(1)
    return study


@pytest.mark.parametrize("table", settings.TABLES.values(), ids=lambda table: table.name)
def test_held_out_commands_keep_away_from_all_others(table):
    options = dataclasses.replace(settings.PaperOptions(), gap=0.12)
    for gait in table.gaits:
        own = settings.commands(table, gait, options)
        assert [len(own[use]) for use in ("train", "named", "unseen")] == [20, gait in table.named, 10]
        train, held = np.array(own["train"]), np.array(own["named"] + own["unseen"])
        assert np.linalg.norm(train[:, None] - held, axis=2).min() >= 0.12
        assert (np.abs([*own["train"], *own["unseen"]]) <= options.largest(gait)).all()


def test_commands_come_from_the_seed_and_need_room():
    table = Slow.table_of
    first, same = (settings.commands(table, "trot", PAPER) for _ in range(2))
    other = settings.commands(table, "trot", dataclasses.replace(PAPER, data_seed=1))
    assert first == same and first["train"] != other["train"] and first["unseen"] != other["unseen"]
    with pytest.raises(InvalidInputError, match="room"):
        settings.draw_apart(np.random.default_rng(0), 1, np.array([0.1, 0.1, 0.0]), [(0.0, 0.0, 0.0)], 0.2)


def test_no_two_shards_share_a_seed():
    options = settings.PaperOptions()
    tables = [settings.shard_jobs(settings.SIMULATION, dataclasses.replace(options, data_seed=seed)) for seed in (0, 1)]
    names = [job.name for table in tables for own in table.values() for job in own]
    assert len(set(names)) == len(names) == 2 * 3 * (20 + 1 + 10)


def test_a_network_is_measured_on_what_was_held_out(slow):
    (agent,) = [own for own in slow.agents() if own.name == "multi_head"]
    (cell,) = slow.cells(agent)
    records = slow.measure(agent, cell, 0)
    policy = trainers.load(slow.network("multi_head", 8, 1).file)
    tests = networks.held_out(slow.table_of, PAPER, slow.folder)
    assert list(tests) == ["named", "unseen"]
    for use, rows_ in tests.items():
        found = trainers.offline_metrics(policy, rows_)
        for gait, metrics in found.items():
            (own,) = [own for own in records if own["condition"] == use and own["task"] == gait]
            assert own["r2"] == pytest.approx(metrics["r2"], rel=1e-4)
    shown = networks.thinned(trainers.Demonstrations.concatenate([*tests.values()]), PAPER.curve_rows)
    for gait, metrics in trainers.offline_metrics(policy, shown).items():
        (curve,) = [own for own in records if own["condition"] == "curve" and own["task"] == gait]
        assert curve["curve_mse"][-1] == pytest.approx(metrics["mse"], rel=1e-4), "it ends at the finished network"


def test_networks_of_one_gait_learn_nothing_of_the_other(slow):
    (agent,) = [own for own in slow.agents() if own.name == "per_gait"]
    assert [cell.task for cell in slow.cells(agent)] == ["trot", "bound"]
    network = slow.network("per_gait", 8, 1, "trot")
    records = network.train()
    trot = networks.rows_of(settings.shard_jobs(slow.table_of, PAPER)["train"], slow.folder).per_task()["trot"]
    low, high = trot.acts.min(0), trot.acts.max(0)
    policy = trainers.load(network.file)
    np.testing.assert_allclose(policy.act_normalizer.shift.numpy(), (low + high) / 2, atol=1e-6)
    assert {own["task"] for own in records if "task" in own} == {"trot"}


def test_wider_and_longer_networks_leave_the_others_and_the_data(slow):
    def cell(**change):
        return dataclasses.replace(slow, options=dataclasses.replace(PAPER, **change))

    agent, one = slow.agents()[1], Cell("all gaits", "8 wide", 1)
    for more in ({"widths": (8, 16)}, {"seeds": (1, 2)}, {"kinds": ("pooled",)}):
        assert cell(**more).cell_path(agent, one, 0) == slow.cell_path(agent, one, 0)
    assert cell(steps=13).cell_path(agent, one, 0) != slow.cell_path(agent, one, 0)
    assert cell(steps=13, precision="float32").folder == slow.folder != cell(seconds=0.6).folder
    assert sum(own["data_s"] for own in networks.account(slow.table_of, PAPER, slow.folder)) == pytest.approx(8 * 0.4)


def test_a_verdict_needs_every_metric():
    def group(mse, mae, r2):
        return Group([{"mse": mse, "mae": mae, "r2": r2}])

    assert paper.worse_than_pooled(group(1, 1, 0.9), group(2, 2, 0.8)) == []
    assert paper.worse_than_pooled(group(1, 2, 0.9), group(2, 2, 0.9)) == ["mae", "r2"]


# -- New gaits ---------------------------------------------------------------------------------------------------------

TINY_GAITS = dataclasses.replace(
    new_gaits.NewGaits.quick,
    job=dataclasses.replace(
        new_gaits.NewGaits.quick.job, width=16, shard_s=1.0, held_out_s=1.0, clone_steps=5, episode_s=0.5, batch_size=32
    ),
    demonstrations_s=(1.0, 2.0),
    rehearsal_s=1.0,
)


@pytest.fixture(scope="module")
def gaits(tmp_path_factory) -> new_gaits.NewGaits:
    """The study of a small untrained policy of two gaits, which stands still."""
    job = dataclasses.replace(TINY_GAITS.job, tasks=("trot", "walk"))
    folder = tmp_path_factory.mktemp("gaits")
    policy, home = new_policy(job, job.env_kwargs), ActionMap.for_gains(PDGains(job.kp, job.kd)).from_radians(HOME_POSE)
    policy.act_normalizer.set(home, np.full(12, 0.1))
    policy.save(folder / "base.zip")
    return new_gaits.NewGaits(TINY_GAITS, (PolicyFile("base", path=folder / "base.zip"),), folder)


@pytest.mark.parametrize(
    "change",
    [
        {"demonstrations_s": ()},
        {"demonstrations_s": (30.0, 15.0)},
        {"demonstrations_s": (10.0, 15.0)},
        {"seeds": (1, 1)},
        {"rehearsal_s": 0.0},
        {"old_episodes": 0},
    ],
)
def test_impossible_lessons_are_refused(change):
    with pytest.raises(InvalidInputError):
        learning.NewGaitOptions(**change)


def test_fewer_seconds_are_the_first_of_more_and_seeds_share_nothing(gaits):
    options, base = learning.NewGaitOptions(), gaits.base.load()
    jobs = {seed: options.job_of(base, ("gallop",), seed) for seed in options.seeds}
    small, large = (learning.demonstrations(jobs[0], seconds) for seconds in (15.0, 240.0))
    assert len(small) == 2 and len(large) == 32 and all(job in large for job in small)
    clean = [job for job in large if job.perturbation is None]
    assert sum(job.seconds for job in clean) == 40.0 and not any("randomization" in job.env_kwargs for job in clean)
    names = [job.name for own in jobs.values() for job in learning.demonstrations(own, 240.0)]
    names += [job.name for job in learning.held_out(base, "gallop", options)]
    assert len(set(names)) == len(names) == 3 * 32 + 4


def test_changes_are_measured_in_radians_and_to_the_bit(gaits, tmp_path):
    policy = gaits.base.load()
    rows_ = learning.rehearsal(policy, TINY_GAITS, tmp_path)
    np.testing.assert_allclose(policy.predict(rows_.obs, deterministic=True)[0], rows_.acts, atol=1e-6)
    grown = policy.add_task("pace")
    unchanged = {"old_rows": 100, "old_equal": True, "old_largest_rad": 0.0}
    assert learning.changes(policy, grown, rows_) == unchanged
    with torch.no_grad():
        grown.actor.heads[2][-1].bias += 1.0
    assert learning.changes(policy, grown, rows_)["old_equal"], "the new head is not asked in old gaits"
    with torch.no_grad():
        grown.actor.heads[1][-1].bias[4] += 0.01
    found = learning.changes(policy, grown, rows_)
    assert not found["old_equal"]
    assert found["old_largest_rad"] == pytest.approx(0.01 * 0.1 * rows_.half_range[4], rel=1e-3)


@pytest.mark.slow
def test_every_method_leaves_of_the_old_gaits_what_it_says(gaits):
    gaits.prepare(1)
    base, found = gaits.base.load(), {}
    for agent in gaits.agents()[2:]:
        records = gaits.measure(agent, Cell("pace", "2 s", 0), 1)
        found[agent.name] = records if isinstance(records, list) else [records]
    assert found[learning.FROZEN][0]["old_equal"] and found[learning.ASSISTED][0]["old_equal"]
    assert not found[learning.TUNED][0]["old_equal"] and "old_equal" not in found[learning.SCRATCH][0]
    assert [own["task"] for own in found[learning.TUNED][1:]] == ["trot", "walk"]
    assert all(own[0]["demonstrations_s"] == 2.0 and own[0]["trials"] == 1 for own in found.values())
    policy = learning.GaitTraining(base, "pace", learning.FROZEN, 2.0, 0, TINY_GAITS, gaits.folder).policy()
    assert policy.tasks == ("trot", "walk", "pace")


def test_half_of_the_labels_is_demonstrated_in_whole_shards():
    assert [learning.halves(seconds, 15.0) for seconds in (15.0, 45.0, 60.0)] == [(15, 0), (15, 30), (30, 30)]


def test_gaits_must_be_new_and_policies_have_heads(gaits):
    for wrong in ("trot", "hop"):
        with pytest.raises(InvalidInputError, match=wrong):
            dataclasses.replace(gaits, options=dataclasses.replace(TINY_GAITS, gaits=(wrong,))).agents()


@pytest.mark.parametrize(("survived", "expected"), [((0, 20, 20), 30.0), ((20, 19, 20), 60.0), ((20, 20, 19), None)])
def test_enough_is_where_survival_begins_to_last(survived, expected):
    levels = {15.0 * 2**i: Group([{"survived": own, "trials": 20}]) for i, own in enumerate(survived)}
    assert new_gaits.enough(levels) == expected


def test_one_bit_in_any_policy_is_a_change():
    same, other = {"old_equal": True, "old_largest_rad": 0.0}, {"old_equal": False, "old_largest_rad": 0.02}
    assert new_gaits.old_cell(Group([same, same]), Group()) == "equal to the bit"
    assert new_gaits.old_cell(Group([same, other]), Group()) == "changed by up to 0.02 rad"
    after = Group([{"trials": 5, "succeeded": 4}])
    assert new_gaits.old_cell(Group([other]), after).startswith("4/5") and new_gaits.old_cell(Group([{}]), after) == "-"


# -- Benchmarks --------------------------------------------------------------------------------------------------------

QUICK = training.TrainingBenchmark.quick


def test_turns_alternate_and_are_kept_by_round():
    calls = []

    def contestant(name):
        return lambda i: (calls.append(name), {"samples_per_s": 10.0 * i + (name == "b")})[1]

    values = turns.interleaved({name: contestant(name) for name in "ab"}, 3)
    assert calls == ["a", "b", "b", "a", "a", "b"]
    assert values == {"a": {"samples_per_s": [0.0, 10.0, 20.0]}, "b": {"samples_per_s": [1.0, 11.0, 21.0]}}


def test_ratios_are_taken_within_rounds():
    """The machine is ten times slower in the second round; the ratio is 2, 2, 4 all the same."""
    fast, slow = turns.summary({"fast": {"rate": [20.0, 2.0, 40.0]}, "slow": {"rate": [10.0, 1.0, 10.0]}}, ("slow",))
    assert fast["rate"] == [11.0, 20.0, 30.0] and fast["over"] == {"slow": {"rate": [2.0, 2.0, 3.0]}}
    assert slow["agent"] == "slow" and slow["over"] == {}


def test_the_bare_loop_does_the_same_arithmetic():
    data = loops.made_up(2000, 4, seed=0, episode=10)
    config = BCConfig(steps=20, batch_size=64, max_grad_norm=0.05)
    policies = [loops.student(data, 16, QUICK) for _ in range(2)]
    before = [p.detach().clone() for p in policies[0].actor.parameters()]
    BCTrainer(policies[0], config).fit(data)
    batches = itertools.chain.from_iterable(itertools.repeat(TensorBatches(data, 64, config.seed)))
    pairs = itertools.islice(((batch["obs"], batch["acts"]) for batch in batches), 1, None)
    loops.bare_loop(policies[1], pairs, data.half_range, config, lambda: None)
    for first, own, bare in zip(before, *(policy.actor.parameters() for policy in policies)):
        torch.testing.assert_close(own, bare, atol=2e-5, rtol=0)
        assert float((own - first).detach().abs().max()) > 1e-3


def test_the_walk_without_the_expert_is_the_experts():
    """Replayed from the recorded actions, the environment shows the recorded observations."""
    walked = rows.collect(rows.TASK, seed=3, seconds=0.1, env_kwargs={"control_hz": rows.CONTROL_HZ})
    env, seen = rows.make_env(rows.TASK, control_hz=rows.CONTROL_HZ), []

    class Recorder:
        def reset(self, **kwargs):
            seen.append(env.reset(**kwargs)[0])

        def step(self, action):
            seen.append(env.step(action)[0])

    rows._replay(Recorder(), walked, seed=3)
    np.testing.assert_array_equal(np.array(seen[:-1]), walked.obs)


def test_exact_solvers_agree_and_ours_is_timed_from_the_inside_out():
    study = expert_benchmark.ExpertBenchmark(expert_benchmark.ExpertOptions(states=3))
    records = study.measure(study.agents()[0], Cell("trot"), 0)
    ours = {own["condition"]: own for own in records if own["agent"] == "ours, osqp"}
    assert ours["qp"]["median_ms"] < ours["update"]["median_ms"] and ours["action"]["ratio"] == 1.0
    errors = {own["agent"]: own["largest_n"] for own in records if own["condition"] == "force error"}
    assert not errors or max(errors.values()) < 1.0


def test_a_folder_that_is_no_checkout_is_refused(tmp_path):
    with pytest.raises(MissingPeerError, match="no checkout"):
        Go2ConvexMPC(tmp_path, TASKS["trot"].gait, (0.3, 0.0, 0.0))
