"""How hard the student may be kicked: the largest kick, per gait and direction, that nearly all trials survive."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from expert_report.lab import generator
from expert_report.limits import CRUISE, DIRECTIONS, kick_w

from go1_mtl_gym import TASKS
from trainers.data.environments import derive_seed, make_env
from trainers.evaluation.closed_loop import controller

PAIRS = {"lateral": ("left", "right"), "fore-aft": ("forward", "backward")}
"""Directions of which the weaker one counts."""


@dataclass(frozen=True)
class KickConfig:
    """The search for the largest kick, from the smallest upward.

    Attributes:
        trials: per size.
        share: of the trials that must survive.
        step: of the grid of sizes, and the smallest of them [m/s].
        grid: largest number of sizes.
        before_s: walking before the kick [s]; a random share of the gait's period is added.
        after_s: without a fall after it [s].
        directions: which of `DIRECTIONS`.
    """

    trials: int = 20
    share: float = 0.9
    step: float = 0.2
    grid: int = 25
    before_s: float = 1.5
    after_s: float = 3.0
    directions: tuple[str, ...] = tuple(DIRECTIONS)

    def parts(self, task: str, tasks: Sequence[str]) -> tuple[str, ...]:
        """The directions."""
        return self.directions


def pushes(who: Any, task: str, direction: str, config: KickConfig, seed: int, **env_kwargs: Any) -> dict[str, Any]:
    """Largest kick below the first that too few trials survive, 0 if that is the smallest.

    Returns:
        "largest" [m/s]; "at_cap": whether the search ended for lack of larger kicks; "sizes": [{"size", "survived",
        "trials"}], all that were tried. A fall before the kick counts as one after it.
    """
    kwargs = {**getattr(who, "env_kwargs", {}), **env_kwargs}
    env = make_env(task, None, **kwargs, episode_s=config.before_s + TASKS[task].gait.period + config.after_s + 1.0)
    largest, sizes = 0.0, []
    try:
        for k in range(1, config.grid + 1):
            size = round(k * config.step, 6)
            survived = sum(_push_speed(env, who, task, direction, size, config, seed, i) for i in range(config.trials))
            sizes.append({"size": size, "survived": survived, "trials": config.trials})
            if survived < config.share * config.trials - 1e-9:
                break
            largest = size
    finally:
        env.close()
    return {"largest": largest, "at_cap": largest == sizes[-1]["size"], "sizes": sizes}


def _push_speed(
    env: Any, who: Any, task: str, direction: str, size: float, config: KickConfig, seed: int, trial: int
) -> bool:
    """Whether one kick is survived; trial i is the same walk for every size."""
    keys = ("push", task, direction, seed, trial)
    base, act = env.unwrapped, controller(who, env.unwrapped)
    before_s = config.before_s + generator(*keys).uniform() * TASKS[task].gait.period
    obs, _ = env.reset(seed=derive_seed(*keys), options={"task": task, "command": CRUISE})
    obs, fallen = _walk(env, act, obs, before_s)
    if fallen:
        return False
    base.push(kick_w(direction, size, base.state.rpy[2]))
    return not _walk(env, act, obs, config.after_s)[1]


def _walk(
    env: Any, act: Callable[[np.ndarray], np.ndarray], obs: np.ndarray, seconds: float
) -> tuple[np.ndarray, bool]:
    """Go on for some seconds or until a fall; returns the last observation, and whether it fell."""
    for _ in range(round(seconds * env.unwrapped.control_hz)):
        obs, _, terminated, _, _ = env.step(act(obs))
        if terminated:
            return obs, True
    return obs, False
