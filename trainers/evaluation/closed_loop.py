"""Closed loop: does it stay up, go where it is told, and step?"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from go1_mtl_gym import TASKS
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import finite_vector, integer_in, one_of
from trainers.data import environments
from trainers.data.environments import EnvFactory, derive_seed, make_env
from trainers.data.operator import OperatorConfig
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.rollout import checked_agent, run_all
from trainers.evaluation.scoring import ClosedLoopResult, EpisodeRecord
from trainers.utils.validation import checked_jobs, checked_seed, positive, refuse_overridden


def evaluate(
    policy_or_expert: Any,
    task: str = "trot",
    episodes: int = 20,
    seconds: float = 30.0,
    seed: int = 1,
    *,
    commands: Sequence[Sequence[float]] | None = None,
    command_interval: float | None = None,
    corners: bool = False,
    operator: OperatorConfig | None = None,
    n_jobs: int = 1,
    progress: bool = False,
    make_env: EnvFactory = make_env,
    **env_kwargs: Any,
) -> ClosedLoopResult:
    """Run episodes from a standing start and score them; the same function for students and experts.

    Episode i depends on (seed, task, i) alone: its command is drawn from the task's range with seeds that collection
    never uses, and is the same for every policy.

    Args:
        policy_or_expert: something with ``predict(obs, deterministic=True)`` (a policy; if its `predict` takes `state`
            and `episode_start` too, it is given back the state that it returned), something with ``reset(state)`` and
            ``action(state) -> 12 joint targets [rad]`` (an expert), or "expert" for the environment's own.
        task: name of the task.
        episodes: how many.
        seconds: duration of each [s].
        seed: of all of them.
        commands: (vx [m/s], vy [m/s], yaw rate [rad/s]) for the episodes, used in turn; None draws them.
        command_interval: draw a new command every so many seconds; None keeps one per episode.
        corners: draw commands from the corners of the task's range, where every component is at its largest, instead
            of from its inside.
        operator: whose hands drive (`trainers.OperatorConfig`), in place of the three arguments above; they begin in
            the task, and change the gait and push if their configuration says so. None draws commands.
        n_jobs: processes.
        progress: show a bar.
        make_env: another environment factory.
        env_kwargs: of the environment; on top of the policy's own ``env_kwargs``, but not in place of the arguments
            here: no ``episode_s``.

    Raises:
        InvalidInputError: if an argument is not as described, or the policy is for another environment.
    """
    one_of(task, tuple(TASKS), "task")
    episodes, seed = integer_in(episodes, 1, 10**9, "episodes"), checked_seed(seed)
    seconds, n_jobs = positive(seconds, "seconds"), checked_jobs(n_jobs)
    if commands is not None and len(commands) == 0:
        raise InvalidInputError("commands must be None or hold at least one (vx, vy, yaw rate), got none")
    if commands is not None and corners:
        raise InvalidInputError(f"commands are given or drawn from corners, got corners=True and {commands}")
    if operator is not None and not (commands is None and command_interval is None and not corners):
        raise InvalidInputError(
            "an operator gives the commands; beside it came "
            f"commands={commands!r}, command_interval={command_interval!r}, corners={corners!r}"
        )
    if command_interval is not None:
        command_interval = positive(command_interval, "command_interval")
    if commands is not None:
        # another environment's reset refuses what is beyond its own limits
        check = TASKS[task].check_command if make_env is environments.make_env else _three_numbers
        commands = [check(command).tolist() for command in commands]
    refuse_overridden(env_kwargs, episode_s="seconds", task="task")
    policy_or_expert = checked_agent(policy_or_expert)
    kwargs = {**getattr(policy_or_expert, "env_kwargs", {}), **env_kwargs}

    def call(i: int) -> tuple[Any, ...]:
        command = None if commands is None else tuple(commands[i % len(commands)])
        episode_seed = derive_seed("evaluate", task, seed, i)
        setup = EpisodeSetup(task, episode_seed, seconds, command, command_interval, corners, operator)
        return setup, policy_or_expert, kwargs, make_env

    records = run_all(_episode, map(call, range(episodes)), episodes, n_jobs, progress, f"evaluate {task}")
    return ClosedLoopResult(task, float(seconds), tuple(records))


def _three_numbers(command: object) -> np.ndarray:
    return finite_vector(command, 3, "command (vx, vy, yaw rate)")


def _episode(
    setup: EpisodeSetup, policy_or_expert: Any, env_kwargs: dict[str, Any], make_env: EnvFactory
) -> EpisodeRecord:
    return setup.play(policy_or_expert, env_kwargs, make_env)[0]
