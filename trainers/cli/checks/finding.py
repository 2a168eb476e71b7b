"""What a check finds out, and a process in which it may crash."""

import dataclasses
import json
import os
import subprocess
import sys
from typing import Any

OK, NOTE, WARNING, FAILED = "ok", "note", "warning", "FAILED"
"""All is well; good to know; something that one may want is not to be had; something that is needed is not there."""
PATIENCE_S = 300.0
"""The expert compiles its loops in about a minute, on a slow machine."""


@dataclasses.dataclass(frozen=True)
class Finding:
    """One line of the doctor's.

    Attributes:
        subject: what was looked at.
        status: `OK`, `NOTE`, `WARNING` or `FAILED`.
        text: what was found.
        remedy: what to do about it, or "".
    """

    subject: str
    status: str
    text: str
    remedy: str = ""


def tried(code: str, **environment: str | None) -> tuple[dict[str, Any], str]:
    """What Python code in a process of its own answers, and its last words if it does not.

    Args:
        code: prints one line of JSON, at the end.
        environment: variables that differ from ours; None unsets one.

    Returns:
        The answer and "", or an empty dictionary and the reason.
    """
    variables = os.environ | {name: value for name, value in environment.items() if value is not None}
    for name in (name for name, value in environment.items() if value is None):
        variables.pop(name, None)
    try:
        done = subprocess.run(
            [sys.executable, "-c", code], env=variables, capture_output=True, text=True, timeout=PATIENCE_S
        )
    except subprocess.TimeoutExpired:
        return {}, f"no answer within {PATIENCE_S:.0f} s"
    lines = done.stdout.splitlines()
    if done.returncode == 0 and lines:
        return json.loads(lines[-1]), ""
    return {}, _reason(done.stderr, done.returncode)


def _reason(errors: str, status: int) -> str:
    """The last line of a traceback, or how the process ended."""
    lines = [line for line in errors.splitlines() if line.strip() and not line.startswith(" ")]
    return " ".join(lines[-1].split())[:300] if lines else f"ended with status {status}"
