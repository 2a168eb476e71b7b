"""Closed loop through a change of gait: does it stay up, and walk on in the new one?"""

from typing import Any

import numpy as np

from go1_mtl_gym import BUILT_IN_TASKS, TASKS
from go1_mtl_gym.validation import integer_in, number_in, one_of
from trainers.data.environments import EnvFactory, base_env, derive_seed, make_env
from trainers.evaluation.rollout import Rollout, checked_agent, opened, run_all
from trainers.evaluation.scoring import ClosedLoopResult, EpisodeRecord, score
from trainers.utils.validation import checked_jobs, checked_seed, positive, refuse_overridden


def evaluate_transition(
    policy_or_expert: Any,
    first: str,
    second: str,
    trials: int = 20,
    seed: int = 1,
    *,
    before_s: float = 2.0,
    after_s: float = 6.0,
    n_jobs: int = 1,
    progress: bool = False,
    make_env: EnvFactory = make_env,
    **env_kwargs: Any,
) -> ClosedLoopResult:
    """Walk in one gait, change to another, and score what follows as `trainers.evaluate` scores an episode.

    A trial starts standing in the first task, with a command drawn from what lies in both tasks' ranges. After
    `before_s` and a random fraction of the first gait's period comes ``set_task(second)``, and the command goes on; a
    policy hears of it with its next observation. The scores are of the time after that; their first 2 s count for
    survival only. A fall before the change is a failure too, with a survival of 0 s. Trial i depends on (first, second,
    seed, i) alone.

    Args:
        policy_or_expert: as in `trainers.evaluate`.
        first: name of the task that trials start in.
        second: name of the task that they change to.
        trials: how many.
        seed: of all of them.
        before_s: shortest time before the change [s].
        after_s: time after it [s].
        n_jobs: processes.
        progress: show a bar.
        make_env: another environment factory.
        env_kwargs: of the environment, on top of the policy's own ``env_kwargs``. It must know both tasks; unless told
            otherwise, it knows all that are registered.

    Returns:
        Its task is "FIRST to SECOND", its seconds are `after_s`.

    Raises:
        InvalidInputError: if an argument is not as described.
    """
    policy_or_expert = checked_agent(policy_or_expert)
    refuse_overridden(env_kwargs, episode_s="before_s and after_s", task="first")
    kwargs = {"tasks": BUILT_IN_TASKS, **getattr(policy_or_expert, "env_kwargs", {}), **env_kwargs}
    for task in (first, second):
        one_of(task, tuple(kwargs["tasks"]), "task")
    trials, seed = integer_in(trials, 1, 10**9, "trials"), checked_seed(seed)
    before_s, after_s = number_in(before_s, 0.0, 1e6, "before_s"), positive(after_s, "after_s")
    n_jobs = checked_jobs(n_jobs)
    kwargs["episode_s"] = before_s + TASKS[first].gait.period + after_s + 1.0

    def call(i: int) -> tuple[Any, ...]:
        trial_seed = derive_seed("switch", first, second, seed, i)
        return policy_or_expert, first, second, trial_seed, before_s, after_s, kwargs, make_env

    title = f"{first} to {second}"
    records = run_all(_trial, map(call, range(trials)), trials, n_jobs, progress, title)
    return ClosedLoopResult(title, float(after_s), tuple(records))


def _trial(
    policy_or_expert: Any,
    first: str,
    second: str,
    seed: int,
    before_s: float,
    after_s: float,
    env_kwargs: dict[str, Any],
    make_env: EnvFactory,
) -> EpisodeRecord:
    rng = np.random.default_rng(derive_seed("switch", seed))
    span = np.minimum(TASKS[first].command_range, TASKS[second].command_range)
    command = tuple((rng.uniform(-1.0, 1.0, 3) * span).tolist())
    before_s += rng.uniform() * TASKS[first].gait.period
    with opened(make_env, first, env_kwargs) as env:
        base = base_env(env)
        rollout = Rollout(env, policy_or_expert, seed, {"task": first, "command": command})
        rollout.walk(round(before_s * base.control_hz))
        if not rollout.fallen:
            base.set_task(second)
        series = rollout.walk(round(after_s * base.control_hz))
        return score(series, rollout.fallen, seed, (command,), base.control_hz, second)
