"""The student's report: its searches and tables by hand, and a quick run with students that fall at once."""

import dataclasses
import json
import math
import pickle
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import trainers
from go1_mtl_gym import TASKS, InvalidInputError, robot
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.estimator import EstimatorNoise
from go1_mtl_gym.observation import SensorNoise
from trainers.metrics import wilson_interval

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

import expert_limits  # noqa: E402
import publish_results  # noqa: E402
import report_parts  # noqa: E402
import report_student  # noqa: E402
import student_figures  # noqa: E402
import student_lab  # noqa: E402
import student_page  # noqa: E402
import student_parts  # noqa: E402
import student_pushes  # noqa: E402
import student_robustness  # noqa: E402

GAITS = ("trot", "walk")
HOME = ActionMap.for_gains(PDGains()).from_radians(robot.HOME_POSE)


class Idle:
    """A policy that stands."""

    env_kwargs = {"tasks": GAITS, "control_hz": 100}

    def predict(self, obs, deterministic=False):
        return HOME.astype(np.float32), None


def result(fallen, success, errors=None):
    """Closed loop with these episodes."""
    records = [
        trainers.EpisodeRecord(0, ((0.0, 0.0, 0.0),), 1.0, fell, error, 0.0, (0.0, 0.0, 0.0, 0.0), good)
        for fell, good, error in zip(fallen, success, errors or [0.1] * len(fallen))
    ]
    return trainers.ClosedLoopResult("trot", 1.0, tuple(records))


def level(survived, succeeded, value=1.0, trials=20):
    return {"value": value, "survived": survived, "succeeded": succeeded, "trials": trials}


def save_student(path, seed=0, **env_kwargs):
    """An untrained student of two gaits."""
    kwargs = {"tasks": GAITS, "channels": ("command",), **env_kwargs}
    env = Go1Env("trot", **kwargs)
    policy = trainers.MultiHeadPolicy(env.observation_space, env.action_space, width=8, env_kwargs=kwargs, seed=seed)
    policy.save(path)
    return path


@pytest.fixture(scope="module")
def student(tmp_path_factory):
    return save_student(tmp_path_factory.mktemp("student") / "policy.zip")


# -- Who walks ---------------------------------------------------------------------------------------------------------


def test_students_come_first_and_the_expert_walks_in_their_world(student):
    who = student_lab.walkers([f"mine={student}", str(student)])
    assert [walker.name for walker in who] == ["mine", "student", "expert"]
    assert who[-1].env_kwargs == {"tasks": GAITS} and who[-1].load() == "expert"
    assert who[0].sha256 == who[1].sha256 and len(who[0].sha256) == 64 and not who[-1].sha256
    assert isinstance(who[0].load(), trainers.MultiHeadPolicy)


def test_a_student_leaves_the_world_of_its_training(tmp_path):
    path = save_student(tmp_path / "policy.zip", noise=True, friction=0.5, history=2)
    policy = student_lab.walkers([str(path)])[0].load()
    assert policy.env_kwargs == {"tasks": GAITS, "channels": ("command",), "history": 2}


@pytest.mark.parametrize("names", [["", ""], ["expert="], ["="], ["a=", "a="]])
def test_names_that_say_nothing_are_refused(student, names):
    with pytest.raises(InvalidInputError, match="another name"):
        student_lab.walkers([name + str(student) for name in names])


def test_students_of_different_worlds_are_not_compared(student, tmp_path):
    other = save_student(tmp_path / "policy.zip", control_hz=100)
    with pytest.raises(InvalidInputError, match="control_hz"):
        student_lab.walkers([f"a={student}", f"b={other}"])


def test_the_summary_counts():
    found = student_lab.summary(
        result([False, False, True, False], [True, False, False, True], [0.1, 0.3, math.nan, 0.2])
    )
    assert (found["trials"], found["survived"], found["succeeded"]) == (4, 3, 2)
    assert (found["survival_rate"], found["success_rate"]) == (0.75, 0.5)
    assert found["velocity_error"] == pytest.approx(0.2)
    assert found["survival_interval"] == wilson_interval(3, 4) and found["success_interval"] == wilson_interval(2, 4)


# -- Sections ----------------------------------------------------------------------------------------------------------


def test_quantities_are_passed_on_one_by_one(monkeypatch):
    calls = []

    def evaluate(who, task, episodes, seconds, seed, **kwargs):
        calls.append((who, task, episodes, seconds, seed, kwargs))
        return result([False], [True])

    monkeypatch.setattr(trainers, "evaluate", evaluate)
    config = student_robustness.RobustnessConfig(episodes=3, every=2)
    found = student_robustness.robustness("expert", "walk", "friction", config, 7, kp=40.0)
    assert [own["value"] for own in found["levels"]] == [0.4, 0.7, 1.0]
    assert calls[1] == ("expert", "walk", 3, 10.0, 7, {"command_interval": 5.0, "kp": 40.0, "friction": 0.7})


def test_noise_is_the_sensors_or_the_estimators():
    assert student_robustness.world("noise", 1.0, Idle()) == {"noise": SensorNoise()}
    assert student_robustness.world("noise", 1.0, "expert") == {"estimator_noise": EstimatorNoise()}
    doubled = student_robustness.world("noise", 2.0, "expert")["estimator_noise"]
    assert (doubled.dq, doubled.height_bias, doubled.q_bias) == (0.5, 0.02, 0.0)
    none = student_robustness.world("noise", 0.0, Idle())["noise"]
    assert set(dataclasses.astuple(none)) == {0.0}


@pytest.mark.parametrize("quantity", student_robustness.QUANTITIES)
def test_the_environment_accepts_every_value(quantity):
    values = student_robustness.QUANTITIES[quantity].values
    assert len(values) == 5 and list(values) == sorted(set(values))
    for value in values:
        for who in (Idle(), "expert"):
            try:
                Go1Env("trot", **student_robustness.world(quantity, value, who)).close()
            except TypeError as error:
                pytest.skip(f"this environment knows no {quantity}: {error}")


def test_changes_of_gait_are_passed_on(monkeypatch):
    calls = []

    def evaluate_switch(who, first, second, trials=20, seed=1, **kwargs):
        calls.append((first, second, trials, seed, kwargs))
        return result([False] * 18 + [True] * 2, [True] * 15 + [False] * 5)

    monkeypatch.setattr(trainers, "evaluate_switch", evaluate_switch, raising=False)
    section = student_parts.SECTIONS["switching"]
    assert section.config.parts("walk", ("trot", "walk", "jump")) == ("trot", "jump")
    found = section.measure(Idle(), "walk", "trot", section.config, 3, kd=1.0)
    assert (found["trials"], found["survived"], found["succeeded"]) == (20, 18, 15)
    assert calls == [("walk", "trot", 20, 3, {"before_s": 2.0, "after_s": 6.0, "kd": 1.0})]


class Skittle:
    """An environment whose robot falls a while after a kick above a limit, which is lower in every tenth episode."""

    def __init__(self, limit, task, **kwargs):
        self.limit, self.kwargs, self.episodes, self.control_hz = limit, kwargs, 0, kwargs["control_hz"]
        self.unwrapped, self.state = self, SimpleNamespace(rpy=np.array([0.0, 0.0, np.pi / 2]))
        self.kicks, self.closed = [], False

    def reset(self, seed, options):
        self.episodes, self.steps, self.kicked_at = self.episodes + 1, 0, None
        assert options["command"] == (0.3, 0.0, 0.0)
        return np.zeros(1), {}

    def step(self, action):
        self.steps += 1
        fallen = self.kicked_at is not None and self.falls and self.steps > self.kicked_at + 20
        return np.zeros(1), 0.0, fallen, False, {}

    def push(self, delta):
        self.kicks.append((self.steps, delta))
        self.kicked_at, size = self.steps, np.linalg.norm(delta)
        self.falls = size > self.limit or (self.episodes % 10 == 0 and size > 0.5)

    def close(self):
        self.closed = True


@pytest.mark.parametrize(
    ("limit", "trials", "largest", "last"), [(1.1, 20, 1.0, 1.2), (9, 7, 0.4, 0.6), (0.1, 3, 0, 0.2)]
)
def test_the_largest_kick_is_below_the_first_that_too_few_survive(monkeypatch, limit, trials, largest, last):
    made = []
    monkeypatch.setattr(
        student_pushes, "make_env", lambda task, _, **kw: made.append(Skittle(limit, task, **kw)) or made[-1]
    )
    config = student_pushes.KickConfig(trials=trials)
    found = student_pushes.pushes(Idle(), "trot", "left", config, 0)
    assert found["largest"] == pytest.approx(largest) and not found["at_cap"] and made[0].closed
    assert [own["size"] for own in found["sizes"]] == pytest.approx(np.arange(1, round(last / 0.2) + 1) * 0.2)
    assert all(own["survived"] >= 0.9 * trials for own in found["sizes"][:-1])
    assert found["sizes"][-1]["survived"] < 0.9 * trials and made[0].episodes == trials * len(found["sizes"])


def test_kicks_come_at_random_phases_equal_for_all_sizes_and_in_the_heading_frame(monkeypatch):
    env = Skittle(9.0, "trot", control_hz=100)
    monkeypatch.setattr(student_pushes, "make_env", lambda *_, **__: env)
    config = student_pushes.KickConfig(trials=6, grid=2, after_s=0.1)
    found = student_pushes.pushes(Idle(), "trot", "left", config, 0)
    assert found["at_cap"] and found["largest"] == 0.4
    when = [steps for steps, _ in env.kicks]
    assert when[:6] == when[6:] and len(set(when)) > 2
    assert min(when) >= 150 and max(when) <= 150 + round(100 * TASKS["trot"].gait.period)
    np.testing.assert_allclose(env.kicks[0][1], (-0.2, 0.0, 0.0), atol=1e-12)  # left of a robot that looks along y


def test_a_fall_before_the_kick_is_no_survival(monkeypatch):
    env = Skittle(9.0, "trot", control_hz=100)
    monkeypatch.setattr(student_pushes, "make_env", lambda *_, **__: env)
    monkeypatch.setattr(env, "step", lambda action: (np.zeros(1), 0.0, True, False, {}))
    found = student_pushes.pushes(Idle(), "trot", "left", student_pushes.KickConfig(trials=2), 0)
    assert found == {"largest": 0.0, "at_cap": False, "sizes": [{"size": 0.2, "survived": 0, "trials": 2}]}
    assert not env.kicks


def test_a_stand_survives_a_nudge_and_no_blow():
    config = student_pushes.KickConfig(trials=1, step=0.1, grid=1, before_s=0.2, after_s=0.5)
    assert student_pushes.pushes(Idle(), "trot", "left", config, 0)["at_cap"]
    assert student_pushes.pushes(Idle(), "trot", "left", dataclasses.replace(config, step=9.0), 0)["largest"] == 0.0


def test_a_kick_to_the_left_goes_left():
    np.testing.assert_allclose(expert_limits.kick_w("left", 0.5, np.pi / 2), (-0.5, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(expert_limits.kick_w("backward", 2.0, 0.0), (-2.0, 0.0, 0.0), atol=1e-12)


# -- Parts -------------------------------------------------------------------------------------------------------------


def test_a_part_has_another_name_when_anything_else_is_measured(student, tmp_path):
    mine, expert = student_lab.walkers([f"mine={student}"])
    section = student_parts.SECTIONS["pushes"]
    part = student_parts.StudentPart("pushes", section, mine, "trot", "left", 1, tmp_path)
    changes = (
        {"seed": 2},
        {"what": "right"},
        {"task": "walk"},
        {"walker": expert},
        {"walker": dataclasses.replace(expert, env_kwargs={"tasks": GAITS, "kp": 40.0})},
        {"walker": dataclasses.replace(mine, sha256="0" * 64)},
        {"section": dataclasses.replace(section, config=section.quick)},
    )
    assert len({part.path, *(dataclasses.replace(part, **change).path for change in changes)}) == 8
    renamed = dataclasses.replace(part, walker=dataclasses.replace(mine, name="other"))
    assert part.path == renamed.path == pickle.loads(pickle.dumps(part)).path


def test_a_finished_part_is_not_measured_again(tmp_path):
    calls = []
    for _ in range(2):
        part = report_parts.finished(tmp_path / "p.json", lambda: calls.append(1) or {"figures": {"a": math.nan}})
        assert part["figures"] == {"a": None} and part["seconds"] >= 0.0
    assert calls == [1]


# -- Tables and figures ------------------------------------------------------------------------------------------------

ROBUST = {
    "mine": {
        "trot": {"friction": {"levels": [level(3, 1, 0.4), level(19, 18, 0.7), level(20, 20, 1.0)]}},
        "walk": {"friction": {"levels": [level(20, 20, 0.4), level(18, 17, 0.7), level(20, 20, 1.0)]}},
    },
    "expert": {"trot": {"friction": {"levels": [level(20, 20, 0.4), level(20, 20, 0.7), level(20, 20, 1.0)]}}},
}
KICKS = {
    "mine": {"trot": {"left": {"largest": 1.2, "at_cap": False}, "right": {"largest": 0.8, "at_cap": False}}},
    "expert": {"trot": {"left": {"largest": 5.0, "at_cap": True}}},
}
SWITCHES = {
    "mine": {"trot": {"walk": level(20, 18)}, "walk": {"trot": level(10, 9)}},
    "expert": {"trot": {"walk": level(20, 20)}, "walk": {"trot": level(20, 19)}},
}


def test_the_middle_of_a_range_is_held_against_95_per_cent():
    table = student_page.robustness_table(ROBUST).splitlines()
    assert table[0] == "|  | quantity | middle | trot | walk |"
    assert table[2:] == ["| mine | friction | 0.7 | 19/20, **18/20** | **18/20**, **17/20** |"]


def test_kicks_and_switches_have_a_row_each():
    assert student_page.push_table(KICKS).splitlines()[2:] == [
        "| trot | mine | 1.2 | 0.8 | - | - |",
        "| trot | expert | >= 5.0 | - | - | - |",
    ]
    assert student_page.switching_table(SWITCHES).splitlines()[2:4] == [
        "| mine | trot | - | 18/20 | 20/20 |",
        "| mine | walk | 9/20 | - | 10/20 |",
    ]


def test_figures_show_the_weaker_direction_and_the_weakest_gait():
    figure = student_figures.push_figure(KICKS)
    lateral, fore_aft = figure.axes
    assert [bar.get_height() for bar in lateral.patches] == [0.8, 5.0]
    assert [text.get_text() for text in lateral.texts + fore_aft.texts] == ["0.8", "5.0", "", ""]
    pooled, weakest = student_figures.robustness_figure(ROBUST).axes[0].lines[:2]
    np.testing.assert_allclose(pooled.get_ydata(), [23 / 40, 37 / 40, 1.0])
    np.testing.assert_allclose(weakest.get_ydata(), [3 / 20, 18 / 20, 1.0])
    texts = [text.get_text() for text in student_figures.switching_figure(SWITCHES).axes[0].texts]
    assert texts == ["18/20", "9/20"]


def test_every_section_has_a_figure_and_a_chapter():
    assert set(student_parts.SECTIONS) == set(student_figures.FIGURES) == set(student_page.CHAPTERS)


# -- The run -----------------------------------------------------------------------------------------------------------


def run(folder, student, *more):
    arguments = ["--quick", "--n-jobs", "1", "--parts", str(folder / "parts"), "--out-dir", str(folder / "out")]
    return report_student.main(["robustness", "pushes", "--policy", f"mine={student}", *arguments, *more])


def test_a_quick_run_writes_one_file_and_figure_per_section_and_goes_on(student, tmp_path, monkeypatch, capsys):
    only = ["--tasks", "trot", "--only", "friction", "left"]
    measure = student_pushes.pushes

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setitem(
        student_parts.SECTIONS, "pushes", dataclasses.replace(student_parts.SECTIONS["pushes"], measure=interrupted)
    )
    assert run(tmp_path, student, *only) == 130
    assert (tmp_path / "out" / "student_robustness.json").is_file() and "goes on" in capsys.readouterr().err
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").iterdir()}
    assert len(kept) == 2
    monkeypatch.setitem(
        student_parts.SECTIONS, "pushes", dataclasses.replace(student_parts.SECTIONS["pushes"], measure=measure)
    )
    assert run(tmp_path, student, *only) == 0
    assert kept.items() <= {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").iterdir()}.items()
    data = json.loads((tmp_path / "out" / "student_robustness.json").read_text())
    assert list(data["report"]) == ["mine", "expert"]
    levels = data["report"]["mine"]["trot"]["friction"]["levels"]
    assert [own["value"] for own in levels] == [0.4, 0.7, 1.0]
    assert data["report"]["expert"]["trot"]["friction"]["levels"][1]["survived"] == 1
    assert data["seed"] == 1 and "mujoco" in data["versions"] and data["seconds"]["robustness"] > 0.0
    assert data["policies"] == {"mine": student_lab.walkers([str(student)])[0].sha256}
    assert str(tmp_path / "parts") not in data["command"] and data["command"].startswith("python examples/report_st")
    for name in ("robustness", "pushes"):
        assert (tmp_path / "out" / f"student_{name}.png").stat().st_size > 5000
    page = "\n".join(publish_results.student_report(tmp_path / "out"))
    assert "### Another world" in page and "### Kicks" in page and "](student_pushes.png)" in page
    assert "on one core" in page and "Changes of gait" not in page


@pytest.mark.parametrize(
    "option", ["--seed -1", "--n-jobs 0", "--tasks jump", "--only mud", "--only left", "--tasks trot trot"]
)
def test_impossible_settings_are_refused(option, student, tmp_path, capsys):
    assert run(tmp_path, student, *option.split()) == 2
    assert "error: " in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_a_missing_policy_is_named(tmp_path, capsys):
    assert run(tmp_path, tmp_path / "nothing.zip") == 2
    assert "nothing.zip" in capsys.readouterr().err


def test_equal_seeds_give_equal_figures():
    config = student_robustness.RobustnessConfig(1, 2.5, 1.0, every=4)
    first, again, other = (student_robustness.robustness(Idle(), "trot", "noise", config, seed) for seed in (1, 1, 2))
    assert first == again and first["levels"][0]["velocity_error"] > 0.0
    assert first["levels"][0]["velocity_error"] != other["levels"][0]["velocity_error"]
