"""Certificates on a scripted environment: verdicts, causes, files that go on, pairs, films."""

import json
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import trainers
from go1_mtl_gym import PAPER_TASKS, TASKS
from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import HIPS, THIGHS, StubEnv
from trainers import Certificate, Condition, certify
from trainers.cli.program import run
from trainers.data.environments import ExpertAccess
from trainers.evaluation.agents import identity
from trainers.evaluation.conditions import CONDITIONS
from trainers.evaluation.stopping import FEWEST

REACH = 4.0
"""Velocity of the robot at an action of 1; every command is within it."""


class HandledEnv(StubEnv):
    """A stub that hands can drive, as fast as any gait is asked to."""

    def __init__(self, task="trot", **env_kwargs):
        super().__init__(task, **env_kwargs)
        self.config = SimpleNamespace(episode_s=env_kwargs["episode_s"])

    @property
    def state(self):
        return SimpleNamespace(**vars(super().state), rpy=np.zeros(3))

    def info(self, fallen):
        return super().info(fallen) | {"base_velocity": REACH * self.last_action[HIPS]}


def make_handled(task, perturbation=None, **env_kwargs):
    return ExpertAccess(HandledEnv(task, **env_kwargs))


class Stepping:
    """Tracks, and steps in whichever gait the task id says."""

    env_kwargs = {"tasks": PAPER_TASKS}

    def predict(self, obs, deterministic=False):
        gait = TASKS[PAPER_TASKS[int(obs[-4:].argmax())]].gait
        phase = np.arctan2(*obs[37:39]) / (2 * np.pi)
        action = np.zeros(12)
        action[HIPS], action[THIGHS] = obs[34:37] / REACH, 0.9 * np.sin(2 * np.pi * (phase + np.array(gait.offsets)))
        return self.changed(action, obs).astype(np.float32), None

    def changed(self, action, obs):
        return action


class FallingWhenLetGo(Stepping):
    def changed(self, action, obs):
        begun = obs[39:51].any()  # the last action
        action[2] = 1.0 if begun and np.abs(obs[34:37]).max() < 1e-3 else action[2]
        return action


class Backward(Stepping):
    """Falls as soon as it is to go backward."""

    def changed(self, action, obs):
        action[2] = 1.0 if obs[34] < -0.1 else action[2]
        return action


SHORT = {"seconds": 4.0, "tour_seconds": 6.0, "make_env": make_handled, "tasks": ("trot", "walk")}
FEW = {**SHORT, "claim": 0.5, "allowed_failures": 0}  # five episodes without a failure


@pytest.fixture(scope="module")
def fallen():
    return certify(FallingWhenLetGo(), conditions=("operator",), episodes=40, reference=Stepping(), **SHORT)


def test_a_policy_that_never_fails_stops_where_its_claim_is_met():
    certificate = certify(
        Stepping(),
        conditions=(
            Condition("commanded", "drawn commands", operator=None),
            Condition("careful", "careful", claim=0.3),
        ),
        **FEW,
    )
    assert [cell.name for cell in certificate.cells] == [
        "commanded/trot",
        "commanded/walk",
        "careful/trot",
        "careful/walk",
    ]
    assert [cell.trials for cell in certificate.cells] == [5, 5, 3, 3] and certificate.met
    assert {cell.verdict for cell in certificate.cells} == {"met"}
    assert certificate.cell("commanded", "walk").lower_bound == pytest.approx(0.05 ** (1 / 5))
    assert 0.5**5 < 0.05 < 0.5**4 and 0.3**3 < 0.05 < 0.3**2


def test_a_policy_that_often_fails_is_done_early_and_the_causes_are_told(fallen):
    for cell in fallen.cells:
        assert cell.verdict == "refuted" and cell.trials == FEWEST
        assert cell.outcomes.count("f") == len(cell.failures) == cell.trials - cell.survived > 1
        assert {failure.cause.doing for failure in cell.failures} <= {"standing", "braking"}
        assert {failure.cause.what for failure in cell.failures} == {"fell"}
        assert all(failure.cause.task == cell.task for failure in cell.failures)
    assert not fallen.met


def test_pairs_are_the_same_episodes(fallen):
    cell = fallen.cell("operator", "trot")
    alone = certify(Stepping(), conditions=("operator",), episodes=cell.trials, **SHORT)
    assert cell.reference == alone.cell("operator", "trot").outcomes == "s" * cell.trials
    falls = len(cell.failures)
    pairs = {"both": cell.trials - falls, "only_policy": 0, "only_reference": falls, "neither": 0}
    assert cell.paired == {**pairs, "p_value": pytest.approx(2 * 0.5**falls)}


def test_a_certificate_is_json_and_a_page(fallen):
    again = Certificate.from_dict(json.loads(json.dumps(fallen.as_dict(), allow_nan=False)))
    assert again == fallen and again.markdown() == fallen.markdown()
    page = fallen.markdown()
    cell = fallen.cell("operator", "trot")
    assert page.startswith("# Certificate of FallingWhenLetGo") and f"**{cell.passed}/{cell.trials}**" in page
    assert f"`operator/trot/{cell.failures[0].number}`" in page and "McNemar" in page
    for table in page.split("\n\n"):
        if table.startswith("|"):
            assert len({line.count("|") for line in table.splitlines()}) == 1


def test_episodes_depend_on_seed_gait_and_number_alone():
    both = certify(FallingWhenLetGo(), conditions=("operator", "tour"), episodes=6, tours=4, stop_early=False, **SHORT)
    alone = certify(FallingWhenLetGo(), conditions=("operator",), episodes=3, stop_early=False, **SHORT)
    assert both.cell("operator", "walk").outcomes[:3] == alone.cell("operator", "walk").outcomes
    other = certify(FallingWhenLetGo(), conditions=("operator",), episodes=6, seed=2, stop_early=False, **SHORT)
    seeds = [[each.seed for each in c.cell("operator", "trot").failures] for c in (both, other)]
    assert not set(seeds[0]) & set(seeds[1])


def test_tours_begin_in_every_gait_and_are_judged_by_survival():
    class Lazy(Stepping):
        def changed(self, action, obs):
            action[THIGHS] = 0.0
            return action

    certificate = certify(Lazy(), conditions=("tour", "drawn"), episodes=2, tours=4, **SHORT)
    tours = certificate.cell("tour", "all gaits")
    assert tours.outcomes == "uuuu" and tours.failures == () and tours.succeeded == 0
    drawn = certificate.cell("drawn", "trot")
    assert drawn.outcomes == "uu" and {failure.cause.what for failure in drawn.failures} == {"did not step"}
    starts = [certificate.settings.setup(CONDITIONS["tour"], "all gaits", i).task for i in range(4)]
    assert starts == list(PAPER_TASKS)


def test_nobody_touches_the_stick_of_a_robot_that_is_to_stand():
    seen = []

    class Nervous(Stepping):
        """Makes a step whenever it is told to stand."""

        def changed(self, action, obs):
            seen.append(obs[34:37])
            action[THIGHS] = 0.9 * np.sin(2 * np.pi * len(seen) / 40)
            return action

    cell = certify(Nervous(), conditions=("standing",), episodes=3, **SHORT | {"tasks": ("trot",)}).cells[0]
    assert cell.outcomes == "uuu" and cell.passed == 3 and cell.failures == (), "a step is no fall"
    assert not np.any(seen) and cell.plan.claim == 0.95
    assert CONDITIONS["standing"].operator.push_interval == 10.0
    assert [*CONDITIONS][:3] == ["operator", "drawn", "standing"]


def test_the_page_says_what_is_judged_by_survival():
    certificate = certify(Stepping(), conditions=("standing", "drawn", "tour"), episodes=1, tours=1, **SHORT)
    page = certificate.markdown()
    assert "Judged by survival: nobody touches the stick, tours of all gaits." in page
    alone = certify(Stepping(), conditions=("drawn",), episodes=1, **SHORT)
    assert "Judged by survival" not in alone.markdown()


def test_a_world_is_a_line_and_reaches_the_environment():
    seen = []

    def make_seen(task, perturbation=None, **env_kwargs):
        seen.append(env_kwargs)
        return make_handled(task, **env_kwargs)

    heavy = Condition("heavy", "payload 7 kg", operator=None, env_kwargs={"payload_kg": 7.0})
    certify(Stepping(), conditions=("noise", heavy), episodes=1, **SHORT | {"make_env": make_seen}, friction=0.5)
    assert [kwargs.get("payload_kg") for kwargs in seen] == [None, None, 7.0, 7.0]
    assert all(kwargs["friction"] == 0.5 for kwargs in seen) and seen[0]["noise"]["q"] == 0.01
    assert heavy == Condition(**json.loads(json.dumps(heavy.as_dict())))


# -- Folders -----------------------------------------------------------------------------------------------------------


class Interrupted(Stepping):
    """Is stopped by Ctrl-C in its second gait."""

    walks = 0
    allowed = 0

    def changed(self, action, obs):
        self.walks += bool(obs[-1])
        if self.walks > self.allowed:
            raise KeyboardInterrupt
        return action


def test_an_interrupted_certificate_keeps_its_finished_cells(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        certify(Interrupted(), tmp_path, conditions=("drawn",), **FEW)
    assert [cell.name for cell in Certificate.read(tmp_path).cells] == ["drawn/trot"]
    seen = []

    def make_seen(task, perturbation=None, **env_kwargs):
        seen.append(task)
        return make_handled(task, **env_kwargs)

    patient = Interrupted()
    patient.allowed = 10**9
    done = certify(patient, tmp_path, conditions=("operator", "drawn"), **FEW | {"make_env": make_seen})
    assert seen[: len(seen) // 2] and seen.count("walk") > seen.count("trot") > 0, "trot with drawn commands was there"
    assert [cell.name for cell in done.cells] == ["operator/trot", "operator/walk", "drawn/trot", "drawn/walk"]
    assert Certificate.read(tmp_path / "certificate.json") == done
    assert (tmp_path / "certificate.md").read_text(encoding="utf-8") == done.markdown()


def test_two_processes_do_not_write_one_certificate(tmp_path):
    lock = "import filelock, sys; a = filelock.FileLock(sys.argv[1]); a.acquire(); print(flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", lock, str(tmp_path / ".lock")], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        other.stdout.readline()
        with pytest.raises(InvalidInputError, match="another process is at work in"):
            certify(Stepping(), tmp_path, conditions=("drawn",), **FEW)
        assert not (tmp_path / "certificate.json").exists()
    assert certify(Stepping(), tmp_path, conditions=("drawn",), **FEW).cells


@pytest.mark.parametrize(
    ("agent", "changed", "message"),
    [
        (FallingWhenLetGo, {}, "policy"),
        (Stepping, {"seed": 5}, "seed was 1, now 5"),
        (Stepping, {"friction": 0.3}, "friction"),
        (Stepping, {"reference": Backward()}, "reference"),
        (Stepping, {"conditions": (Condition("drawn", "something else"),)}, "condition 'drawn'"),
    ],
)
def test_another_certificates_folder_is_refused(tmp_path, agent, changed, message):
    certify(Stepping(), tmp_path, conditions=("drawn",), **FEW)
    before = (tmp_path / "certificate.json").read_bytes()
    with pytest.raises(InvalidInputError, match=message):
        certify(agent(), tmp_path, **{"conditions": ("drawn",), **FEW, **changed})
    assert (tmp_path / "certificate.json").read_bytes() == before


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"conditions": ("storm",)}, "condition"),
        ({"conditions": ("drawn", "drawn")}, "differ"),
        ({"conditions": ()}, "sequence"),
        ({"tasks": ("canter",)}, "task"),
        ({"tasks": ("pace",)}, "task that the policy knows"),
        ({"claim": 1.5}, "claim"),
        ({"episode_s": 3.0}, "episode_s"),
        ({"n_jobs": 0}, "n_jobs"),
        ({"reference": trainers.load_pretrained, "conditions": ("tour",)}, "expected something"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_driven(wrong, message):
    def never(*_, **__):
        raise AssertionError("driven")

    with pytest.raises(InvalidInputError, match=message):
        certify(Stepping(), **{**SHORT, "make_env": never} | wrong)


def test_a_file_that_is_no_certificate_is_refused(tmp_path):
    (tmp_path / "certificate.json").write_text('{"cells": []}', encoding="utf-8")
    with pytest.raises(InvalidInputError, match="certificate"):
        certify(Stepping(), tmp_path, conditions=("drawn",), **FEW)
    values = certify(Stepping(), conditions=("drawn",), **FEW).as_dict()
    for policy in ("clocked", {}, None):
        with pytest.raises(InvalidInputError, match="a certificate was expected"):
            Certificate.from_dict(values | {"policy": policy})


# -- Whom it takes -----------------------------------------------------------------------------------------------------


def test_policies_are_told_apart_by_what_they_do(policy, tmp_path):
    policy.save(tmp_path / "a.zip")
    before = identity(policy)
    assert identity(tmp_path / "a.zip")["name"] == "a.zip" and identity("clocked")["name"] == "clocked"
    assert identity("expert")["name"] == "expert"
    next(policy.parameters()).data.add_(1.0)
    assert identity(policy)["sha256"] != before["sha256"]


def test_the_command_certifies_a_policy_of_the_package(tmp_path, capsys):
    words = ["certify", "clocked", "--out", str(tmp_path), "--tasks", "walk", "--conditions", "drawn"]
    few = ["--episodes", "1", "--seconds", "4"]
    assert run([*words, *few]) == 0
    assert "0 of 1 claims are met" in capsys.readouterr().out, "one episode shows nothing"
    certificate = Certificate.read(tmp_path)
    assert certificate.policy == identity("clocked") and certificate.cell("drawn", "walk").trials == 1
    assert run([*words, "--quick"]) == 2 and "choose another folder" in capsys.readouterr().err
    assert run(["certify", str(tmp_path / "none.zip"), "--out", str(tmp_path)]) == 2


@pytest.mark.gl
def test_any_episode_is_replayed(tmp_path):
    options = {"tasks": ("walk",), "conditions": ("operator",), "episodes": 1, "seconds": 3.0}
    certificate = certify("clocked", tmp_path, **options)
    size = {"fps": 5, "width": 48, "height": 32, "seconds": 1.0}
    frames = trainers.replay(tmp_path, "operator/walk/0", "clocked", **size)
    assert frames.shape == (10, 32, 48, 3) and frames.std() > 10
    np.testing.assert_array_equal(frames, trainers.replay(certificate.as_dict(), "operator/walk/0", "clocked", **size))
    for unknown in ("operator/trot/0", "operator/walk/1", "walk"):
        with pytest.raises(InvalidInputError):
            trainers.replay(certificate, unknown, "clocked")
