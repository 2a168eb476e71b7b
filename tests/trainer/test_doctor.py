"""The doctor: what it finds on a machine that is well, and on one where something is broken."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from trainers.cli import doctor
from trainers.cli.checks import expert, machine, opengl, versions
from trainers.cli.checks.finding import FAILED, NOTE, OK, WARNING, Finding, tried

STATUSES = {OK, NOTE, WARNING, FAILED}


def test_an_answer_comes_from_another_process_and_so_does_a_crash():
    assert tried("import os, json; print('noise'); print(json.dumps({'x': os.environ.get('ANSWER')}))", ANSWER="7") == (
        {"x": "7"},
        "",
    )
    assert tried("raise ValueError('no\\n such thing')") == ({}, "ValueError: no")
    assert tried("import os; os._exit(3)") == ({}, "ended with status 3")


def test_versions_are_compared_as_numbers(monkeypatch):
    assert versions.release("2.13.0+cpu") == (2, 13, 0) > versions.release("2.9") and versions.release("x") == ()
    required = versions.requirements()
    assert not required or {"mujoco", "torch", "osqp"} <= set(required)
    monkeypatch.setattr(versions, "requirements", lambda: {"numpy": "999.0", "no-such-package": "1.0", "torch": "2.1"})
    failed = [finding for finding in versions.check() if finding.status == FAILED]
    assert ["older than 999.0" in failed[0].text, "no-such-package is missing" in failed[1].text] == [True, True]
    assert failed[1].remedy == 'python -m pip install "no-such-package>=1.0"' and len(failed) == 2


def test_versions_that_were_not_tested_are_noted(monkeypatch):
    assert versions.tested("mujoco") and versions.tested("gymnasium") >= {"0.29.1"}
    monkeypatch.setattr(versions, "requirements", lambda: {"numpy": ""})
    monkeypatch.setattr(versions, "tested", lambda name: {"0.1"})
    notes = [finding for finding in versions.check() if finding.status == NOTE]
    assert len(notes) == 1 and "(tested: 0.1)" in notes[0].text
    monkeypatch.setattr(versions, "tested", lambda name: set())
    assert [finding.status for finding in versions.check()] == [OK], "no checkout, nothing to compare with"


def test_a_mujoco_gl_that_breaks_everything_is_the_first_thing_it_says(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    (finding,) = opengl.check()
    assert finding.status == FAILED and "MUJOCO_GL=nonsense" in finding.text and "invalid value" in finding.text
    assert finding.remedy.startswith(("export MUJOCO_GL=", "unset MUJOCO_GL"))


def test_a_back_end_that_does_not_draw_is_a_warning_with_the_one_that_does(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    monkeypatch.setattr(opengl, "tried", lambda code, **_: ({}, ""))
    monkeypatch.setattr(opengl, "why_not", lambda backend: "" if backend == "osmesa" else "no\tdisplay")
    first, *rest = opengl.check()
    assert (first.status, first.remedy) == (WARNING, "export MUJOCO_GL=osmesa")
    assert [finding.status for finding in rest] == [NOTE, OK, NOTE]
    monkeypatch.setattr(opengl, "why_not", lambda backend: "nothing")
    assert "apt-get install" in next(iter(opengl.check())).remedy


def test_the_expert_answers_and_its_loops_are_kept():
    findings = list(expert.check())
    assert [finding.status for finding in findings if finding.subject == "expert"][0] == OK
    assert re.search(r"takes \d+\.\d ms", findings[0].text)
    assert findings[-1].subject == "Numba cache" and findings[-1].status == OK and "__pycache__" in findings[-1].text


def test_an_expert_that_cannot_answer_fails(monkeypatch):
    monkeypatch.setattr(expert, "tried", lambda code, **_: ({}, "ModuleNotFoundError: No module named 'pinocchio'"))
    (finding,) = expert.check()
    assert finding.status == FAILED and "pinocchio" in finding.text and '"pin>=3.3"' in finding.remedy


@pytest.mark.parametrize(
    ("changed", "status", "words"),
    [
        ({"folders": []}, WARNING, "export NUMBA_CACHE_DIR"),
        ({"warnings": ["Numba's cache in /x is unusable"]}, WARNING, "rm -r /x"),
        ({"misses": 3}, OK, "3 loops compiled now"),
        ({}, OK, "30 loops read from /x"),
    ],
)
def test_a_cache_that_is_damaged_or_nowhere_is_said(changed, status, words, monkeypatch):
    well = {"first": 1.0, "then": 0.01, "warnings": [], "folders": ["/x"], "hits": 30, "misses": 0}
    monkeypatch.setattr(expert, "tried", lambda code, **_: (well | changed, ""))
    *_, finding = expert.check()
    assert finding.status == status and words in f"{finding.text} {finding.remedy}"


def test_the_machine_is_told_with_its_load_and_threads(monkeypatch):
    monkeypatch.setattr(machine.os, "cpu_count", lambda: 64)
    monkeypatch.setattr(machine.os, "sched_getaffinity", lambda _: {0, 1}, raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "16")
    cores, threads = machine.cores()
    assert cores.status == WARNING and "2 of 64" in cores.text and "--n-envs 2" in cores.remedy
    assert threads.status == WARNING and "OMP_NUM_THREADS=16" in threads.text
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert [each.status for each in machine.cores()][1] == OK


@pytest.mark.parametrize(
    ("answer", "smi", "status"),
    [(({"gpu": "H100", "version": "2"}, ""), None, OK), (({"gpu": "", "version": "2"}, ""), "/bin/nvidia-smi", WARNING),
     (({"gpu": "", "version": "2"}, ""), None, OK), (({}, "ImportError: x"), None, FAILED)],
)  # fmt: skip
def test_a_gpu_is_seen_missed_or_not_needed(answer, smi, status, monkeypatch):
    monkeypatch.setattr(machine, "tried", lambda code: answer)
    monkeypatch.setattr(machine.shutil, "which", lambda name: smi)
    assert [finding.status for finding in machine.gpu()] == [status]


def test_a_folder_that_cannot_be_written_fails(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert [finding.status for finding in machine.files()] == [OK, OK]
    (tmp_path / "runs").write_text("a file")
    assert [finding.status for finding in machine.files()] == [FAILED, OK]
    assert not [path for path in tmp_path.iterdir() if path.name != "runs"]


def test_the_exit_status_says_whether_something_that_is_needed_fails(monkeypatch, capsys):
    findings = [Finding("one", WARNING, "is slow", "wait"), Finding("two", OK, "is well")]
    monkeypatch.setattr(doctor, "CHECKS", (lambda: findings,))
    doctor.run([])
    printed = capsys.readouterr().out
    assert "-> wait" in printed and "all that is needed is there, with 1 warnings" in printed
    findings.append(Finding("three", FAILED, "is gone", "fetch it"))
    with pytest.raises(SystemExit) as end:
        doctor.run([])
    assert end.value.code == 1 and "1 of the things that are needed fails" in capsys.readouterr().out


def test_it_starts_where_mujoco_cannot(tmp_path):
    """Nothing that may be broken is imported by the doctor's own process."""
    code = (
        "import sys, trainers.cli.doctor; print(sorted({'mujoco', 'torch', 'numba', 'pinocchio'} & set(sys.modules)))"
    )
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, timeout=120)
    assert done.stdout == "[]\n", done.stderr
