"""Imports run one way, ``import go1_mtl_gym`` stays light, and what is installed is what the checkout says."""

import ast
import importlib.metadata
import importlib.resources
import json
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

PINOCCHIO = {"pinocchio", "osqp"}
LEARNING = {"torch", "stable_baselines3", "imitation"}
FORBIDDEN = {
    "go1_mtl_gym": {"experts", "trainers", "experiments"} | PINOCCHIO | LEARNING,
    "experts": {"trainers", "experiments"} | LEARNING,
    "trainers": {"experts", "experiments"} | PINOCCHIO,
}


def imported(source: str) -> set[str]:
    """Top-level names that a module imports, anywhere in it; relative imports stay inside their package."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add(node.module.partition(".")[0])
    return names


def modules_after(statement: str) -> set[str]:
    """Top-level names in ``sys.modules`` after a statement, in a fresh interpreter."""
    listing = "import json, sys; print(json.dumps(sorted({name.partition('.')[0] for name in sys.modules})))"
    code = f"{statement}\n{listing}"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stdout.splitlines()[-1]))


def declared_version() -> str:
    """The version in pyproject.toml."""
    return re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)[1]


def test_the_scan_sees_imports_wherever_they_stand():
    source = "import a.b, c\nfrom d.e import f\nfrom . import g\ndef h():\n    from i import j\n"
    assert imported(source) == {"a", "c", "d", "i"}


@pytest.mark.parametrize("package", FORBIDDEN)
def test_imports_run_one_way(package):
    files = sorted((ROOT / package).rglob("*.py"))
    assert files, f"no module found in {ROOT / package}"
    wrong = {
        str(path.relative_to(ROOT)): sorted(bad)
        for path in files
        if (bad := imported(path.read_text(encoding="utf-8")) & FORBIDDEN[package])
    }
    assert not wrong


@pytest.mark.parametrize("package", FORBIDDEN)
def test_importing_one_package_loads_only_its_own_side(package):
    assert not modules_after(f"import {package}") & FORBIDDEN[package]


def test_making_an_environment_loads_no_expert():
    loaded = modules_after('import gymnasium; gymnasium.make("go1_mtl_gym:Go1Trot-v0").reset(seed=0)')
    assert not loaded & FORBIDDEN["go1_mtl_gym"]


def test_the_model_is_packaged():
    assert (importlib.resources.files("go1_mtl_gym") / "assets" / "go1.xml").is_file()


def test_one_version_everywhere():
    import go1_mtl_gym

    try:
        installed = importlib.metadata.version("go1-mtl-gym")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("go1-mtl-gym is not installed here; `make test` installs it")
    assert installed == declared_version()
    assert go1_mtl_gym.__version__ == declared_version()


def packaged() -> set[str]:
    """The modules, their marks of being typed, models and policies of the packages, relative to the root."""
    files = (path for package in FORBIDDEN for path in (ROOT / package).rglob("*"))
    return {path.relative_to(ROOT).as_posix() for path in files if path.suffix in {".py", ".typed", ".xml", ".zip"}}


def built(target: str, folder: Path) -> Path:
    """A distribution made by hatchling."""
    pytest.importorskip("hatchling")
    command = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return next(folder.iterdir())


def test_the_wheel_holds_the_packages_the_model_and_the_policies(tmp_path):
    with zipfile.ZipFile(built("wheel", tmp_path)) as wheel:
        names = set(wheel.namelist())
    assert "go1_mtl_gym/assets/go1.xml" in packaged()
    assert packaged() <= names
    assert {name.partition("/")[0] for name in names if ".dist-info/" not in name} == set(FORBIDDEN)


def test_the_source_distribution_holds_them_too(tmp_path):
    with tarfile.open(built("sdist", tmp_path)) as sdist:
        names = {name.partition("/")[2] for name in sdist.getnames()}
    assert packaged() <= names
