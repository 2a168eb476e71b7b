"""Compiled loops where Numba's cache cannot be written or is damaged; they hold no constants of other files."""

import importlib.util
import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from experts.compilation import compiled, inlined
from experts.mpc import srbd
from experts.planning.footholds import FootholdRule
from experts.planning.swing import SwingRule
from experts.robot_model import RobotModel
from go1_mtl_gym import robot

ROOT = Path(__file__).resolve().parents[2]
LOOP = """
from experts.compilation import compiled

@compiled
def triangle(n):
    total = 0
    for i in range(n + 1):
        total += i
    return total
"""
SOLVE = """
import numpy as np
import experts
from experts.planning.body_reference import _integrate
experts.NMPCExpert()
states = _integrate(np.zeros((3, 12)), 0.0, np.zeros(3), 0.28, np.array([0.5, 0.0, 0.0]), 0.02)
print(experts.__file__, float(states[2, 3]))
"""


def test_without_a_place_for_the_cache_the_expert_is_compiled_anew(tmp_path):
    """Neither beside the source, nor below the home, nor in NUMBA_CACHE_DIR can a file be made; not even by root."""
    for name in ("experts", "go1_mtl_gym"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    package = tmp_path / "experts"
    for folder in (package, *(path for path in package.rglob("*") if path.is_dir())):
        (folder / "__pycache__").touch()  # a file where the folder should be
    nowhere = dict.fromkeys(("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR"), "/proc/nowhere")
    environment = {**os.environ, **nowhere, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    options = {"cwd": tmp_path, "env": environment, "capture_output": True, "text": True, "timeout": 300}
    done = subprocess.run([sys.executable, "-c", SOLVE], check=False, **options)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(package / "__init__.py"), "0.02"], "0.5 m/s for 0.04 s"
    assert "Warning" not in done.stderr, "a read-only installation is nothing to warn of at each start"


def loaded(folder: Path) -> ModuleType:
    """A module with one compiled loop, as a new process would have it."""
    path = folder / "loop.py"
    if not path.exists():
        path.write_text(LOOP)
    spec = importlib.util.spec_from_file_location("loop", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def cached(tmp_path, monkeypatch) -> Path:
    """The folder of a module whose machine code is in the cache."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    module = loaded(tmp_path)
    monkeypatch.setitem(sys.modules, "loop", module)  # where Numba looks for the globals of what it cached
    assert module.triangle(4) == 10
    return tmp_path


def test_the_cache_is_used(cached):
    assert loaded(cached).triangle(4) == 10
    files = sorted((cached / "__pycache__").glob("loop.*.nb*"))
    assert [path.suffix for path in files] == [".nbc", ".nbi"]
    before = [path.stat().st_mtime_ns for path in files]
    loaded(cached).triangle(5)
    assert [path.stat().st_mtime_ns for path in files] == before


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize(
    "damage",
    [lambda data: b"", lambda data: data[: len(data) // 2], lambda data: b"\x00" * len(data), lambda data: b"x" + data],
    ids=["empty", "cut off", "zeros", "shifted"],
)
def test_a_damaged_cache_is_passed_over_with_a_warning(cached, suffix, damage):
    (path,) = (cached / "__pycache__").glob(f"loop.*{suffix}")
    path.write_bytes(damage(path.read_bytes()))
    again = loaded(cached)
    with pytest.warns(RuntimeWarning, match=r"triangle for this process alone.*__pycache__.*delete it"):
        assert again.triangle(4) == 10
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert again.triangle(5) == 15, "one warning is enough"


def test_errors_of_the_function_are_its_callers():
    @compiled
    def inverse(x):
        if x == 0.0:
            raise ValueError("nothing to divide by")
        return 1.0 / x

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(2):
            with pytest.raises(ValueError, match="nothing to divide by"):
                inverse(0.0)
        assert inverse(2.0) == 0.5


def test_compiled_functions_call_inlined_ones_and_keep_their_names():
    @inlined
    def double(x):
        return 2.0 * x

    @compiled
    def quadruple(x):
        """Four times x."""
        return double(double(x))

    assert quadruple(3.0) == 12.0
    assert (quadruple.__name__, quadruple.__doc__) == ("quadruple", "Four times x.")


def test_a_constant_of_another_file_is_not_frozen(standing, monkeypatch):
    """Numba would not notice that it changed: only a function's own file makes its machine code stale."""
    dynamics, state = RobotModel().dynamics(standing), standing
    zero, swing, above = np.zeros(2), SwingRule(stiffness=1.0, damping=0.0), np.zeros(4)
    problem = np.zeros((2, 12)), np.ones((1, 12)), np.ones((1, 4, 3)), np.eye(3), 0.02
    pull = swing.acceleration(state, above, dynamics, zero, FootholdRule())
    force = srbd.linearize(*problem).B[0, 9, 0]
    monkeypatch.setattr(robot, "GRAVITY", 1.62)
    monkeypatch.setattr(robot, "MASS", robot.MASS / 2)
    monkeypatch.setattr(robot, "FOOT_RADIUS", robot.FOOT_RADIUS + 0.5)
    model = srbd.linearize(*problem)
    assert model.c[0, 11] == pytest.approx(-0.02 * 1.62) and model.B[0, 9, 0] == pytest.approx(2 * force)
    landing = FootholdRule().plan(state, dynamics.com_w, zero, np.zeros(4))
    np.testing.assert_array_equal(landing[:, 2], robot.FOOT_RADIUS)
    higher = swing.acceleration(state, above, dynamics, zero, FootholdRule())
    np.testing.assert_allclose((higher - pull)[:, 2], 0.5)
