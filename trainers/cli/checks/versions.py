"""Versions of Python and of the packages: against what is required, and against what was tested."""

import re
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from trainers.cli.checks.finding import FAILED, NOTE, OK, Finding

PACKAGE = "go1-mtl-gym"
OLDEST = (3, 10)
"""Of Python."""
CONSTRAINTS = Path(__file__).resolve().parents[3] / "constraints"
"""The exact versions of the tests, where a checkout has them."""
_REQUIREMENT = re.compile(r"^([A-Za-z0-9._-]+)\s*(?:>=\s*([0-9.]+))?")


def check() -> Iterator[Finding]:
    """What is too old or missing, and what differs from the tested versions."""
    if sys.version_info < OLDEST:
        yield Finding("Python", FAILED, sys.version.split()[0], "install Python 3.10 or newer, and make a new .venv")
    required = requirements()
    if not required:
        remedy = "python -m pip install -e . in the checkout"
        yield Finding("versions", NOTE, f"{PACKAGE} is not installed, so nothing says what it requires", remedy)
        return
    bad = [finding for name, lowest in required.items() if (finding := _too_old(name, lowest))]
    yield from bad
    if not bad:
        known = ", ".join(
            f"{name} {version_of(name)}" for name in ("mujoco", "gymnasium", "stable-baselines3", "torch")
        )
        yield Finding("versions", OK, f"Python {sys.version.split()[0]}, {len(required)} packages: {known}, ...")
    others = [difference for name in required if (difference := _difference(name))]
    if others:
        yield Finding(
            "versions", NOTE, f"not those of the tests: {', '.join(others)}", "nothing, unless something fails"
        )


def requirements() -> dict[str, str]:
    """Package -> lowest version, or "": what `PACKAGE` requires without extras; nothing where it is not installed."""
    try:
        lines = metadata.requires(PACKAGE) or []
    except metadata.PackageNotFoundError:
        return {}
    matches = (_REQUIREMENT.match(line) for line in lines if "extra ==" not in line)
    return {match[1]: match[2] or "" for match in matches if match}


def version_of(name: str) -> str | None:
    """The installed version; None if there is none."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def release(version: str) -> tuple[int, ...]:
    """The numbers of a version: "2.13.0+cpu" gives (2, 13, 0)."""
    digits = re.match(r"[0-9.]*[0-9]", version)
    return tuple(int(number) for number in digits[0].split(".")) if digits else ()


def tested(name: str) -> set[str]:
    """Versions that the tests run with; none outside a checkout."""
    pins = set()
    for file in ("tested.txt", "newest.txt"):
        path = CONSTRAINTS / file
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        pins |= set(re.findall(rf"^{re.escape(name)}==([^\s;]+)", text, re.MULTILINE | re.IGNORECASE))
    return pins


def _too_old(name: str, lowest: str) -> Finding | None:
    version = version_of(name)
    remedy = f'python -m pip install "{name}{f">={lowest}" if lowest else ""}"'
    if version is None:
        return Finding("versions", FAILED, f"{name} is missing", remedy)
    if lowest and release(version) < release(lowest):
        return Finding("versions", FAILED, f"{name} {version} is older than {lowest}", remedy)
    return None


def _difference(name: str) -> str:
    """How a version differs, such as "name 1.0 (tested: 1.1)"; "" if it was tested, or nobody knows."""
    version, pins = version_of(name) or "", tested(name)
    if not pins or release(version) in {release(pin) for pin in pins}:
        return ""
    return f"{name} {version} (tested: {' and '.join(sorted(pins))})"
