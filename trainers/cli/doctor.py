"""``go1-mtl-gym doctor``: whether this machine has all that is needed."""

import dataclasses
import sys
from collections.abc import Callable, Iterable, Sequence

from go1_mtl_gym import __version__
from trainers.cli.checks import expert, machine, opengl, versions
from trainers.cli.checks.finding import FAILED, WARNING, Finding
from trainers.cli.options import parse

CHECKS: tuple[Callable[[], Iterable[Finding]], ...] = (
    versions.check,
    opengl.check,
    expert.check,
    machine.cores,
    machine.gpu,
    machine.files,
)


@dataclasses.dataclass(frozen=True)
class Options:
    """Look whether this machine has all that is needed, and say what to do where it has not.

    The exit status is 1 if something that is needed fails, 0 otherwise.
    """


def run(words: Sequence[str]) -> None:
    """Make all checks, and print what they find as they go.

    Raises:
        SystemExit: with status 1, if something that is needed fails.
    """
    parse(Options, words, "doctor")
    print(f"go1-mtl-gym {__version__}, {sys.executable}\n", flush=True)
    findings: list[Finding] = []
    for check in CHECKS:
        for finding in check():
            print(line(finding), flush=True)
            findings.append(finding)
    print(f"\n{verdict(findings)}")
    if any(each.status == FAILED for each in findings):
        raise SystemExit(1)


def line(finding: Finding) -> str:
    """What a finding looks like: two lines if there is something to do."""
    text = f"{finding.status:8} {finding.subject:12} {finding.text}"
    return f"{text}\n{'':21} -> {finding.remedy}" if finding.remedy else text


def verdict(findings: Sequence[Finding]) -> str:
    """All in one sentence."""
    failed, warnings = (sum(each.status == status for each in findings) for status in (FAILED, WARNING))
    if failed:
        return f"{failed} of the things that are needed {'fails' if failed == 1 else 'fail'}; the arrows say what to do"
    return f"all that is needed is there{f', with {warnings} warnings' if warnings else ''}"
