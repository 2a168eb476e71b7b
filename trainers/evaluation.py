"""Closed loop: does it stay up, go where it is told, and step?"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import joblib
import numpy as np
from threadpoolctl import threadpool_limits
from tqdm.auto import tqdm

from go1_mtl_gym import TASKS, Gait
from go1_mtl_gym.errors import InvalidInputError
from trainers.environments import EnvFactory, WithTasks, derive_seed, make_env
from trainers.files import json_ready
from trainers.metrics import touchdowns, tracking_error, wilson_interval

SETTLE_S = 2.0
"""Start of an episode that counts for survival only [s]."""
MIN_AIR_SHARE = 0.5
"""A foot that was off the ground for less than this share of the gait's planned swing has bounced, not stepped."""
VELOCITY_TOLERANCE = 0.15
"""Largest velocity error of a success [m/s]."""
STEP_RATE_TOLERANCE = 0.25
"""Largest relative deviation of a leg's touchdown rate from the gait's in a success."""
STAND_TOUCHDOWNS = 1
"""Touchdowns that a leg may always have too many or too few of in an episode that stands for a while."""


@dataclasses.dataclass(frozen=True)
class EpisodeRecord:
    """One episode.

    Attributes:
        seed: that the environment was reset with.
        commands: (vx, vy, yaw rate) in the order they were given.
        survival_s: time until the fall, or the whole duration [s].
        fallen: whether it fell.
        velocity_error: `trainers.metrics.tracking_error` after the first 2 s [m/s]; NaN if it fell too early to tell.
        yaw_rate_error: likewise [rad/s].
        step_rate: touchdowns per second of each leg after the first 2 s [1/s], each after at least half a planned swing
            in the air; NaN if it fell within them.
        success: survived, velocity error <= 0.15 m/s, and every leg stepped at the gait's rate: within 25 % of 1 / gait
            period times the share of the time after the first 2 s in which the gait clock ran. If the robot was to
            stand for a while, one touchdown more or less is allowed, so one that stands throughout may make one.
    """

    seed: int
    commands: tuple[tuple[float, float, float], ...]
    survival_s: float
    fallen: bool
    velocity_error: float
    yaw_rate_error: float
    step_rate: tuple[float, float, float, float]
    success: bool


@dataclasses.dataclass(frozen=True)
class ClosedLoopResult:
    """Several episodes of one task.

    Means of errors and rates leave out the episodes that fell too early to have one (NaN if all did).

    Attributes:
        task: name of the task.
        seconds: duration of an episode without a fall [s].
        episodes: the records.
    """

    task: str
    seconds: float
    episodes: tuple[EpisodeRecord, ...]

    @property
    def survival_rate(self) -> float:
        """Share of episodes without a fall."""
        return float(np.mean([not e.fallen for e in self.episodes]))

    @property
    def survival_s(self) -> float:
        """Mean time until the fall or the end [s]."""
        return float(np.mean([e.survival_s for e in self.episodes]))

    @property
    def velocity_error(self) -> float:
        """Mean velocity error [m/s]."""
        return _mean([e.velocity_error for e in self.episodes])

    @property
    def yaw_rate_error(self) -> float:
        """Mean yaw rate error [rad/s]."""
        return _mean([e.yaw_rate_error for e in self.episodes])

    @property
    def step_rate(self) -> float:
        """Mean touchdowns per leg per second [1/s]."""
        return _mean(np.ravel([e.step_rate for e in self.episodes]))

    @property
    def success_rate(self) -> float:
        """Share of episodes that survived, tracked and stepped."""
        return float(np.mean([e.success for e in self.episodes]))

    @property
    def success_interval(self) -> tuple[float, float]:
        """95 % Wilson interval of the success rate."""
        return wilson_interval(sum(e.success for e in self.episodes), len(self.episodes))

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready values; NaN becomes None."""
        names = ("survival_rate", "survival_s", "velocity_error", "yaw_rate_error", "step_rate", "success_rate")
        summary = {name: getattr(self, name) for name in (*names, "success_interval", "task", "seconds")}
        return json_ready(summary | {"episodes": [dataclasses.asdict(e) for e in self.episodes]})


def evaluate(
    policy_or_expert: Any,
    task: str = "trot",
    episodes: int = 20,
    seconds: float = 30.0,
    seed: int = 1,
    *,
    commands: Sequence[Sequence[float]] | None = None,
    command_interval: float | None = None,
    n_jobs: int = 1,
    progress: bool = False,
    make_env: EnvFactory = make_env,
    **env_kwargs: Any,
) -> ClosedLoopResult:
    """Run episodes from a standing start and score them; the same function for students and experts.

    Episode i depends on (seed, task, i) alone: its command is drawn from the task's range with seeds that collection
    never uses, and is the same for every policy.

    Args:
        policy_or_expert: something with ``predict(obs, deterministic=True)`` (a policy), something with
            ``reset(state)`` and ``action(state) -> 12 joint targets [rad]`` (an expert), or "expert" for the
            environment's own.
        task: name of the task.
        episodes: how many.
        seconds: duration of each [s].
        seed: of all of them.
        commands: (vx [m/s], vy [m/s], yaw rate [rad/s]) for the episodes, used in turn; None draws them.
        command_interval: draw a new command every so many seconds; None keeps one per episode.
        n_jobs: processes.
        progress: show a bar.
        make_env: another environment factory.
        env_kwargs: of the environment; on top of the policy's own ``env_kwargs``.

    Raises:
        InvalidInputError: if an argument is not as described.
    """
    if task not in TASKS:
        raise InvalidInputError(f"task must be one of {', '.join(TASKS)}; got {task!r}")
    if episodes < 1 or not seconds > 0:
        raise InvalidInputError(f"episodes must be >= 1 and seconds > 0, got {episodes} and {seconds}")
    if commands is not None and len(commands) == 0:
        raise InvalidInputError("commands must be None or hold at least one (vx, vy, yaw rate), got none")
    if command_interval is not None and not command_interval > 0:
        raise InvalidInputError(f"command_interval must be None or positive, got {command_interval}")
    controller(policy_or_expert, None)
    kwargs = {**getattr(policy_or_expert, "env_kwargs", {}), **env_kwargs, "episode_s": seconds}

    def call(i: int) -> tuple[Any, ...]:
        command = None if commands is None else tuple(commands[i % len(commands)])
        own_seed = derive_seed("evaluate", task, seed, i)
        return policy_or_expert, task, own_seed, command, command_interval, kwargs, make_env

    if n_jobs == 1:
        records = [_episode(*call(i)) for i in tqdm(range(episodes), f"evaluate {task}", disable=not progress)]
    else:
        parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator")
        results = parallel(joblib.delayed(WithTasks(_episode))(*call(i)) for i in range(episodes))
        records = list(tqdm(results, f"evaluate {task}", episodes, disable=not progress))
    return ClosedLoopResult(task, float(seconds), tuple(records))


def _episode(
    policy_or_expert: Any,
    task: str,
    seed: int,
    command: tuple[float, ...] | None,
    command_interval: float | None,
    env_kwargs: dict[str, Any],
    make_env: EnvFactory,
) -> EpisodeRecord:
    env = make_env(task, None, **env_kwargs)
    try:
        with threadpool_limits(1):
            return _run(env, policy_or_expert, task, seed, command, command_interval, env_kwargs["episode_s"])
    finally:
        env.close()


def _run(
    env: Any,
    policy_or_expert: Any,
    task: str,
    seed: int,
    command: tuple[float, ...] | None,
    command_interval: float | None,
    seconds: float,
) -> EpisodeRecord:
    base = env.unwrapped
    act = controller(policy_or_expert, base)
    rng = np.random.default_rng(derive_seed("commands", seed))
    options = {"task": task} | ({} if command is None else {"command": command})
    obs, info = begin(env, policy_or_expert, seed, options)
    given = [tuple(float(value) for value in info["command"])]
    steps = round(seconds * base.control_hz)
    every = round(command_interval * base.control_hz) if command_interval else steps
    measured, wanted, contacts = np.empty((steps, 3)), np.empty((steps, 3)), np.empty((steps, 4), dtype=bool)
    running = np.empty(steps, dtype=bool)
    for i in range(steps):
        if i and i % max(every, 1) == 0:
            given.append(tuple(TASKS[task].draw_command(rng).tolist()))
            base.set_command(given[-1])
        running[i] = not info.get("standing", False)
        obs, _, terminated, truncated, info = env.step(act(obs))
        measured[i], wanted[i], contacts[i] = info["base_velocity"], info["filtered_command"], info["contacts"]
        if terminated or truncated:
            break
    done = i + 1
    if truncated and not terminated and done < steps:
        raise InvalidInputError(f"the environment ended an episode of {seconds:g} s after {done / base.control_hz:g} s")
    series = (measured[:done], wanted[:done], contacts[:done], running[:done])
    return _score(*series, bool(terminated), seed, tuple(given), TASKS[task].gait, base.control_hz)


def _score(
    measured: np.ndarray,
    wanted: np.ndarray,
    contacts: np.ndarray,
    running: np.ndarray,
    fallen: bool,
    seed: int,
    commands: tuple[tuple[float, float, float], ...],
    gait: Gait,
    control_hz: float,
) -> EpisodeRecord:
    """Figures of one episode from what was measured after each step, and whether the clock ran during it."""
    skip = round(SETTLE_S * control_hz)
    velocity_error, yaw_error = tracking_error(measured, wanted, max(1, round(gait.period * control_hz)), skip)
    counted_s = (len(measured) - skip) / control_hz
    rate, stepped = np.full(4, np.nan), False
    if counted_s > 0:
        count = touchdowns(contacts, math.ceil(MIN_AIR_SHARE * gait.swing_s * control_hz - 1e-9), skip)
        wanted_count = gait.step_rate * running[skip:].sum() / control_hz
        stood = 0 if running[skip:].all() else STAND_TOUCHDOWNS
        slack = max(STEP_RATE_TOLERANCE * wanted_count, stood)
        rate, stepped = count / counted_s, bool((np.abs(count - wanted_count) <= slack + 1e-9).all())
    return EpisodeRecord(
        seed=seed,
        commands=commands,
        survival_s=len(measured) / control_hz,
        fallen=fallen,
        velocity_error=velocity_error,
        yaw_rate_error=yaw_error,
        step_rate=tuple(rate.tolist()),
        success=bool(not fallen and velocity_error <= VELOCITY_TOLERANCE and stepped),
    )


def controller(policy_or_expert: Any, env: Any) -> Callable[[np.ndarray], np.ndarray]:
    """What turns an observation of `env` into an action."""
    if isinstance(policy_or_expert, str) and policy_or_expert == "expert":
        return lambda obs: env.expert_action()
    if hasattr(policy_or_expert, "predict"):
        return lambda obs: policy_or_expert.predict(obs, deterministic=True)[0]
    if hasattr(policy_or_expert, "action"):
        return lambda obs: env.action_map.from_radians(policy_or_expert.action(_expert_state(env))).astype(np.float32)
    raise InvalidInputError(
        f'expected something with predict(obs), something with action(state), or "expert"; got {policy_or_expert!r}'
    )


def begin(env: Any, policy_or_expert: Any, seed: int, options: dict[str, Any]) -> tuple[np.ndarray, dict[str, Any]]:
    """Reset an environment, and an expert that is no policy with it; returns observation and info."""
    obs, info = env.reset(seed=seed, options=options)
    if hasattr(policy_or_expert, "reset") and not hasattr(policy_or_expert, "predict"):
        policy_or_expert.reset(_expert_state(env.unwrapped))
    return obs, info


def _expert_state(env: Any) -> Any:
    """What the environment shows an expert."""
    return env.estimated_state if hasattr(env, "estimated_state") else env.state


def _mean(values: Sequence[float] | np.ndarray) -> float:
    known = [value for value in values if not math.isnan(value)]
    return float(np.mean(known)) if known else math.nan
