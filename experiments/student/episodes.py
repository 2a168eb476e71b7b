"""Episodes in closed loop as metrics of a record."""

from collections.abc import Iterable
from typing import Any

import trainers
from trainers.data.operator import OperatorConfig
from trainers.pipeline.config import JobConfig


def counts(*results: trainers.ClosedLoopResult) -> dict[str, Any]:
    """Trials, how many survived and succeeded, and the mean velocity error [m/s], of all episodes together."""
    episodes = sum((result.episodes for result in results), ())
    together = trainers.ClosedLoopResult("", max(result.seconds for result in results), episodes)
    return {
        "trials": len(episodes),
        "survived": sum(not episode.fallen for episode in episodes),
        "succeeded": sum(episode.success for episode in episodes),
        "velocity_error": together.velocity_error,
    }


def drawn(policy: Any, task: str, episodes: int, options: Any, seed: int, **world: Any) -> dict[str, Any]:
    """Counts of episodes in one gait with commands that change.

    Args:
        policy: or "expert".
        task: the gait.
        episodes: how many.
        options: of a study, with `seconds` and `command_interval` [s].
        seed: of the episodes.
        **world: see `trainers.evaluate`.
    """
    given = {"command_interval": options.command_interval} | world
    return counts(trainers.evaluate(policy, task, episodes, options.seconds, seed, **given))


def operated(policy: Any, task: str, episodes: int, options: Any, seed: int, **world: Any) -> dict[str, Any]:
    """Counts of episodes in one gait in an operator's hands.

    Args:
        policy: or "expert".
        task: the gait.
        episodes: how many.
        options: of a study, with `seconds` [s].
        seed: of the episodes.
        **world: arguments of the environment.
    """
    hands = OperatorConfig().of_one_gait()
    return counts(trainers.evaluate(policy, task, episodes, options.seconds, seed, operator=hands, **world))


def evaluate_gaits(policy: Any, job: JobConfig, seed: int, **world: Any) -> dict[str, trainers.ClosedLoopResult]:
    """Gait -> episodes with commands that change, as many, as long and with as many commands as a job's."""
    given = {"command_interval": job.command_interval} | world
    return {task: trainers.evaluate(policy, task, job.episodes, job.episode_s, seed, **given) for task in job.tasks}


def other_gaits(task: str, tasks: Iterable[str]) -> tuple[str, ...]:
    """The gaits that can be changed to from a gait."""
    return tuple(name for name in tasks if name != task)
