"""The expert's report card: its searches and figures by hand, and a quick run of everything."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from go1_mtl_gym import TASKS, Gait, InvalidInputError, robot
from go1_mtl_gym.env import Go1Env

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

import report_expert  # noqa: E402
from expert_report import bars as expert_bars  # noqa: E402
from expert_report import lab as expert_lab  # noqa: E402
from expert_report import limits as expert_limits  # noqa: E402
from expert_report import page as expert_page  # noqa: E402
from expert_report import parts as expert_parts  # noqa: E402
from expert_report import steady as expert_steady  # noqa: E402
from expert_report import timing as expert_timing  # noqa: E402

CARD = ROOT / "docs" / "results" / "expert.json"
HOP = Gait("hop", period=0.4, duty=0.5, offsets=(0.0, 0.0, 0.0, 0.0))


# -- The lab -----------------------------------------------------------------------------------------------------------


class Faulty:
    """An expert whose third answer is NaN and whose fourth is an exception."""

    def __init__(self, gains, hold_s):
        self.counters = dataclasses.replace(expert_lab.experts.NMPCExpert().counters)
        self.calls = 0

    def reset(self, state):
        self.counters.iterations = 0

    def action(self, state):
        self.calls += 1
        self.counters.iterations += 7
        if self.calls == 4:
            raise ZeroDivisionError
        return robot.HOME_POSE * (np.nan if self.calls == 3 else 1.0)


def test_every_bad_answer_is_counted_and_the_walk_goes_on():
    lab = expert_lab.Lab(make_expert=Faulty)
    lab.begin("trot", (0.0, 0.0, 0.0))
    assert lab.walk(0.1)
    lab.begin("trot", (0.0, 0.0, 0.0), "again")
    assert lab.walk(0.1)
    ledger = lab.settle()
    assert (ledger.calls, ledger.bad_actions, ledger.unhandled, ledger.iterations) == (10, 1, 1, 70)
    assert lab.settle().iterations == 70, "counted once"
    total = expert_lab.Ledger(calls=5)
    total.add(ledger)
    assert total.calls == 15 and total.unhandled == 1


def test_the_course_accepts_what_the_environment_refuses():
    fast = (2.4, 0.0, 0.0)
    with pytest.raises(InvalidInputError):
        Go1Env("trot").reset(seed=0, options={"command": fast})
    course = expert_lab.Course("trot")
    _, info = course.reset(seed=0, options={"command": fast})
    assert info["command"].tolist() == list(fast) and info["task"] == "trot"
    assert course.step(np.zeros(12))[4]["filtered_command"][0] > 0.0
    course.reset(seed=0)
    assert (np.abs(course.step(np.zeros(12))[4]["command"]) <= TASKS["trot"].command_range).all()


def test_a_lab_that_was_used_before_gives_the_same_walk():
    fresh, used = expert_lab.Lab(), expert_lab.Lab()
    used.begin("jump", (0.2, 0.1, 0.3), "first")
    used.walk(0.5)
    ends = []
    for lab in (fresh, used):
        lab.begin("trot", (0.4, 0.0, 0.0), "second")
        assert lab.walk(0.5)
        ends.append(lab.env.simulation.snapshot())
    np.testing.assert_array_equal(*ends)


# -- Searches ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("falls_from", "tracks_to", "survived", "tracked", "at_cap"),
    [(1.65, 1.25, 1.6, 1.2, False), (9.0, 9.0, 2.5, 2.5, True), (0.55, 0.35, 0.4, 0.2, False), (0.0, 0.0, 0, 0, False)],
)
def test_the_largest_command_is_found(monkeypatch, falls_from, tracks_to, survived, tracked, at_cap):
    def episodes(lab, task, axis, level, trials, config, seed):
        return None if level >= falls_from else (0.1 if level <= tracks_to else 0.2, 0.1)

    monkeypatch.setattr(expert_limits, "_episodes", episodes)
    found = expert_limits.limits(None, "trot", expert_limits.LimitsConfig(axes=("vx",)), 0)["vx"]
    assert found["survived"] == pytest.approx(survived) and found["tracked"] == pytest.approx(tracked)
    assert found["at_cap"] == at_cap


def test_scouts_that_survive_are_not_enough(monkeypatch):
    tried = []

    def episodes(lab, task, axis, level, trials, config, seed):
        tried.append((level, trials))
        return None if level > (1.0 if trials == 20 else 1.45) else (0.0, 0.0)

    monkeypatch.setattr(expert_limits, "_episodes", episodes)
    assert expert_limits.limits(None, "trot", expert_limits.LimitsConfig(axes=("vx",)), 0)["vx"]["survived"] == 1.0
    assert tried[-3:] == [(1.4, 20), (1.2, 20), (1.0, 20)]


@pytest.mark.parametrize(("falls_above", "largest"), [(1.23, 1.2), (0.6, 0.6), (0.35, 0.3), (0.0, 0.0), (99.0, 4.6)])
def test_the_largest_kick_is_found(monkeypatch, falls_above, largest):
    monkeypatch.setattr(expert_limits, "_withstands", lambda lab, task, direction, size, *_: size <= falls_above)
    found = expert_limits.pushes(None, "trot", expert_limits.PushConfig(), 0)
    assert found["left"] == found["lateral"] == found["fore_aft"] == pytest.approx(largest)


def test_a_kick_comes_at_its_phase_and_in_its_direction(monkeypatch):
    lab = expert_lab.Lab()
    kicks = []
    monkeypatch.setattr(lab.env, "push", lambda delta: kicks.append((lab.env.state.phase, delta)))
    config = expert_limits.PushConfig(before_s=0.2, after_s=0.02)
    for k in range(8):
        assert expert_limits._push_speed(lab, "trot", "left", 0.5, k, config, 0)
    pace = lab.env.control_s / TASKS["trot"].gait.period
    assert len(kicks) == 8 and all((phase - k / 8 + 1e-6) % 1.0 < pace for k, (phase, _) in enumerate(kicks))
    for _, delta in kicks:
        np.testing.assert_allclose(delta, (0.0, 0.5, 0.0), atol=0.05)


# -- Figures by hand ---------------------------------------------------------------------------------------------------


def test_contacts_that_are_late_by_20_ms():
    phase = np.mod(np.arange(4000) / 400 + 1e-9, 1.0)
    contacts = HOP.stance(np.mod(phase - 20 / 400, 1.0))
    figures = expert_steady.contact_figures(contacts, phase, HOP)
    assert figures["touchdown_lag_s"] == figures["liftoff_lag_s"] == pytest.approx(0.020)
    assert figures["contact_agreement"] == pytest.approx(0.9)
    assert figures["flight_share"] == figures["planned_flight_share"] == pytest.approx(0.5)
    legs = expert_steady.contact_intervals(contacts, phase, HOP, cycles=2)
    assert legs[0] == [[0.05, 0.55], [1.05, 1.55]] and len(legs) == 4


def test_effort_and_errors_of_a_made_up_walk():
    n = 1000
    series = {
        "torque": np.full((n, 12), 10.0),
        "joint_velocity": np.tile([1.0, -1.0], (n, 6)),
        "velocity": np.tile([0.5, 0.0, 0.1], (n, 1)),
        "wanted": np.tile([0.4, 0.0, 0.0], (n, 1)),
        "rpy": np.radians(np.linspace([-2.0, -3.0, 0.0], [4.0, 5.0, 0.0], n)),
        "height": np.full(n, 0.3),
    }
    series["torque"][: n // 2, 2] = robot.TORQUE_LIMIT[2]
    figures = expert_steady.body_figures(series)
    assert figures["saturated_share"] == pytest.approx(1 / 24)
    power = 120 + (robot.TORQUE_LIMIT[2] - 10) / 2
    assert figures["power_w"] == pytest.approx(power)
    assert figures["cost_of_transport"] == pytest.approx(power / (robot.MASS * robot.GRAVITY * 0.5))
    assert figures["rms_velocity_error"] == pytest.approx(0.1) and figures["rms_yaw_rate_error"] == pytest.approx(0.1)
    np.testing.assert_allclose(figures["roll_deg"] + figures["pitch_deg"], [-2, 4, -3, 5])


def test_the_recorder_sees_every_millisecond_and_leaves_no_trace():
    lab = expert_lab.Lab()
    lab.begin("trot", (0.0, 0.0, 0.0))
    with expert_steady.Recorder(lab) as recorder:
        lab.step()
    series = recorder.series(0.0)
    assert series["torque"].shape == (20, 12) and series["contacts"].shape == (20, 4)
    assert series["phase"][-1] == pytest.approx(lab.env.state.phase)
    lab.step()
    assert len(recorder.series(0.0)["phase"]) == 20


def test_calls_are_timed_in_turns():
    order = []
    calls = {"a": lambda state: order.append(("a", state)), "b": lambda state: (order.append(("b", state)), 1.5)[1]}
    times = expert_timing.interleaved(calls, [0, 1])
    assert order == [("a", 0), ("b", 0), ("a", 1), ("b", 1)]
    assert times["b"].tolist() == [1.5, 1.5] and (times["a"] < 1.0).all()
    assert expert_timing.quantiles(times["b"]) == {"median": 1500.0, "p99": 1500.0}


# -- Bars and page -----------------------------------------------------------------------------------------------------


def card(**limits):
    axes = {name: {"survived": value, "tracked": value, "at_cap": False} for name, value in limits.items()}
    return {
        "tasks": {"trot": {"velocity_error": 0.031, "success_rate": 1.0, "episodes": [{}] * 20}},
        "report": {"limits": {"trot": axes}, "pushes": {"trot": {"lateral": 1.6}}},
    }


def test_bars_are_passed_or_missed_honestly():
    passed = {row["figure"]: row["passed"] for row in expert_bars.compare(card(vx=1.9, vy=0.6, yaw=2.5))}
    assert passed == {"vx": False, "vy": True, "yaw": True, "error": False, "lateral": True}


def test_the_card_marks_what_misses():
    row = expert_page.card_table(card(vx=1.9, vy=0.6)).splitlines()[-1]
    assert row == "| trot | 20/20 | 0.031 (> 0.03) | -, 1.9 (< 2) | 0.6 | - | 1.6 | - | - | - | - |"


# -- The run -----------------------------------------------------------------------------------------------------------


def run(folder, *more):
    out = folder / "expert.json"
    arguments = ["--quick", "--tasks", "trot", "--n-jobs", "1", "--parts", str(folder / "parts"), "--out", str(out)]
    assert report_expert.main([*arguments, *more]) == 0
    return json.loads(out.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    return folder, run(folder)


@pytest.mark.slow
def test_a_quick_run_measures_everything(quick):
    folder, scores = quick
    assert set(scores["report"]) == {"changing", *expert_parts.SECTIONS} - {"survival"}
    assert all(list(own) == ["trot"] for own in scores["report"].values())
    assert scores["tasks"]["trot"]["survival_rate"] == 1.0
    assert scores["report"]["limits"]["trot"]["vx"]["survived"] == pytest.approx(1.0)
    assert scores["report"]["steady"]["trot"]["cruise"]["contact_agreement"] > 0.8
    assert scores["totals"]["unhandled"] == scores["totals"]["bad_actions"] == 0 and scores["totals"]["calls"] > 2000
    assert not scores["totals"]["passed"], "a million steps were not walked"
    assert {"mujoco", "osqp", "pin"} <= set(scores["versions"]) and scores["seed"] == 1
    assert str(folder) not in (folder / "expert.json").read_text(encoding="utf-8"), "no path of the machine"
    for name in ("limits", "pushes", "contacts"):
        assert (folder / f"expert_{name}.png").stat().st_size > 5000


@pytest.mark.slow
def test_finished_parts_are_not_measured_again_and_equal_seeds_give_equal_figures(quick, monkeypatch):
    folder, scores = quick
    removed = next((folder / "parts").glob("steady-trot-*.json"))
    before = json.loads(removed.read_text())
    removed.unlink()
    assert run(folder)["report"] == scores["report"]
    after = json.loads(removed.read_text())
    assert after["figures"] == before["figures"] and after["ledger"] == before["ledger"]
    monkeypatch.setattr(expert_parts, "Lab", None)
    assert run(folder)["report"] == scores["report"]


@pytest.mark.slow
def test_the_page_shows_every_section(quick):
    folder, scores = quick
    pictures = [name for name in expert_page.PICTURES if (folder / f"expert_{name}.png").is_file()]
    page = "\n\n".join(expert_page.expert_section(scores, "Made by hand.", pictures))
    for title in ("prototype", "Largest commands", "Kicks", "Steady walking", "Settings compared", "Time", "long walk"):
        assert title in page
    assert "](expert_contacts.png)" in page and "**miss**" in page and "1000000 steps" in page


@pytest.mark.parametrize("task", json.loads(CARD.read_text())["tasks"])
def test_the_environment_accepts_what_the_published_card_says_is_survived(task):
    axes = json.loads(CARD.read_text())["report"]["limits"][task]
    survived = {axis: figures["survived"] for axis, figures in axes.items()}
    ahead = min(survived["vx"], survived["-vx"])
    assert TASKS[task].command_limit == (ahead, survived["vy"], survived["yaw"])


def test_a_part_has_another_name_when_anything_else_is_measured(tmp_path):
    section = expert_parts.SECTIONS["pushes"]
    part = expert_parts.Part("pushes", "trot", section, 1, 50, tmp_path)
    other = dataclasses.replace(section, config=expert_limits.PushConfig(phases=4))
    changes = ({"seed": 2}, {"control_hz": 100}, {"section": other})
    assert len({part.path, *(dataclasses.replace(part, **change).path for change in changes)}) == 4
    assert part.path == dataclasses.replace(part).path


@pytest.mark.parametrize(
    "option", ["--seed -1", "--n-jobs 0", "--soak-steps -5", "--control-hz 300", "--tasks bound bound"]
)
def test_impossible_settings_are_refused(option, tmp_path, capsys):
    out = tmp_path / "expert.json"
    arguments = ["--tasks", "trot", "--sections", "soak", "--parts", str(tmp_path / "parts"), "--out", str(out)]
    assert report_expert.main(["--n-jobs", "1", *arguments, *option.split()]) == 2
    assert option.split()[1] in capsys.readouterr().err and not out.exists()
