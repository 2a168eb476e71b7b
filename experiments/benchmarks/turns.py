"""Taking turns: how much of everything, who takes part, and what is said about it."""

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from threadpoolctl import threadpool_limits

from experiments.stats import spread
from experiments.study import option
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import number_in
from trainers.algorithms.optimizer import torch_threads
from trainers.policies.checkpoint import checked_device

N_TASKS = 4
"""Of the made-up demonstrations, unless the number of heads is what varies."""
RATE = "samples_per_s"
WARM_UP = 2
"""First steps of a turn, which are not timed."""
Turn = Callable[[int], dict[str, float]]
"""Does its work in a round and gives its metrics, samples per second among them."""


@dataclass(frozen=True)
class TrainingOptions:
    """How much of everything.

    Raises:
        InvalidInputError: if a number is out of its range or the device is not there.
    """

    sections: tuple[str, ...] = option(
        ("step", "heads", "precision", "reading", "shuffling", "collection"), "which of the benchmark's"
    )
    device: str = option("cpu", "'cpu', or 'cuda' where PyTorch finds a GPU")
    rounds: int = option(9, "how often everybody has a turn")
    data_seed: int = option(0, "of data, weights and orders")
    batch_size: int = option(1024, "rows per gradient step")
    rows: int = option(200_000, "of the made-up demonstrations")
    widths: tuple[int, ...] = option((512, 2560), "units per hidden layer")
    threads: tuple[int, ...] = option((1, 2), "of PyTorch")
    steps: int = option(12, "gradient steps per turn that are timed")
    learning_steps: int = option(400, "gradient steps after which losses are compared")
    heads: tuple[int, ...] = option((1, 2, 4, 8, 16), "numbers of heads")
    stored_rows: int = option(1_800_000, "rows that are read from disk and shuffled")
    collect_s: float = option(4.0, "seconds of robot's time collected per turn")

    def __post_init__(self) -> None:
        checked_device(self.device)
        for name in ("rounds", "batch_size", "steps", "learning_steps"):
            number_in(getattr(self, name), 1, 1e9, name)
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


@dataclass(frozen=True)
class Heat:
    """Contestants that take turns.

    Attributes:
        setting: under what circumstances.
        threads: of PyTorch and of the libraries below.
        contestants: folder for files -> name -> turn.
        references: names whose metrics the others' are divided by.
    """

    setting: str
    threads: int
    contestants: Callable[[Path], Mapping[str, Turn]]
    references: tuple[str, ...]


class Stopwatch:
    """Called after every step of a loop, it tells how fast the loop went after its first steps.

    Args:
        amounts: says what to wait for.
    """

    def __init__(self, amounts: TrainingOptions) -> None:
        self._options = amounts
        self.steps = 0

    def __call__(self) -> None:
        """Count a step."""
        self.steps += 1
        if self.steps == WARM_UP:
            self._start = self._now()

    def rate(self, batch_size: int) -> float:
        """Samples per second until now."""
        return (self.steps - WARM_UP) * batch_size / (self._now() - self._start)

    def _now(self) -> float:
        self._options.synchronize()
        return time.perf_counter()


def seconds(call: Callable[[], Any], amounts: TrainingOptions) -> float:
    """How long a call takes, with all that it asked the GPU for."""
    amounts.synchronize()
    start = time.perf_counter()
    call()
    amounts.synchronize()
    return time.perf_counter() - start


def interleaved(contestants: Mapping[str, Turn], rounds: int) -> dict[str, dict[str, list[float]]]:
    """Contestant -> metric -> one value per round; every other round goes through them backwards."""
    values: dict[str, dict[str, list[float]]] = {name: {} for name in contestants}
    for i in range(rounds):
        names = list(contestants) if i % 2 == 0 else list(reversed(contestants))
        for name in names:
            for metric, value in contestants[name](i).items():
                values[name].setdefault(metric, []).append(value)
    return values


def summary(values: Mapping[str, Mapping[str, Sequence[float]]], references: Sequence[str]) -> list[dict[str, Any]]:
    """Everybody's metrics, as they are and, in "over", round by round over a reference's; each as `stats.spread`."""
    return [
        {
            "agent": name,
            **{metric: spread(series) for metric, series in metrics.items()},
            "over": {
                reference: {
                    metric: spread(np.divide(series, values[reference][metric])) for metric, series in metrics.items()
                }
                for reference in references
                if reference != name
            },
        }
        for name, metrics in values.items()
    ]


def run(heat: Heat, rounds: int) -> list[dict[str, Any]]:
    """All turns of a heat."""
    threads = heat.threads
    with torch_threads(threads), threadpool_limits(threads), tempfile.TemporaryDirectory() as folder:
        values = interleaved(heat.contestants(Path(folder)), rounds)
    return [{"condition": heat.setting, **row} for row in summary(values, heat.references)]
