"""Who turns observations into actions, and an episode under their control."""

import contextlib
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import gymnasium
import joblib
import numpy as np
from threadpoolctl import threadpool_limits

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.expert import check_expert_fits
from go1_mtl_gym.validation import finite_vector
from trainers.data.environments import EnvFactory, Go1Like, WithTasks, base_env
from trainers.data.stateful import Learner
from trainers.evaluation.scoring import Series
from trainers.utils.processes import keep_interrupts
from trainers.utils.progress import tracked


def checked_agent(policy_or_expert: Any) -> Any:
    """Return what can be followed or asked: of a stable-baselines3 model with our policy, the policy.

    Args:
        policy_or_expert: as in `trainers.evaluate`.

    Raises:
        InvalidInputError: if it is neither a policy nor an expert.
    """
    inner = getattr(policy_or_expert, "policy", None)
    if hasattr(inner, "contract") and not hasattr(policy_or_expert, "contract"):
        return inner
    named = isinstance(policy_or_expert, str) and policy_or_expert == "expert"
    if not (named or hasattr(policy_or_expert, "predict") or hasattr(policy_or_expert, "action")):
        raise InvalidInputError(
            f'expected something with predict(obs), something with action(state), or "expert"; got {policy_or_expert!r}'
        )
    return policy_or_expert


def controller(policy_or_expert: Any, env: Go1Like) -> Callable[[np.ndarray], np.ndarray]:
    """What turns the observations of one episode of `env`, in their order, into actions; make one per episode.

    Args:
        policy_or_expert: as in `trainers.evaluate`.
        env: the environment beneath its wrappers.

    Raises:
        InvalidInputError: if it is neither a policy nor an expert, or was made for another environment.
    """
    policy_or_expert = checked_agent(policy_or_expert)
    if isinstance(policy_or_expert, str):
        return lambda obs: env.expert_action()
    if hasattr(policy_or_expert, "predict"):
        _check_contract(policy_or_expert, env)
        return _follow(Learner(policy_or_expert))
    _check_expert(policy_or_expert, env)

    def ask(obs: np.ndarray) -> np.ndarray:
        target = finite_vector(policy_or_expert.action(_expert_state(env)), 12, "the expert's action [rad]")
        return env.action_map.from_radians(target).astype(np.float32)

    return ask


def _check_contract(policy: Any, env: Any) -> None:
    """Refuse a policy that was made for other observations, actions or rates than the environment's."""
    expected, contract = getattr(policy, "contract", None), getattr(env, "contract", None)
    if expected is not None and contract is not None:
        expected.check(contract, "the policy", "the environment")


def _check_expert(expert: Any, env: Any) -> None:
    """Refuse an expert that was made for other gains or another rate than the environment's."""
    if hasattr(env, "gains"):
        check_expert_fits(expert, env.gains, env.control_s)


def _follow(learner: Learner) -> Callable[[np.ndarray], np.ndarray]:
    start = np.array([True])

    def act(obs: np.ndarray) -> np.ndarray:
        nonlocal start
        action, start = learner.act(obs, start), np.array([False])
        return action

    return act


def begin(
    env: gymnasium.Env, policy_or_expert: Any, seed: int, options: dict[str, Any]
) -> tuple[np.ndarray, dict[str, Any]]:
    """Reset an environment, and an expert that is no policy with it; returns observation and info."""
    obs, info = env.reset(seed=seed, options=options)
    if hasattr(policy_or_expert, "reset") and not hasattr(policy_or_expert, "predict"):
        policy_or_expert.reset(_expert_state(base_env(env)))
    return obs, info


def _expert_state(env: Go1Like) -> Any:
    """What the environment shows an expert."""
    return env.estimated_state if hasattr(env, "estimated_state") else env.state


@contextlib.contextmanager
def opened(make_env: EnvFactory, task: str, env_kwargs: dict[str, Any]) -> Iterator[gymnasium.Env]:
    """An environment that is closed afterwards; linear algebra uses one thread meanwhile."""
    env = make_env(task, None, **env_kwargs)
    try:
        with threadpool_limits(1):
            yield env
    finally:
        env.close()


class Rollout:
    """One episode from its standing start, stepped and measured.

    Args:
        env: an environment with a method ``expert_action``.
        policy_or_expert: as in `trainers.evaluate`.
        seed: of the reset.
        options: of the reset.

    Attributes:
        command: (vx [m/s], vy [m/s], yaw rate [rad/s]) that the episode began with.
        fallen: whether it ended in a fall.
    """

    def __init__(self, env: gymnasium.Env, policy_or_expert: Any, seed: int, options: dict[str, Any]) -> None:
        self._env = env
        self._act = controller(policy_or_expert, base_env(env))
        self._obs, self._info = begin(env, policy_or_expert, seed, options)
        forward, sideways, yaw_rate = (float(value) for value in self._info["command"])
        self.command = (forward, sideways, yaw_rate)
        self.fallen = self._over = False

    def walk(self, steps: int, before_step: Callable[[int], None] | None = None) -> Series:
        """Go on for some steps, or until the fall.

        Args:
            steps: how many.
            before_step: called with the number of each, from 0.

        Returns:
            What was measured during these steps.

        Raises:
            InvalidInputError: if the environment ends the episode before these steps are done.
        """
        running, told = [], []
        for i in range(0 if self.fallen else steps):
            if self._over:
                raise InvalidInputError(f"the environment ended an episode {steps - i} steps too early")
            if before_step is not None:
                before_step(i)
            running.append(not self._info.get("standing", False))
            self._obs, _, terminated, truncated, self._info = self._env.step(self._act(self._obs))
            told.append(self._info)
            self.fallen, self._over = bool(terminated), bool(terminated or truncated)
            if self.fallen:
                break
        return Series(
            measured=np.array([info["base_velocity"] for info in told], dtype=float).reshape(-1, 3),
            wanted=np.array([info["filtered_command"] for info in told], dtype=float).reshape(-1, 3),
            contacts=np.array([info["contacts"] for info in told], dtype=bool).reshape(-1, 4),
            running=np.array(running, dtype=bool),
            commands=np.array([info["command"] for info in told], dtype=float).reshape(-1, 3),
            tasks=tuple(info["task"] for info in told),
            gait_numbers=np.array([info["gait"] for info in told]) if told and "gait" in told[0] else None,
            moves=tuple(info["operator_move"] for info in told if "operator_move" in info),
            events=tuple(info["operator_events"] for info in told if "operator_events" in info),
        )


def run_all(
    episode: Callable[..., Any], calls: Iterable[tuple[Any, ...]], count: int, n_jobs: int, progress: bool, title: str
) -> list[Any]:
    """Results of an episode function for several sets of arguments, in their order.

    Args:
        episode: what is called; picklable if n_jobs > 1.
        calls: its arguments.
        count: number of calls.
        n_jobs: processes; 1 stays in this.
        progress: show a bar.
        title: of the bar.
    """
    if n_jobs == 1:
        return [episode(*call) for call in tracked(calls, title, count, "episode", progress)]
    parallel = joblib.Parallel(n_jobs=n_jobs, return_as="generator")
    with keep_interrupts():
        results = parallel(joblib.delayed(WithTasks(episode))(*call) for call in calls)
    return list(tracked(results, title, count, "episode", progress))
