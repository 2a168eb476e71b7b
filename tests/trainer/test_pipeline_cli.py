"""Programs and worker processes that end with a sentence: errors, Ctrl-C, a script without a main guard."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from go1_mtl_gym import InvalidInputError
from trainers.utils.cli import main
from trainers.utils.processes import keep_interrupts


def ends_with(error: BaseException | None) -> int:
    @main
    def program(arguments=None):
        if error is not None:
            raise error

    return program([])


def test_a_program_that_ends_well_says_nothing(capsys):
    assert ends_with(None) == 0
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (InvalidInputError("rounds must be at least 0,\n got -1"), "error: rounds must be at least 0, got -1\n"),
        (PermissionError(13, "Permission denied", "/x"), "error: [Errno 13] Permission denied: '/x'\n"),
        (OSError(), "error: OSError\n"),
    ],
)
def test_an_error_is_one_line_on_stderr_and_status_2(error, sentence, capsys):
    assert ends_with(error) == 2
    assert capsys.readouterr() == ("", sentence)


def test_ctrl_c_says_what_is_kept_and_gives_status_130(capsys):
    assert ends_with(KeyboardInterrupt("go on with: --out x")) == 130
    assert capsys.readouterr() == ("", "\ninterrupted; go on with: --out x\n")
    assert ends_with(KeyboardInterrupt()) == 130
    assert capsys.readouterr().err == "\ninterrupted\n"


def test_a_bug_keeps_its_traceback():
    with pytest.raises(ZeroDivisionError):
        ends_with(ZeroDivisionError())


def environment() -> dict[str, str]:
    return os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_program_that_is_told_to_end_may_keep_what_is_done(name, capsys):
    number, kept = getattr(signal, name), []

    @main
    def program(arguments=None):
        try:
            os.kill(os.getpid(), number)
            time.sleep(10)
        finally:
            kept.append(True)

    before = signal.signal(number, signal.SIG_DFL)
    try:
        assert program([]) == 128 + number and kept == [True]
        assert signal.getsignal(number) is signal.SIG_DFL
        signal.signal(number, signal.SIG_IGN)  # as nohup does
        assert ends_with(None) == 0 and signal.getsignal(number) is signal.SIG_IGN
    finally:
        signal.signal(number, before)
    assert capsys.readouterr().err == "\nterminated\n"


def test_ctrl_c_waits_until_the_workers_have_begun():
    other = threading.Thread(target=time.sleep, args=(0.5,))  # may receive the signal in this one's place
    other.start()
    before, handler, begun = signal.getsignal(signal.SIGINT), signal.default_int_handler, False
    signal.signal(signal.SIGINT, handler)  # a shell's background jobs begin without one
    try:
        with pytest.raises(KeyboardInterrupt), keep_interrupts():
            os.kill(os.getpid(), signal.SIGINT)
            other.join()
            begun = True
        assert begun and signal.getsignal(signal.SIGINT) is handler
        assert not signal.pthread_sigmask(signal.SIG_BLOCK, ())
    finally:
        signal.signal(signal.SIGINT, before)


_WORKERS = """
import time, joblib
from trainers.utils.processes import keep_interrupts
with keep_interrupts():
    results = joblib.Parallel(n_jobs=2, return_as="generator")(joblib.delayed(time.sleep)(20) for _ in range(4))
print("begun", flush=True)
try:
    list(results)
except KeyboardInterrupt:
    raise SystemExit(130)
"""


def test_workers_leave_ctrl_c_to_the_program(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", _WORKERS], env=environment(), start_new_session=True, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    assert process.stdout.readline() == "begun\n"
    time.sleep(1.0)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=15)
    assert process.returncode == 130
    assert "Traceback" not in errors, errors


_UNGUARDED = """
import trainers
trainers.make_venv(("trot", "walk"), subproc=True)
"""


def test_a_script_without_a_main_guard_is_told_so(tmp_path):
    script = tmp_path / "unguarded.py"
    script.write_text(_UNGUARDED)
    done = subprocess.run([sys.executable, script], env=environment(), capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert 'if __name__ == "__main__":' in done.stderr.splitlines()[-1]
    assert done.stderr.count("Traceback") == 1, "the workers add none"
