"""Studies of policies: worlds, pushes, what methods share, the phase that is asked for, and aggregates by hand."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import torch

import trainers
from experiments.agents import EXPERT, STUDENT, Agent, PolicyFile, policy_files, shipped, with_expert
from experiments.pushing import push_w
from experiments.results import Results
from experiments.student import ablation, budget, commanded, hands, phase, phase_free, pushes, robustness
from experiments.student.episodes import counts
from experiments.study import Cell
from go1_mtl_gym import TASKS, Go1Env, InvalidInputError, robot
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.sensing.observation import SensorNoise
from go1_mtl_gym.sensing.state_noise import EstimatorNoise
from go1_mtl_gym.sim.domain_randomization import DomainRandomization
from trainers.data.operator_plan import RELEASED, draw_plan
from trainers.evaluation.conditions import UNTOUCHED
from trainers.pipeline.new_policy import new_policy

HOME = ActionMap.for_gains(PDGains()).from_radians(robot.HOME_POSE)
STANDING = SimpleNamespace(load=lambda: Idle(), env_kwargs={}, name="idle")


class Idle:
    """A policy that stands."""

    env_kwargs = {"tasks": ("trot", "walk"), "control_hz": 100}

    def predict(self, obs, deterministic=False):
        return HOME.astype(np.float32), None


def results(records, **values) -> Results:
    """Results with these records."""
    head = {"study": "study", "agent": STUDENT, "task": "trot", "condition": "", "seed": 0}
    return Results("study", "", 1, {}, {}, None, {}, tuple(head | record for record in records), **values)


# -- Agents ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Files of two small untrained policies with different gains; the second was trained in another world."""
    folder = tmp_path_factory.mktemp("policies")
    job = phase_free.PhaseFree.quick.job
    for name, kp in (("a", 50.0), ("b", 40.0)):
        own = dataclasses.replace(job, kp=kp, width=8, history=1)
        policy = new_policy(own, own.env_kwargs)
        policy.extra_env_kwargs = {"friction": 0.4} if name == "b" else {}
        policy.save(folder / f"{name}.zip")
    return folder


def test_policies_come_first_and_the_expert_walks_in_their_world(saved):
    (agent,) = policy_files([f"mine={saved / 'b.zip'}"])
    first, expert = with_expert([agent])
    assert first.name == "mine" and expert.load() == EXPERT
    assert expert.env_kwargs == {"tasks": ("trot", "bound"), "control_hz": 50, "kp": 40.0, "kd": 2.0}
    assert "friction" not in first.load().env_kwargs, "measured in the model's world"


@pytest.mark.parametrize("names", [["=a.zip"], ["expert=a.zip"], ["a=a.zip", "a=b.zip"]])
def test_names_that_say_nothing_are_refused(saved, names):
    with pytest.raises(InvalidInputError, match="another name"):
        policy_files(
            [name.replace("a.zip", str(saved / "a.zip")).replace("b.zip", str(saved / "b.zip")) for name in names]
        )


def test_policies_of_different_worlds_are_not_compared(saved):
    agents = [PolicyFile(name, path=saved / f"{name}.zip") for name in "ab"]
    with pytest.raises(InvalidInputError, match="same tasks, control_hz, kp, kd"):
        with_expert(agents)


# -- Worlds and pushes -------------------------------------------------------------------------------------------------


def test_noise_is_the_sensors_or_the_estimators():
    assert robustness.world("noise", 1.0, for_expert=False) == {"noise": SensorNoise()}
    doubled = robustness.world("noise", 2.0, for_expert=True)["estimator_noise"]
    assert (doubled.dq, doubled.height_bias) == (2 * EstimatorNoise().dq, 2 * EstimatorNoise().height_bias)
    assert robustness.world("friction", 0.4, for_expert=True) == {"friction": 0.4}


def test_faults_of_the_sensors_are_given_together_and_are_the_policies_alone():
    assert robustness.world("encoder_offset", 0.03, for_expert=False) == {"sensors": {"encoder_offset": 0.03}}
    assert robustness.world("sensor_delay_s", 0.01, for_expert=False) == {"sensors": {"delay_s": 0.01}}
    study = robustness.Robustness(robustness.RobustnessOptions())
    policys, experts = ({cell.condition for cell in study.cells(agent)} for agent in (STANDING, Agent(EXPERT)))
    assert policys == set(robustness.QUANTITIES) and policys - experts == {"encoder_offset", "sensor_delay_s"}


def test_what_environments_are_drawn_from_is_within_what_is_measured():
    ranges = DomainRandomization()
    for quantity, (_, values) in robustness.QUANTITIES.items():
        low, high = getattr(ranges, quantity)
        assert values[0] <= low and high <= values[-1], quantity


@pytest.mark.parametrize("quantity", robustness.QUANTITIES)
def test_the_environment_accepts_every_value(quantity):
    _, values = robustness.QUANTITIES[quantity]
    assert len(values) == 5 and list(values) == sorted(set(values))
    for value in values:
        for for_expert in (True, False):
            Go1Env("trot", **robustness.world(quantity, value, for_expert)).close()


def test_equal_seeds_give_equal_metrics():
    study = robustness.Robustness(robustness.RobustnessOptions(1, 2.5, 1.0, every=4))
    first, again, other = (study.measure(STANDING, Cell("trot", "noise"), seed) for seed in (1, 1, 2))
    assert first == again and first[0]["velocity_error"] > 0.0 and [own["value"] for own in first] == [0.0, 2.0]
    assert first[0]["velocity_error"] != other[0]["velocity_error"]


class Skittle:
    """An environment whose robot falls a while after a push above a limit, which is lower in every tenth episode."""

    def __init__(self, limit, control_hz=100, **kwargs):
        self.limit, self.episodes, self.control_hz = limit, 0, control_hz
        self.unwrapped, self.state = self, SimpleNamespace(rpy=np.array([0.0, 0.0, np.pi / 2]))
        self.pushes, self.closed = [], False
        self.info = {"task": "trot", "command": (0.3, 0.0, 0.0), "contacts": np.ones(4, bool)}
        self.info |= dict.fromkeys(("base_velocity", "filtered_command"), np.zeros(3))

    def reset(self, seed, options):
        self.episodes, self.steps, self.pushed_at = self.episodes + 1, 0, None
        assert options["command"] == (0.3, 0.0, 0.0)
        return np.zeros(1), self.info

    def step(self, action):
        self.steps += 1
        fallen = self.pushed_at is not None and self.falls and self.steps > self.pushed_at + 20
        return np.zeros(1), 0.0, fallen, False, self.info

    def push(self, delta):
        self.pushes.append((self.steps, delta))
        self.pushed_at, size = self.steps, np.linalg.norm(delta)
        self.falls = size > self.limit or (self.episodes % 10 == 0 and size > 0.5)

    def close(self):
        self.closed = True


def pushed(monkeypatch, env, **options):
    """The metrics of pushes to the left in an environment."""
    monkeypatch.setattr(pushes, "make_env", lambda *_, **__: env)
    return pushes.Pushes(pushes.PushOptions(**options)).measure(STANDING, Cell("trot", "left"), 0)


@pytest.mark.parametrize(
    ("limit", "trials", "largest", "last"), [(1.1, 20, 1.0, 1.2), (9, 7, 0.4, 0.6), (0.1, 3, 0, 0.2)]
)
def test_the_largest_push_is_below_the_first_that_too_few_survive(monkeypatch, limit, trials, largest, last):
    env = Skittle(limit)
    found = pushed(monkeypatch, env, trials=trials)
    assert found["largest"] == pytest.approx(largest) and not found["at_cap"] and env.closed
    assert [own[0] for own in found["tried"]] == pytest.approx(np.arange(1, round(last / 0.2) + 1) * 0.2)
    assert all(survived >= 0.9 * trials for _, survived, _ in found["tried"][:-1])
    assert found["tried"][-1][1] < 0.9 * trials and env.episodes == trials * len(found["tried"])


def test_pushes_come_at_random_phases_equal_for_all_sizes_and_in_the_heading_frame(monkeypatch):
    env = Skittle(9.0)
    found = pushed(monkeypatch, env, trials=6, grid=2, after_s=0.1)
    assert found["at_cap"] and found["largest"] == 0.4
    when = [steps for steps, _ in env.pushes]
    assert when[:6] == when[6:] and len(set(when)) > 2
    assert min(when) >= 150 and max(when) <= 150 + round(100 * TASKS["trot"].gait.period)
    np.testing.assert_allclose(env.pushes[0][1], (-0.2, 0.0, 0.0), atol=1e-12)  # left of a robot that looks along y


def test_a_fall_before_the_push_is_no_survival(monkeypatch):
    env = Skittle(9.0)
    monkeypatch.setattr(env, "step", lambda action: (np.zeros(1), 0.0, True, False, env.info))
    assert pushed(monkeypatch, env, trials=2) == {"largest": 0.0, "at_cap": False, "tried": [[0.2, 0, 2]]}
    assert not env.pushes


def test_a_stand_survives_a_nudge_and_no_blow():
    options = pushes.PushOptions(trials=1, step=0.1, grid=1, before_s=0.2, after_s=0.5)
    for step, largest in ((0.1, 0.1), (9.0, 0.0)):
        study = pushes.Pushes(dataclasses.replace(options, step=step))
        assert study.measure(STANDING, Cell("trot", "left"), 0)["largest"] == largest


def test_a_push_to_the_left_goes_left():
    np.testing.assert_allclose(push_w("left", 0.5, np.pi / 2), (-0.5, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(push_w("backward", 2.0, 0.0), (-2.0, 0.0, 0.0), atol=1e-12)


def test_episodes_are_counted():
    def episode(fallen, success, error):
        return trainers.EpisodeRecord(0, ((0.0, 0.0, 0.0),), 1.0, fallen, error, 0.0, (0.0,) * 4, success)

    first = trainers.ClosedLoopResult("trot", 1.0, (episode(False, True, 0.1), episode(False, False, 0.3)))
    second = trainers.ClosedLoopResult("walk", 2.0, (episode(True, False, float("nan")), episode(False, True, 0.2)))
    assert counts(first, second) == {"trials": 4, "survived": 3, "succeeded": 2, "velocity_error": pytest.approx(0.2)}


# -- Hands -------------------------------------------------------------------------------------------------------------


def test_every_condition_has_hands_that_press_no_button():
    operators = hands.Hands(hands.Hands.full).operators
    assert [*operators] == [*(f"stick to {d}" for d in ("0.25", "0.5", "0.75", "1", "1.2", "1.5")), *hands.OTHERS]
    assert [each.deflection for each in operators.values()] == [0.25, 0.5, 0.75, 1.0, 1.2, 1.5, 1.0, 1.0]
    assert {each.task_interval for each in operators.values()} == {None}
    assert operators[hands.STANDING] is UNTOUCHED


def test_the_fastest_command_ends_at_the_limit():
    assert hands.speeds("walk", 0.5) == {"fastest": pytest.approx(0.3), "declared": 0.6}
    assert hands.speeds("trot", 1.5)["fastest"] == pytest.approx(1.95)
    assert hands.speeds("trot", 3.0) == {"fastest": 2.0, "declared": 1.3}


def test_hands_let_go_every_few_seconds_and_mostly_at_full_deflection():
    seconds = 4000.0
    plan = draw_plan(hands.BRAKING, "trot", ("trot", "walk"), seconds, np.random.default_rng(0))
    let_go = [each for each in plan.segments if each.after == RELEASED != each.before]
    assert seconds / len(let_go) == pytest.approx(5.0, abs=0.3)
    assert np.mean([max(map(abs, each.before)) == 1.0 for each in let_go]) == pytest.approx(0.92, abs=0.03)
    assert {each.move for each in plan.segments} == {"straight", "full_and_back", "release"}


def test_a_stand_survives_untouched_and_does_not_follow_the_stick():
    study = hands.Hands(hands.HandsOptions(2, 4.0, 3.0, (1.0,)))
    standing, reaching = (study.measure(STANDING, Cell("trot", name), 0) for name in ("standing", "stick to 1"))
    assert (standing["trials"], standing["survived"]) == (2, 2) and "fastest" not in standing
    assert reaching["succeeded"] == 0 and (reaching["fastest"], reaching["declared"]) == (1.3, 1.3)


def test_counts_are_tabled_by_gait_and_success_is_drawn_over_speed():
    def record(agent, condition, succeeded, **values):
        own = {"agent": agent, "condition": condition, "trials": 12, "survived": 12, "succeeded": succeeded}
        return own | values

    records = []
    for agent in (STUDENT, EXPERT):
        records += [record(agent, "stick to 0.5", 12, fastest=0.65, declared=1.3), record(agent, hands.STANDING, 3)]
        records += [record(agent, "stick to 1.5", 6, fastest=1.95, declared=1.3), record(agent, hands.LETTING_GO, 11)]
    records.append(record(STUDENT, "stick to 0.5", 9, task="walk", fastest=0.3, declared=0.6))
    found, study = results(records), hands.Hands(hands.Hands.full)
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in study.table(found).splitlines()]
    assert rows[0][2:] == ["declared [m/s]", "stick to 0.5", "standing", "stick to 1.5", "letting go"]
    assert rows[2] == ["trot", STUDENT, "1.3", "12/12", "12/12", "6/12", "11/12"]
    assert [row[:2] for row in rows[2:]] == [["trot", STUDENT], ["trot", EXPERT], ["walk", STUDENT]]
    trot, walk, _ = (*study.figure(found).axes, None)
    assert [trot.get_title(), walk.get_title()] == ["trot", "walk"]
    lines = {line.get_label(): line.get_xydata().tolist() for line in trot.get_lines()}
    assert lines[STUDENT] == [[0.65, 1.0], [1.95, 0.5]] and lines["declared range"] == [[1.3, 0.0], [1.3, 1.0]]


# -- Commands over seeds, and variants ---------------------------------------------------------------------------------


def test_seeds_are_taken_together_and_misses_are_bold():
    def record(seed, succeeded, error, agent=STUDENT, condition=commanded.DRAWN, trials=100):
        own = {"agent": agent, "condition": condition, "seed": seed, "trials": trials}
        return own | {"succeeded": succeeded, "survived": succeeded, "velocity_error": error}

    records = [record(0, 100, 0.02), record(1, 94, 0.06), record(1, 20, 0.03, EXPERT, trials=20)]
    records.append(record(0, 19, 0.02, condition=commanded.CORNERS, trials=20))
    table = commanded.Commanded(commanded.Commanded.full).table(results(records))
    row = [cell.strip() for cell in table.splitlines()[-1].strip("|").split("|")]
    assert row[:2] == ["trot", "194/200"] and row[3:8] == ["**94%**", "0.040", "**0.060**", "0.030", "2.00"]
    assert row[8:] == ["19/20", "-", "-", "-"]


def test_every_variant_changes_one_setting_and_can_be(monkeypatch):
    options = ablation.AblationOptions()
    default = dataclasses.asdict(options.job(ablation.DEFAULT))
    for name, change in ablation.VARIANTS.items():
        job = options.job(name)
        assert {key for key, value in dataclasses.asdict(job).items() if value != default[key]} == set(change)
        policy = new_policy(dataclasses.replace(job, width=8), job.env_kwargs)
        assert policy.contract.control_hz == job.control_hz
    Go1Env("trot", **ablation.CHANGED_WORLD).close()


def test_a_variants_gaits_are_taken_together():
    def record(task, condition, **metrics):
        return {"task": task, "condition": condition} | metrics

    records = [
        record("trot", "drawn", trials=20, succeeded=20, velocity_error=0.02),
        record("walk", "drawn", trials=20, succeeded=10, velocity_error=0.04),
        record("trot", "to walk", trials=3, succeeded=1, velocity_error=0.9),
        record("walk", "changed world", trials=5, succeeded=4, velocity_error=0.9),
        record("walk", "in hands", trials=20, succeeded=17, velocity_error=0.9),
        record("trot", "held out", r2=0.9),
        record("walk", "held out", r2=0.8),
    ]
    found = ablation.aggregate_variant(ablation.Group(records))
    assert (found["success"], found["transitions"], found["changed"]) == ((30, 40), (1, 3), (4, 5))
    assert found["hands"] == (17, 20)
    assert found["error"] == pytest.approx(0.03) and found["r2"] == pytest.approx(0.85)


# -- DAgger against cloning --------------------------------------------------------------------------------------------

TINY_BUDGET = dataclasses.replace(
    budget.Budget.quick,
    job=dataclasses.replace(budget.Budget.quick.job, tasks=("trot",), shard_s=1.0, clone_steps=5, episode_s=0.5),
    budgets_s=(1.0, 2.0, 4.0),
)


def trainings(name, folder):
    return budget.Trainings(name, TINY_BUDGET, 0, folder)


@pytest.mark.parametrize("budgets", [(), (15.0, 45.0), (20.0, 40.0), (7.5, 15.0)])
def test_budgets_are_whole_shards_and_double(budgets):
    with pytest.raises(InvalidInputError, match="twice"):
        budget.BudgetOptions(budgets_s=budgets)


def test_nobody_is_perturbed_but_as_said_and_budgets_are_nested():
    options = budget.BudgetOptions()
    small, large = (options.demonstrations(1, True, seconds) for seconds in (15.0, 60.0))
    assert len(small) == 6 and len(large) == 24 and large[:6] == small
    assert all(job.perturbation.noise_rad == 0.06 and "randomization" not in job.env_kwargs for job in large)
    clean, other = options.demonstrations(1, False, 60.0), options.demonstrations(0, False, 60.0)
    assert all(job.perturbation is None for job in clean)
    assert len({(job.task, job.seed) for job in (*large, *clean, *other)}) == 72


def test_every_policy_starts_from_the_same_weights_and_sees_its_budget(tmp_path, monkeypatch):
    begun, seen, fit = [], [], trainers.BCTrainer.fit

    def watched(self, dataset, *args, **kwargs):
        begun.append({name: value.clone() for name, value in self.policy.actor.state_dict().items()})
        seen.append(len(dataset))
        return fit(self, dataset, *args, **kwargs)

    monkeypatch.setattr(trainers.BCTrainer, "fit", watched)
    initial = new_policy(TINY_BUDGET.job, TINY_BUDGET.job.env_kwargs).actor.state_dict()
    for name in ("clean BC", "DAgger"):
        for _ in trainings(name, tmp_path):
            pass
    assert seen == 2 * [50, 100, 200]
    for weights in begun:
        assert all(torch.equal(weights[name], initial[name]) for name in initial)


def test_who_drove_and_fell_is_counted_and_finished_policies_are_read(tmp_path):
    found = {name: [own for _, _, own in trainings(name, tmp_path)] for name in ("clean BC", "DAgger")}
    assert found["clean BC"] == 3 * [{"falls": 0, "learner_fraction": 0.0}]
    assert [own["learner_fraction"] for own in found["DAgger"]] == [0.0, 0.5, 0.75]
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}
    assert [own for _, _, own in trainings("DAgger", tmp_path)] == found["DAgger"]
    assert kept == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}


# -- Without a clock ---------------------------------------------------------------------------------------------------

TINY_JOB = dataclasses.replace(phase_free.PhaseFree.quick.job, clean_s=1.0, perturbed_s=1.0, shard_s=1.0, clone_steps=3)
TURNS = np.array([0.0, 0.1, 0.25, 0.7, 0.95])


def circle(turns):
    angle = 2 * np.pi * np.asarray(turns)
    return np.stack([np.sin(angle), np.cos(angle)], axis=1).astype(np.float32)


def rows_at(turns):
    """Rows of these phases, zero but for the first task's id."""
    contract = new_policy(TINY_JOB, TINY_JOB.env_kwargs).contract
    layout = contract.layout
    obs = np.zeros((len(turns), layout.size))
    obs[:, layout.slices["phase"]] = circle(turns)
    obs[:, layout.slices["task"].start] = 1.0
    return trainers.Demonstrations(obs, np.zeros((len(turns), 12)), np.arange(len(turns)) == 0, contract)


def test_the_error_is_that_of_the_estimate():
    late = phase.phase_error(lambda rows: circle(TURNS + [0, 0, 0, 0, 0.2]), rows_at(TURNS))
    assert late["median"] == pytest.approx(0.0, abs=1e-6) and late["p99"] == pytest.approx(0.96 * 0.2, abs=1e-6)


def test_the_phase_is_asked_for_as_two_joints_that_are_cut_off_later():
    job = dataclasses.replace(TINY_JOB, channels=phase_free.FELT)
    rows = rows_at(TURNS)
    seen = rows.select(job.channels, job.history)
    policy, asked = phase.ask_for_phase(new_policy(job, job.env_kwargs), seen, phase.phase_of(rows))
    assert policy.action_space.shape == (14,) and asked.acts.shape == (5, 14)
    np.testing.assert_array_equal(asked.acts[:, 12:], circle(TURNS))
    np.testing.assert_array_equal(asked.half_range[12:], [phase.PHASE_RAD] * 2)
    with torch.no_grad():
        for weight in policy.actor.parameters():
            weight.normal_(0.0, 0.2)
    policy.fit_normalization(asked.obs, asked.acts)
    small = phase.without_asked(policy)
    assert small.contract == seen.contract and small.env_kwargs["channels"] == phase_free.FELT
    whole = policy.predict(seen.obs, deterministic=True)[0]
    np.testing.assert_allclose(small.predict(seen.obs, deterministic=True)[0], whole[:, :12], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(phase.asked_phase(policy)(rows), axis=1), 1.0, atol=1e-6)


def test_finished_policies_are_measured_with_each_correction_and_others_refused():
    study = phase_free.PhaseFree(phase_free.PhaseFree.full)
    assert [agent.name for agent in study.agents()][-2:] == ["phase_free, correction 1", "phase_free, correction 0.2"]
    with pytest.raises(InvalidInputError, match="PhaseFreePolicy"):
        dataclasses.replace(study, policies=(shipped("clocked", "clocked"),)).agents()
    policy = shipped("a", "phase_free").load().with_correction(0.3)
    assert policy.correction == 0.3 and Agent("a").load() == "a"
