"""Taking turns, and what is said about it."""

import dataclasses
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from trainers.algorithms.optimizer import torch_threads
from training_parts.settings import Settings

RATE = "samples_per_s"
WARM_UP = 2
"""First steps of a turn, which are not timed."""
Turn = Callable[[int], dict[str, float]]
"""Does its work in a round and gives its figures, samples per second among them."""


@dataclasses.dataclass(frozen=True)
class Heat:
    """Contestants that take turns.

    Attributes:
        setting: under what circumstances.
        threads: of PyTorch and of the libraries below.
        contestants: folder for files -> name -> turn.
        references: names whose figures the others' are divided by.
    """

    setting: str
    threads: int
    contestants: Callable[[Path], Mapping[str, Turn]]
    references: tuple[str, ...]


class Stopwatch:
    """Called after every step of a loop, it tells how fast the loop went after its first steps.

    Args:
        settings: says what to wait for.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.steps = 0

    def __call__(self) -> None:
        self.steps += 1
        if self.steps == WARM_UP:
            self._start = self._now()

    def rate(self, batch_size: int) -> float:
        """Samples per second until now."""
        return (self.steps - WARM_UP) * batch_size / (self._now() - self._start)

    def _now(self) -> float:
        self._settings.synchronize()
        return time.perf_counter()


def seconds(call: Callable[[], Any], settings: Settings) -> float:
    """How long a call takes, with all that it asked the GPU for."""
    settings.synchronize()
    start = time.perf_counter()
    call()
    settings.synchronize()
    return time.perf_counter() - start


def interleaved(
    contestants: Mapping[str, Turn], rounds: int, after_round: Callable[[], Any]
) -> dict[str, dict[str, list[float]]]:
    """Contestant -> figure -> one value per round; every other round goes through them backwards."""
    values: dict[str, dict[str, list[float]]] = {name: {} for name in contestants}
    for i in range(rounds):
        names = list(contestants) if i % 2 == 0 else list(reversed(contestants))
        for name in names:
            for figure, value in contestants[name](i).items():
                values[name].setdefault(figure, []).append(value)
        after_round()
    return values


def summary(values: Mapping[str, Mapping[str, Sequence[float]]], references: Sequence[str]) -> list[dict[str, Any]]:
    """Medians and quartiles of every contestant's figures, as they are and round by round over a reference's."""
    return [
        {
            "contestant": name,
            "figures": {figure: spread(own) for figure, own in figures.items()},
            "over": {
                reference: {
                    figure: spread(np.divide(own, values[reference][figure])) for figure, own in figures.items()
                }
                for reference in references
                if reference != name
            },
        }
        for name, figures in values.items()
    ]


def spread(values: Sequence[float]) -> dict[str, float]:
    """Median and quartiles."""
    low, median, high = np.quantile(values, (0.25, 0.5, 0.75))
    return {"median": float(median), "low": float(low), "high": float(high)}


def run(heat: Heat, rounds: int, after_round: Callable[[], Any]) -> list[dict[str, Any]]:
    """All turns of a heat."""
    threads = heat.threads
    with torch_threads(threads), threadpool_limits(threads), tempfile.TemporaryDirectory() as folder:
        values = interleaved(heat.contestants(Path(folder)), rounds, after_round)
    return [{"setting": heat.setting, **row} for row in summary(values, heat.references)]
