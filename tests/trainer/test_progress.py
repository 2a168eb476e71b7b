"""Where long work is: parts of a stage's one bar, guesses of time, and the sentences at the end."""

import time

import pytest

from trainers import JobConfig
from trainers.pipeline import forecast
from trainers.pipeline.stages import Stages, announced_if_slow
from trainers.pipeline.summary import SMOKE, summary, verdict
from trainers.utils.progress import Bar, reporting_to, tracked

SMALL = JobConfig.from_preset("smoke", tasks=("trot", "walk"), n_envs=1)


class Above:
    """Keeps what it is told."""

    def __init__(self):
        self.heard, self.figures = [], {}

    def advance(self, title, fraction):
        self.heard.append((title, fraction))

    def note(self, **figures):
        self.figures |= figures


def test_a_bar_inside_of_a_stage_tells_its_fraction(capsys):
    above = Above()
    with reporting_to(above), Bar("clone", 4) as bar:
        bar.update()
        bar.note(loss="1e-3")
        bar.update(2)
    assert above.heard == [("clone", 0.0), ("clone", 0.25), ("clone", 0.75), ("clone", 1.0)]
    assert above.figures == {"loss": "1e-3"} and capsys.readouterr() == ("", "")


def test_bars_inside_of_bars_are_shares_of_their_unit():
    above = Above()
    with reporting_to(above):
        for _ in tracked("ab", "baselines", 2):
            assert list(tracked([1, 2], "clone", 2)) == [1, 2]
    assert above.heard == [
        ("baselines", fraction) for fraction in (0.0, 0.0, 0.25, 0.5, 0.5, 0.75, 1.0)
    ] and above.heard == sorted(above.heard)


def test_a_bar_alone_is_shown_and_a_hidden_one_is_not(capsys):
    assert list(tracked(range(3), "walks", 3)) == [0, 1, 2]
    assert "walks: 100%" in capsys.readouterr().err
    above = Above()
    with reporting_to(above):
        assert list(tracked(range(3), "walks", 3, shown=False)) == [0, 1, 2]
    assert not above.heard and capsys.readouterr().err == ""


def test_an_error_does_not_count_as_done_and_leaves_nothing_behind(capsys):
    above = Above()
    with pytest.raises(KeyboardInterrupt), reporting_to(above):
        for _ in tracked(range(3), "walks", 3):
            raise KeyboardInterrupt
    assert ("walks", 1.0) not in above.heard
    list(tracked(range(1), "later", 1))
    assert "later: 100%" in capsys.readouterr().err and "later" not in dict(above.heard)


# -- Stages ------------------------------------------------------------------------------------------------------------


def test_the_stages_are_those_that_there_will_be():
    assert len(forecast.parts(JobConfig())) == 7
    assert list(forecast.parts(JobConfig.from_preset("paper"))) == [
        "demonstrations", "clone", "baselines", "evaluation", "pictures"
    ]  # fmt: skip
    more = forecast.parts(SMALL.with_options(episodes=20))["evaluation"]["evaluate"]
    less = forecast.parts(SMALL.with_options(episodes=2))["evaluation"]["evaluate"]
    assert more[0] == less[0] and more[1] == pytest.approx(10 * less[1])


def test_the_guess_is_corrected_by_what_is_done():
    expected = {"one": 10.0, "two": 20.0, "three": 30.0}
    assert forecast.left_s(expected, {}, ["two", "three"]) == 50.0
    assert forecast.left_s(expected, {"one": 30.0}, ["two", "three"]) == 150.0
    assert forecast.left_s(expected, {"one": 10.0, "two": 50.0, "unknown": 9.0}, ["three"]) == 60.0


def test_the_guess_of_the_published_run_is_near_its_wall_times():
    import json
    from pathlib import Path

    root = Path(__file__).resolve().parents[2]
    published = json.loads((root / "docs" / "results" / "main_job.json").read_text(encoding="utf-8"))
    parts = forecast.parts(JobConfig(n_envs=published["options"]["n_envs"]))
    for stage, seconds in published["seconds"].items():
        assert forecast.seconds_of(parts[stage]) == pytest.approx(seconds, rel=0.35), stage


@pytest.mark.parametrize(
    ("seconds", "text"), [(1, "5 s"), (42, "40 s"), (89, "90 s"), (100, "2 min"), (3000, "50 min"), (9000, "2.5 h")]
)
def test_a_duration_as_people_say_it(seconds, text):
    assert forecast.spoken(seconds) == text


def test_a_stage_says_which_of_how_many_and_has_one_bar(capsys):
    stages = Stages(SMALL, True, {"demonstrations": 1e4})
    stages.skip("demonstrations")
    with stages.stage("clone"):
        list(tracked(range(5), "clone", 5))
    with stages.stage("dagger"):
        for round_num in (1, 2):
            list(tracked(range(5), f"collect round {round_num}", 5))
    said = capsys.readouterr().err
    assert "[1/7] demonstrations of the expert: done before\n" in said
    assert "[2/7] cloning: about " in said and "h more" in said, "the slow first stage makes the rest slow"
    assert "clone: clone" in said and "dagger: collect round 2" in said and said.count("[3/7] DAgger") == 1
    assert "100%" in said.splitlines()[-1]


def test_a_silent_job_says_nothing(capsys):
    stages = Stages(SMALL, False, {})
    with stages.stage("clone"):
        list(tracked(range(2), "clone", 2, shown=False))
    stages.skip("dagger")
    assert capsys.readouterr() == ("", "")


def test_only_what_takes_long_is_announced(capsys):
    with announced_if_slow("compiles", after_s=30.0):
        pass
    assert capsys.readouterr().err == ""
    with announced_if_slow("compiles", after_s=0.01):
        time.sleep(0.3)
    assert capsys.readouterr().err == "      compiles\n"


# -- The end -----------------------------------------------------------------------------------------------------------


def scores(success, hands, r2=None):
    known = {} if r2 is None else {"r2": r2, "velocity_error": 0.05}
    return {"success_rate": success, "operator_success_rate": hands, "episodes": 10, **known}


METRICS = {
    "tasks": {
        "trot": {"multi_head": scores(1.0, 0.9, 0.99), "expert": scores(1.0, 1.0), "pooled": scores(0.1, 0.0)},
        "walk": {"multi_head": scores(0.7, 0.5, 0.97), "expert": scores(0.9, 1.0), "pooled": scores(0.0, 0.0)},
    },
    "config": {"preset": "default"},
}


def test_three_lines_say_how_good_it_is():
    assert verdict(METRICS) == [
        "with drawn commands: the policy succeeds in 17 of 20 episodes, the expert in 19, told no gait in 1",
        "in an operator's hands: the policy succeeds in 14 of 20 episodes, the expert in 20, told no gait in 0",
        "R2 of its joint targets 0.9800, mean velocity error 0.050 m/s",
    ]


def test_the_end_names_what_is_there_and_what_to_do(tmp_path):
    (tmp_path / "policy.zip").touch()
    text = summary(METRICS, tmp_path, {"drive the policy": "go1-mtl-gym evaluate x"})
    assert f"  {tmp_path / 'policy.zip'}  the trained policy" in text and "gaits.gif" not in text
    assert "\n  drive the policy  go1-mtl-gym evaluate x" in text and SMOKE not in text
    assert SMOKE in summary(METRICS | {"config": {"preset": "smoke"}}, tmp_path, {})
