"""Making the environments that the trainers step: one place for ids, keyword arguments, disturbances and seeds."""

import dataclasses
import functools
import multiprocessing
import zlib
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, cast

import gymnasium
import numpy as np
from numpy.typing import ArrayLike

import go1_mtl_gym
from go1_mtl_gym.actuation import ActionMap
from go1_mtl_gym.contract import PolicyContract
from go1_mtl_gym.deprecation import renamed_arguments
from go1_mtl_gym.errors import Go1Error, InvalidInputError
from go1_mtl_gym.validation import interval_s, number_in, one_of
from trainers.data.operator import OperatorConfig
from trainers.data.operator_wrapper import OperatorWrapper
from trainers.utils.processes import keep_interrupts

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env import VecEnv

EnvFactory = Callable[..., gymnasium.Env]
"""What `make_env` is: (task, perturbation=None, **env_kwargs) -> environment with a method ``expert_action``."""


class Go1Like(Protocol):
    """What the trainers ask of an environment beneath its wrappers, beyond Gymnasium; `go1_mtl_gym.Go1Env` has it."""

    @property
    def contract(self) -> PolicyContract:
        """What gives observations and actions their meaning."""

    @property
    def control_hz(self) -> float:
        """Steps per second."""

    @property
    def action_map(self) -> ActionMap:
        """From actions to joint targets [rad] and back."""

    @property
    def state(self) -> Any:
        """What the expert is shown where there is no `estimated_state`."""

    def expert_action(self) -> np.ndarray:
        """The expert's action at the present state, shape (12,); without side effects."""

    def set_command(self, command: ArrayLike) -> None:
        """Ask for another (vx [m/s], vy [m/s], yaw rate [rad/s])."""

    def set_task(self, task: str, phase: float | None = None, command: ArrayLike | None = None) -> None:
        """Change the task, and the command if there is one, while running."""


def base_env(env: gymnasium.Env) -> Go1Like:
    """The environment beneath its wrappers, which Gymnasium gives without saying what it can do."""
    return cast(Go1Like, env.unwrapped)


class WorkerError(Go1Error, RuntimeError):
    """A process that was to step an environment is gone."""


@renamed_arguments(kick="push", kick_interval="push_interval", corner_share="corner_fraction")
@dataclasses.dataclass(frozen=True)
class PerturbationConfig:
    """How demonstrations are disturbed; see `go1_mtl_gym.PerturbationWrapper`.

    Attributes:
        noise_rad: largest standard deviation of the noise on the executed action [rad].
        push: largest velocity push [m/s].
        push_interval: mean time between pushes [s].
        command_interval: shortest and longest time between new commands [s], or None for one command per episode.
        corner_fraction: probability with which a new command is a corner of the task's range.
        task_interval: shortest and longest time between changes of task [s], or None for one task per episode.
        operator: whose hands move the stick, change the gait and push now and then; takes the place of the three
            settings above, while `push` goes on beside its own pushes. None draws commands and tasks at random.

    Raises:
        InvalidInputError: if a figure is negative, or an interval is not 0 < shortest <= longest.
    """

    noise_rad: float = 0.06
    push: float = 0.2
    push_interval: float = 1.5
    command_interval: tuple[float, float] | None = (1.5, 4.0)
    corner_fraction: float = 0.0
    task_interval: tuple[float, float] | None = None
    operator: OperatorConfig | None = None

    def __post_init__(self) -> None:
        if not (self.operator is None or isinstance(self.operator, OperatorConfig)):
            raise InvalidInputError(f"operator must be an OperatorConfig or None, got {self.operator!r}")
        if not (self.noise_rad >= 0 and self.push >= 0 and self.push_interval > 0):
            raise InvalidInputError(f"noise_rad and push must be >= 0 and push_interval > 0, got {self}")
        number_in(self.corner_fraction, 0.0, 1.0, "corner_fraction")
        for name in ("command_interval", "task_interval"):
            object.__setattr__(self, name, interval_s(getattr(self, name), name))

    def wrap(self, env: gymnasium.Env) -> gymnasium.Env:
        """An environment that is disturbed in this way."""
        figures = {each.name: getattr(self, each.name) for each in dataclasses.fields(self) if each.name != "operator"}
        if self.operator is None:
            return go1_mtl_gym.PerturbationWrapper(env, **figures)
        figures |= {"command_interval": None, "task_interval": None}
        return OperatorWrapper(go1_mtl_gym.PerturbationWrapper(env, **figures), self.operator)


class ExpertAccess(gymnasium.Wrapper):
    """Carries `expert_action` and `contract` outward, so that a vector environment finds them on every gymnasium."""

    def __init__(self, env: gymnasium.Env, perturbation: PerturbationConfig | None = None) -> None:
        super().__init__(env)
        self._perturbation = perturbation

    @property
    def contract(self) -> PolicyContract:
        """What gives observations and actions their meaning."""
        return base_env(self.env).contract

    @property
    def settings(self) -> str:
        """Everything that the environment and its disturbances were made from, as text."""
        config = getattr(self.env.unwrapped, "config", None)
        if config is not None and not isinstance(config.expert, str):  # its repr would name a place in memory
            config = dataclasses.replace(config, expert=f"callable:{type(config.expert).__qualname__}")
        return f"{config!r} {self._perturbation!r}"

    def expert_action(self) -> np.ndarray:
        """The expert's action at the present state, shape (12,)."""
        return base_env(self.env).expert_action()


def make_env(task: str | None, perturbation: PerturbationConfig | None = None, **env_kwargs: Any) -> gymnasium.Env:
    """One environment.

    Args:
        task: name of a task; None for the multi-gait environment.
        perturbation: disturbances of the executed action, or None.
        env_kwargs: of `go1_mtl_gym.Go1Env`.

    Raises:
        InvalidInputError: if the task is not registered, or an argument is not as described.
    """
    if task is not None:
        one_of(task, tuple(go1_mtl_gym.TASKS), "task (go1_mtl_gym.register_task adds others)")
    env = gymnasium.make(go1_mtl_gym.env_id(task), disable_env_checker=True, **env_kwargs)
    if perturbation is not None:
        env = perturbation.wrap(env)
    return ExpertAccess(env, perturbation)


def make_venv(
    tasks: Sequence[str],
    per_task: int = 1,
    env_kwargs: Mapping[str, Any] | None = None,
    perturbation: PerturbationConfig | None = None,
    subproc: bool = False,
    make_env: EnvFactory = make_env,
) -> "VecEnv":
    """A stable-baselines3 vector environment with `per_task` environments of every task, in the order of `tasks`.

    Args:
        tasks: which tasks to make environments of.
        per_task: how many of each.
        env_kwargs: of `make_env`.
        perturbation: of `make_env`.
        subproc: one process per environment instead of one for all. The processes import the main script again, so it
            must make them below ``if __name__ == "__main__":``.
        make_env: another factory, for tests and other robots.

    Raises:
        InvalidInputError: if `per_task` is less than 1.
        WorkerError: if a process ends before it has made its environment.
    """
    from stable_baselines3.common.vec_env import DummyVecEnv

    if per_task < 1:
        raise InvalidInputError(f"per_task must be at least 1, got {per_task}")
    kwargs = dict(env_kwargs or {})
    calls = [functools.partial(make_env, task, perturbation, **kwargs) for task in tasks]
    thunks: list[Callable[[], gymnasium.Env]] = [WithTasks(call) for call in calls for _ in range(per_task)]
    return _in_processes(thunks) if subproc else DummyVecEnv(thunks)


def _in_processes(thunks: list[Callable[[], gymnasium.Env]]) -> "VecEnv":
    """A vector environment with a process per environment, which leaves Ctrl-C to this one."""
    from stable_baselines3.common.vec_env import SubprocVecEnv

    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(1)  # a worker that imports a script without a main guard; the script is told, by its own error
    venv: VecEnv | None = None
    try:
        with keep_interrupts():
            venv = SubprocVecEnv(thunks, start_method="spawn")
    except (EOFError, ConnectionError):
        raise WorkerError(
            "a worker process ended before it had made its environment; a script that makes environments with "
            'subproc=True must do so below `if __name__ == "__main__":`, because every worker imports it again'
        ) from None
    except KeyboardInterrupt:
        if venv is not None:  # it came while the processes began
            venv.close()
        raise
    return venv


def contracts_of(venv: "VecEnv") -> tuple[PolicyContract, ...]:
    """The different contracts of the environments in a stable-baselines3 vector environment; none if they have none."""
    from stable_baselines3.common.vec_env import VecNormalize, unwrap_vec_wrapper

    normalizing = unwrap_vec_wrapper(venv, VecNormalize)
    if normalizing is not None and normalizing.norm_obs:
        raise InvalidInputError(
            "environments whose observations mean what their contract says were expected, got VecNormalize, which "
            "changes them: give it norm_obs=False (the policies normalize by themselves)"
        )
    try:
        contracts = venv.get_attr("contract")
    except AttributeError:
        return ()
    return tuple(dict.fromkeys(contracts))


def flat_obs(obs: Any) -> np.ndarray:
    """What a vector environment's `reset` or `step` gave, as the array (n_envs, D) that a flat Box makes it.

    stable-baselines3 annotates it for dictionaries and tuples too.
    """
    return cast(np.ndarray, obs)


def settings_of(venv: "VecEnv") -> list[str]:
    """What the environments of a vector environment were made from, one text each; none if they do not tell."""
    try:
        return [str(text) for text in venv.get_attr("settings")]
    except AttributeError:
        return []


@dataclasses.dataclass(frozen=True)
class WithTasks:
    """A function that takes the tasks registered here along to whichever process calls it.

    Attributes:
        function: what is called; picklable, as all of this is.
        tasks: registered before each call; what is known already is left as it is.
    """

    function: Callable[..., Any]
    tasks: tuple[go1_mtl_gym.Task, ...] = dataclasses.field(default_factory=lambda: tuple(go1_mtl_gym.TASKS.values()))

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Register the tasks, then call the function."""
        for task in self.tasks:
            go1_mtl_gym.register_task(task)
        return self.function(*args, **kwargs)


def derive_seed(*keys: int | str) -> int:
    """A seed in [0, 2^31) that depends on every key, and not on the process or machine."""
    words = [zlib.crc32(key.encode()) if isinstance(key, str) else int(key) for key in keys]
    return int(np.random.SeedSequence(words).generate_state(1)[0] >> 1)
