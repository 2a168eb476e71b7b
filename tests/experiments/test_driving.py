"""Studies of what somebody meets who takes hold of the robot."""

import json
import sys

import pytest

from experiments.driving import page, programs, times
from experiments.results import Results
from go1_mtl_gym import InvalidInputError


def results(study, records):
    return Results(study, "", 1, {}, {}, None, {}, tuple(records))


def test_programs_are_timed_and_their_last_words_are_told(tmp_path):
    seconds, said = programs.run([sys.executable, "-c", "print(1 + 1)"], tmp_path, GO1_SAID="yes")
    assert said == "2\n" and 0 < seconds < 60
    told = [sys.executable, "-c", "import os; print(os.environ['GO1_SAID'])"]
    assert programs.run(told, GO1_SAID="yes")[1] == "yes\n"
    with pytest.raises(InvalidInputError, match="failed, and said: no picture"):
        programs.run([sys.executable, "-c", "raise SystemExit('no picture')"])


def waiting(what, condition, *seconds):
    return {"what": what, "condition": condition, "seconds": list(seconds)}


def test_waiting_is_told_by_medians_beside_the_aims():
    study = times.Times(times.Times.full)
    shown = study.table(
        results(
            "driving_times",
            [
                waiting("imports", times.IMPORTS, 3.0, 4.0, 9.0),
                waiting("--help", times.HELP, 0.1),
                waiting("train --help", times.HELP, 0.7, 0.6, 0.8),
                waiting("play", times.WINDOW, 5.0),
                waiting("play --web", times.WEB, 6.0),
                waiting(times.INSTALL, times.INSTALL, 30.0, 9.0),
            ],
        )
    )
    assert [line.split("|")[2].strip() for line in shown.splitlines()[2:]] == ["4.0", "0.70", "5.0", "6.0", "39"]
    assert "help, the slowest of 2" in shown


def test_help_is_measured_of_every_command(monkeypatch):
    study, asked = times.Times(times.Times.quick), []
    monkeypatch.setattr(times, "run", lambda command: asked.append(command) or (float(len(asked)), ""))
    found = study.measure(study.agents()[0], times.Cell(times.ALL_GAITS, times.HELP), 1)
    assert [each["what"] for each in found][:3] == ["--help", "list --help", "play --help"]
    assert found[0]["seconds"] == [2.0]  # the first time only warms up
    assert asked[-1][-2:] == ["doctor", "--help"]


@pytest.mark.parametrize("condition", [times.WINDOW, times.WEB])
def test_no_picture_is_a_failure(condition, monkeypatch):
    if condition == times.WEB:
        pytest.importorskip("viser")
    monkeypatch.setenv("DISPLAY", ":9999")
    monkeypatch.setitem(times.PLACES, times.WEB, (*times.PLACES[times.WEB][:2], ["--web", "--host", "nowhere.invalid"]))
    study = times.Times(times.Times.quick)
    with pytest.raises(InvalidInputError, match="ended with status 2 before the first picture"):
        study.measure(study.agents()[0], times.Cell(times.ALL_GAITS, condition), 1)


SIZED = [{"part": "before the first motion", "bytes": 7e6, "gzipped": 2.8e6}, {"part": "in all", "gzipped": 6.3e6}]


def of_page(condition, values):
    return [{"agent": "page", "task": "all gaits", "condition": condition, "seed": 1} | each for each in values]


def test_the_page_is_told_by_its_aims_and_its_verdicts():
    study = page.Page(page.Page.full)
    tours = [
        {"tour": i, "seconds": 90.0, "fallen": i == 3, "fallen_in_python": i in (3, 5), "survival_s": 90.0}
        for i in range(10)
    ]
    drives = [
        {"policy": "phase_free", "drive": "trot", "seconds": 10, "observation": 2e-8, "action": 3e-7, "apart_m": 1e-9},
        {"policy": "phase_free", "drive": "walk", "seconds": 12, "observation": 1e-8, "action": 4e-7, "apart_m": 1e-8},
    ]
    measured = results(
        "driving_page",
        [
            *of_page(page.SIZES, SIZED),
            *of_page(page.MOTION, [{"run": i, "seconds": value} for i, value in enumerate((2.6, 2.4, 3.3))]),
            *of_page(page.PARITY, drives),
            *of_page(page.TOURS, tours),
        ],
    )
    lines = [line.split("|")[2].strip() for line in study.table(measured).splitlines()[2:]]
    assert lines == ["2.80", "6.30", "2.6, 3.3", "9/10", "9/10", "8/10"]
    assert "| phase free | 12 | 2e-08 | 4e-07 | 1e-08 |" in "\n".join(study.paragraphs(measured))


def test_without_node_it_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(page, "WEB", tmp_path)
    with pytest.raises(InvalidInputError, match="needs Node 20, and what `make web` installs"):
        page.Page(page.Page.quick).prepare(1)


def test_another_page_is_measured_anew(monkeypatch, tmp_path):
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "main.js").write_text("first")
    monkeypatch.setattr(page, "WEB", tmp_path)
    before = page.Site("page").identity
    assert page.Site("page").identity == before
    (tmp_path / "src" / "main.js").write_text("second")
    assert page.Site("page").identity != before


def test_what_node_says_becomes_records(monkeypatch):
    monkeypatch.setattr(page, "run", lambda command, folder: (0.0, json.dumps([{"run": command[3]}])))
    study = page.Page(page.Page.quick)
    found = study.measure(study.agents()[0], page.Cell(page.ALL_GAITS, page.MOTION), 1)
    assert found == [{"run": "1"}]
