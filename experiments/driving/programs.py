"""Programs that are measured from outside."""

import os
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

from go1_mtl_gym.errors import InvalidInputError

ROOT = Path(__file__).resolve().parents[2]


def run(command: Sequence[str], folder: Path = ROOT, **environment: str) -> tuple[float, str]:
    """Seconds that a program takes, and what it prints.

    Args:
        command: its name and arguments.
        folder: that it runs in.
        environment: variables that are set for it.

    Raises:
        InvalidInputError: if it fails.
    """
    begin = time.perf_counter()
    done = subprocess.run(command, cwd=folder, env=os.environ | environment, capture_output=True, text=True)
    seconds = time.perf_counter() - begin
    if done.returncode:
        last = (done.stderr.strip() or done.stdout.strip() or "nothing").splitlines()[-1]
        raise InvalidInputError(f"`{' '.join(command)[:200]}` failed, and said: {last}")
    return seconds, done.stdout
