"""What is measured, with how much of everything."""

import dataclasses
import os
import platform
from pathlib import Path
from typing import Any

import torch

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import number_in

N_TASKS = 4
"""Of the made-up demonstrations, unless the number of heads is what varies."""
QUICK = {
    "rounds": 2,
    "rows": 4000,
    "batch_size": 256,
    "widths": (32,),
    "threads": (1,),
    "steps": 4,
    "learning_steps": 20,
    "heads": (1, 4),
    "stored_rows": 8000,
    "collect_s": 0.3,
}
"""Enough to see that everything works."""


@dataclasses.dataclass(frozen=True)
class Settings:
    """How the benchmark is run.

    Attributes:
        device: "cpu", or "cuda" where PyTorch finds a GPU.
        rounds: how often everybody has a turn.
        seed: of data, weights and orders.
        batch_size: rows per gradient step.
        rows: of the made-up demonstrations.
        widths: units per hidden layer.
        threads: of PyTorch.
        steps: gradient steps per turn that are timed.
        learning_steps: gradient steps after which losses are compared.
        heads: numbers of heads.
        stored_rows: rows that are read from disk and shuffled.
        collect_s: seconds of robot's time collected per turn.

    Raises:
        InvalidInputError: if a number is out of its range or the device is not there.
    """

    device: str = "cpu"
    rounds: int = 9
    seed: int = 0
    batch_size: int = 1024
    rows: int = 200_000
    widths: tuple[int, ...] = (512, 2560)
    threads: tuple[int, ...] = (1, 2)
    steps: int = 12
    learning_steps: int = 400
    heads: tuple[int, ...] = (1, 2, 4, 8, 16)
    stored_rows: int = 1_800_000
    collect_s: float = 4.0

    def __post_init__(self) -> None:
        if self.device != "cpu" and not (self.device.startswith("cuda") and torch.cuda.is_available()):
            raise InvalidInputError(f"device must be cpu, or cuda where PyTorch finds a GPU; got {self.device!r}")
        for name in ("rounds", "batch_size", "steps", "learning_steps"):
            number_in(getattr(self, name), 1, 1e9, name)
        number_in(self.seed, 0, 2**31 - 1, "seed")
        for name in ("widths", "threads", "heads"):
            for value in getattr(self, name):
                number_in(value, 1, 1e5, name)
        if self.batch_size % N_TASKS:
            raise InvalidInputError(f"batch_size must be a multiple of {N_TASKS}, got {self.batch_size}")
        number_in(self.rows, self.batch_size, 1e9, "rows")
        number_in(self.stored_rows, self.batch_size, 1e9, "stored_rows")
        number_in(self.collect_s, 0.01, 1e5, "collect_s")

    @property
    def on_gpu(self) -> bool:
        """Whether training runs on a GPU."""
        return self.device != "cpu"

    def synchronize(self) -> None:
        """Wait until the GPU has done what it was asked to."""
        if self.on_gpu:
            torch.cuda.synchronize(self.device)


def machine(settings: Settings) -> dict[str, Any]:
    """Model names of processor and device, and the number of cores."""
    device = torch.cuda.get_device_name(settings.device) if settings.on_gpu else "cpu"
    return {"cpu": _cpu_name(), "cores": os.cpu_count(), "device": device}


def _cpu_name() -> str:
    listing = Path("/proc/cpuinfo")
    if listing.is_file():
        for line in listing.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
