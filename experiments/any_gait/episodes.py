"""Gaits that nobody was trained on, and episodes in them."""

from collections.abc import Iterator, Mapping
from typing import Any

import gymnasium
import numpy as np

import trainers
from experiments.results import Record
from experiments.study import Cell
from go1_mtl_gym import Gait, GaitSpace
from go1_mtl_gym.tasks import ANY_GAIT
from trainers.data.environments import derive_seed
from trainers.data.operator import OperatorConfig
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.scoring import EpisodeRecord


def blocks(counts: Mapping[str, int], size: int) -> list[Cell]:
    """Cells of so many episodes each, by the name of what they are; `block_of` reads them."""
    return [
        Cell(ANY_GAIT, f"{name}, from {first} on") for name, many in counts.items() for first in range(0, many, size)
    ]


def block_of(cell: Cell) -> tuple[str, int]:
    """Name and number of the first episode of a cell of `blocks`."""
    name, _, first = cell.condition.partition(", from ")
    return name, int(first.removesuffix(" on"))


def held_out_gaits(space: GaitSpace, first: int, count: int, seed: int) -> Iterator[tuple[int, Gait]]:
    """Number and gait of draws from a space; each by a seed of its own, which no training has.

    Args:
        space: that is drawn from.
        first: number of the first.
        count: how many.
        seed: of the study.
    """
    for number in range(first, first + count):
        yield number, space.draw(np.random.default_rng(derive_seed("held-out gait", seed, number)))


def episode(
    policy: Any,
    gait: Gait | None,
    seconds: float,
    *seed: int | str,
    operator: OperatorConfig | None = None,
    watch: Any = None,
    **world: Any,
) -> EpisodeRecord:
    """One episode from its standing start.

    Args:
        policy: or "expert".
        gait: that it begins in; None draws it.
        seconds: its duration [s].
        *seed: what the seed of everything else in it is derived from.
        operator: whose hands drive; None draws a command every 5 s.
        watch: looks on, see `EpisodeSetup.play`.
        **world: arguments of the environment.
    """
    interval = None if operator is not None else 5.0
    setup = EpisodeSetup(ANY_GAIT, derive_seed("any gait", *seed), seconds, None, interval, False, operator, gait)
    kwargs = {**getattr(policy, "env_kwargs", {}), **world}
    return setup.play(policy, kwargs, trainers.make_env, watch)[0]


def record(done: EpisodeRecord, **more: Any) -> Record:
    """The figures of an episode."""
    return {
        "trials": 1,
        "survived": int(not done.fallen),
        "succeeded": int(done.success),
        "velocity_error": done.velocity_error,
        "survival_s": done.survival_s,
    } | more


def figures(gait: Gait) -> dict[str, Any]:
    """What a gait is, for a record."""
    return {"gait": [round(value, 4) for value in gait.numbers.tolist()]}


class MovedSliders:
    """Somebody who moves the sliders of the gait all the time; a watch of `EpisodeSetup.play`.

    Args:
        space: within which they are moved.
        seed: of the moves.
    """

    REST_S, WAY_S = (0.0, 1.0), (0.2, 2.0)
    """How long the sliders rest between two moves, and how long they are on their way [s]."""

    def __init__(self, space: GaitSpace, seed: int) -> None:
        self._space, self._rng, self._next_s = space, np.random.default_rng(seed), 0.0

    def __call__(self, env: gymnasium.Env, step: int) -> None:
        """Move them if it is time to."""
        base: Any = env.unwrapped
        time_s = step * base.control_s
        if time_s >= self._next_s:
            gait, way_s = self._space.draw(self._rng), float(self._rng.uniform(*self.WAY_S))
            base.set_gait(gait, way_s)
            self._next_s = time_s + way_s + float(self._rng.uniform(*self.REST_S))
