"""What the policies of a job are measured by: one-step errors, and episodes that are kept on disk."""

from collections.abc import Iterable, Mapping
from typing import Any

from trainers.data.demonstrations import Demonstrations
from trainers.evaluation.closed_loop import evaluate
from trainers.evaluation.metrics import lower_bound, offline_metrics
from trainers.pipeline.config import JobConfig
from trainers.pipeline.run_folder import RunFolder
from trainers.utils.files import json_ready, read_object, write_json

DRAWN, OPERATOR = "drawn", "operator"
"""Where commands come from in the closed loop: the task's range, or hands."""
IN_HANDS = ("success_rate", "survival_rate", "velocity_error")
"""What ``metrics.json`` tells of the episodes in an operator's hands."""


class Scores:
    """Measures policies as the settings of a job say.

    Args:
        config: of the job.
        folder: of its results, in which finished episodes are kept.
        progress: show bars.
    """

    def __init__(self, config: JobConfig, folder: RunFolder, progress: bool) -> None:
        self.config, self.folder, self.progress = config, folder, progress

    def one_step_errors(
        self, policies: Mapping[str, Any], held_out: Demonstrations
    ) -> dict[str, dict[str, dict[str, Any]]]:
        """Task -> policy -> metric."""
        tasks: dict[str, dict[str, dict[str, Any]]] = {task: {} for task in self.config.tasks}
        for name, policy in policies.items():
            if name == "phase_free":  # these rows hold one frame, it needs several
                continue
            rows = held_out.select() if name == "paper_literal" else held_out
            for task, scores in offline_metrics(policy, rows).items():
                tasks[task][name] = scores
        return tasks

    def of(self, policy: Any, agent: str, task: str) -> dict[str, Any]:
        """Those with drawn commands; if there is an operator, those in its hands too, by names that begin with it."""
        episodes = self.config.episodes
        scores = self.closed_loop(policy, agent, task, episodes, DRAWN)
        if self.config.operator is None:
            return scores
        hands = self.closed_loop(policy, agent, task, episodes, OPERATOR)
        return scores | {f"{OPERATOR}_{name}": hands[name] for name in IN_HANDS}

    def closed_loop(self, policy: Any, agent: str, task: str, episodes: int, protocol: str = DRAWN) -> dict[str, Any]:
        """Scores of `trainers.evaluate`, kept on disk; "episodes" is their number.

        Args:
            policy: as `trainers.evaluate` takes it.
            agent: its name in the run.
            task: name of the task.
            episodes: how many.
            protocol: `DRAWN`, commands that change at times, or `OPERATOR`, the hands of the configuration in one gait.
        """
        path = self.folder.closed_loop(agent, task, protocol)
        known = read_object(path, "file of scores") if path.is_file() else None
        if known is None:
            known = self._measured(policy, task, episodes, protocol) | {"learner": agent}
            write_json(path, known)
        kept = {key: value for key, value in known.items() if key not in ("task", "learner", "episodes", "seconds")}
        return kept | {"episodes": len(known["episodes"])}

    def _measured(self, policy: Any, task: str, episodes: int, protocol: str) -> dict[str, Any]:
        config = self.config
        operator = config.operator.of_one_gait() if protocol == OPERATOR and config.operator else None
        result = evaluate(
            policy,
            task,
            episodes=episodes,
            seconds=config.episode_s,
            seed=config.seed + 1,
            command_interval=None if operator else config.command_interval,
            operator=operator,
            n_jobs=config.n_envs,
            progress=self.progress,
            **(config.env_kwargs if policy == "expert" else {}),
        )
        return json_ready(result.as_dict())


def certified(closed_loop: Iterable[Mapping[str, Any]]) -> dict[str, float]:
    """What a certificate would say of the episodes of all gaits together: success rate and its lower bound, at 95 %."""
    scores = list(closed_loop)
    trials = sum(each["episodes"] for each in scores)
    successes = sum(round(each["success_rate"] * each["episodes"]) for each in scores)
    return {"success_rate": successes / trials, "lower_bound": lower_bound(successes, trials)}


def means(tasks: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> dict[str, float]:
    """What runs are compared by: the policy's means over its gaits."""
    wanted = {"success": "success_rate", "in_hands": "operator_success_rate", "r2": "r2"}
    scores = [learners["multi_head"] for learners in tasks.values()]
    return {
        f"result/{name}": sum(each[key] for each in scores) / len(scores)
        for name, key in wanted.items()
        if all(each.get(key) is not None for each in scores)
    }
