"""Asking the expert: demonstrations as a pure function of their description, made in parallel and resumable."""

import dataclasses
import functools
import json
from collections.abc import Callable, Iterable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import gymnasium
import joblib
import numpy as np
from threadpoolctl import threadpool_limits

from go1_mtl_gym.contract import PolicyContract, terms_of
from go1_mtl_gym.errors import Go1Error, InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout
from go1_mtl_gym.tasks import TASKS
from go1_mtl_gym.validation import finite_vector
from trainers.data.demonstrations import Demonstrations
from trainers.data.environments import EnvFactory, PerturbationConfig, WithTasks, base_env, derive_seed, make_env
from trainers.data.stateful import Learner
from trainers.utils.files import json_form
from trainers.utils.processes import keep_interrupts
from trainers.utils.progress import Bar
from trainers.utils.validation import checked_jobs, checked_seed, positive

BEFORE_FALL_S = 0.24
"""The last seconds before a fall are not worth imitating and are dropped [s]."""
EPISODE_S = 30.0
"""Longest episode [s]."""


class ShardMismatchError(InvalidInputError):
    """A shard on disk was made from another description than the one asked for."""


class CollectionError(Go1Error):
    """The driver falls so often that the seconds asked for cannot be had."""


@dataclasses.dataclass(frozen=True)
class CollectJob:
    """Description of one shard; equal descriptions give equal rows.

    Attributes:
        task: name of the task that every episode begins in.
        seed: of everything random.
        seconds: duration of the kept rows [s].
        command: (vx [m/s], vy [m/s], yaw rate [rad/s]) of every episode, or None to draw one per episode.
        perturbation: disturbances, or None for the clean expert. With a `command` given, commands are not redrawn. With
            a `task_interval`, rows of all the environment's tasks follow one another.
        env_kwargs: of the environment.

    Raises:
        InvalidInputError: if the seed is no whole number of at least 0, the seconds are not positive, the command is
            not three finite numbers, or an argument of the environment has no JSON form: the shard could not say how it
            was made. Numpy's numbers become Python's.
    """

    task: str
    seed: int
    seconds: float = 30.0
    command: Sequence[float] | None = None
    perturbation: PerturbationConfig | None = None
    env_kwargs: dict[str, Any] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        set_field = functools.partial(object.__setattr__, self)
        set_field("seed", checked_seed(self.seed))
        set_field("seconds", positive(self.seconds, "seconds"))
        if self.command is not None:
            set_field("command", tuple(finite_vector(self.command, 3, "command (vx, vy, yaw rate)").tolist()))
        if not (self.perturbation is None or isinstance(self.perturbation, PerturbationConfig)):
            raise InvalidInputError(f"perturbation must be a PerturbationConfig or None, got {self.perturbation!r}")
        if self.command is not None and self.perturbation is not None and self.perturbation.operator is not None:
            raise InvalidInputError(f"an operator gives the commands; beside it came command={self.command!r}")
        set_field("env_kwargs", dict(self.env_kwargs))
        for name, value in self.env_kwargs.items():
            json_form(value, f"env_kwargs[{name!r}]")

    @property
    def name(self) -> str:
        """File name of the shard, without suffix."""
        return f"{self.task}-{'perturbed' if self.perturbation else 'clean'}-{self.seed:06d}"

    def as_dict(self) -> dict[str, Any]:
        """The description as JSON values."""
        return json_form(self, "job")


def collect(
    task: str,
    command: Sequence[float] | None = None,
    seed: int = 0,
    seconds: float = 30.0,
    perturbation: PerturbationConfig | None = None,
    env_kwargs: dict[str, Any] | None = None,
    *,
    make_env: EnvFactory = make_env,
) -> Demonstrations:
    """Let the expert drive and record what it would do, at every state before the step.

    Episodes start standing and last up to 30 s. After a fall the last 0.24 s are dropped and a new episode starts. The
    result depends on the arguments alone.

    Args:
        task: name of the task that every episode begins in.
        command: as in `CollectJob`.
        seed: of everything random.
        seconds: duration of the kept rows [s].
        perturbation: as in `CollectJob`.
        env_kwargs: of the environment.
        make_env: another environment factory.

    Raises:
        CollectionError: if falls leave less than a fifth of the steps.
    """
    job = CollectJob(task, seed, seconds, command, perturbation, dict(env_kwargs or {}))
    if job.command is not None and perturbation is not None:
        perturbation = dataclasses.replace(perturbation, command_interval=None)
    env = make_env(task, perturbation, **{"episode_s": EPISODE_S, **job.env_kwargs})
    try:
        rows = _record(env, job, lambda obs, begins: base_env(env).expert_action())
        return dataclasses.replace(rows, meta=rows.meta | {"factory": _name_of(make_env)})
    finally:
        env.close()


def watch(
    policy: Any,
    task: str,
    seed: int = 0,
    seconds: float = 30.0,
    perturbation: PerturbationConfig | None = None,
    history: int | None = None,
    *,
    make_env: EnvFactory = make_env,
    **env_kwargs: Any,
) -> Demonstrations:
    """Let a policy drive, and record what it did; no expert is asked.

    Args:
        policy: with ``predict(obs, deterministic=True)``, `env_kwargs` and `contract`;
            a `Learner` keeps its state, if it has one.
        task: name of the task that every episode begins in.
        seed: of everything random.
        seconds: duration of the kept rows [s].
        perturbation: as in `CollectJob`.
        history: frames of proprioception that are recorded, if more than the policy sees.
        make_env: another environment factory.
        env_kwargs: of the environment; on top of the policy's own ``env_kwargs``.

    Raises:
        InvalidInputError: if the policy sees more frames than that or was made for another environment, the seed is
            negative or the seconds are not positive.
        CollectionError: if falls leave less than a fifth of the steps.
    """
    frames = policy.contract.history
    history = frames if history is None else history
    if frames > history:
        raise InvalidInputError(
            f"the policy sees {frames} frames of proprioception, history must be that or more, got {history}"
        )
    job = CollectJob(task, seed, seconds, None, perturbation, {**policy.env_kwargs, **env_kwargs, "history": history})
    env = make_env(task, perturbation, **{"episode_s": EPISODE_S, **job.env_kwargs})
    try:
        contract = base_env(env).contract
        layout = contract.layout
        shown = ObservationLayout(contract.tasks, contract.channels, frames)
        policy.contract.check(contract.with_terms(terms_of(shown)), "the policy", "the environment")
        columns, learner = layout.columns(shown), Learner(policy)
        return _record(env, job, lambda obs, begins: learner.act(obs[columns], np.array([begins])))
    finally:
        env.close()


def _record(env: gymnasium.Env, job: CollectJob, act: Callable[[np.ndarray, bool], np.ndarray]) -> Demonstrations:
    """The rows of a job: what was seen, and what `act` made of it; it also drives, and is told of each beginning."""
    base = base_env(env)
    wanted = _rows(job, base.control_hz)
    obs_rows: list[np.ndarray] = []
    act_rows: list[np.ndarray] = []
    starts: list[int] = []
    steps = 0
    for episode in range(5 * wanted + 1):
        if len(obs_rows) >= wanted:
            break
        starts.append(len(obs_rows))
        options = {} if job.command is None else {"command": job.command}
        obs, _ = env.reset(seed=derive_seed("collect", job.task, job.seed, episode), options=options)
        begins, ended = True, False
        while not ended and len(obs_rows) < wanted:
            label, begins = act(obs, begins), False
            obs_rows.append(obs)
            act_rows.append(label)
            obs, _, terminated, truncated, _ = env.step(label)
            steps += 1
            ended = terminated or truncated
            if terminated:
                keep = max(starts[-1], len(obs_rows) - round(BEFORE_FALL_S * base.control_hz))
                del obs_rows[keep:], act_rows[keep:]
        if steps > 5 * wanted + base.control_hz * EPISODE_S:
            raise CollectionError(f"the driver keeps falling: kept {len(obs_rows)} of {steps} steps of {job.as_dict()}")
    marks = np.zeros(len(obs_rows), dtype=bool)
    marks[[start for start in starts if start < len(obs_rows)]] = True
    return Demonstrations(
        obs=np.array(obs_rows),
        acts=np.array(act_rows),
        starts=marks,
        contract=base.contract,
        meta={"job": job.as_dict()},
    )


def collect_all(
    jobs: Iterable[CollectJob],
    out_dir: str | PathLike[str],
    n_jobs: int = 1,
    progress: bool = False,
    *,
    make_env: EnvFactory = make_env,
) -> list[Path]:
    """Make one shard per job under `out_dir`; what is already there is kept, so an interrupted call can be repeated.

    Args:
        jobs: descriptions with different names.
        out_dir: folder of the ``.npz`` shards.
        n_jobs: processes, by joblib (``joblib.parallel_config`` chooses its backend, a cluster's too); 1 stays in this.
        progress: show a bar.
        make_env: another environment factory; picklable if n_jobs > 1.

    Returns:
        Paths of the shards, in the order of the jobs; read them with `Demonstrations.load`.

    Raises:
        ShardMismatchError: if a shard of that name was made from another description.
        InvalidInputError: if two jobs have one name, or one asks for what its environment or task does not allow.
    """
    jobs, n_jobs = list(jobs), checked_jobs(n_jobs)
    paths = [Path(out_dir) / f"{job.name}.npz" for job in jobs]
    if len(set(paths)) < len(paths):
        raise InvalidInputError(f"jobs must differ in task, kind or seed, got {sorted(job.name for job in jobs)}")
    contracts = _contracts(jobs, make_env)
    asked = zip(jobs, paths, (contracts[_setting(job)] for job in jobs))
    todo = [(job, path) for job, path, contract in asked if not _is_done(job, path, contract, make_env)]
    done = len(jobs) - len(todo)
    with Bar("collect", len(jobs), "shard", progress, done) as bar:
        if n_jobs == 1:
            for job, path in todo:
                _make_shard(job, path, make_env)
                bar.update()
        elif todo:
            tasks = (joblib.delayed(WithTasks(_make_shard))(job, path, make_env) for job, path in todo)
            with keep_interrupts():
                finished = joblib.Parallel(n_jobs=n_jobs, return_as="generator_unordered")(tasks)
            for _ in finished:
                bar.update()
    return paths


def _setting(job: CollectJob) -> str:
    """What jobs share that are made in equal environments."""
    return json.dumps([job.task, json_form(job.env_kwargs, "env_kwargs")])


def _contracts(jobs: Sequence[CollectJob], make_env: EnvFactory) -> dict[str, PolicyContract]:
    """The contract of each setting; impossible ones are refused here, before anything is made."""
    contracts = {}
    for setting, job in {_setting(job): job for job in jobs}.items():
        env = make_env(job.task, job.perturbation, **{"episode_s": EPISODE_S, **job.env_kwargs})
        contracts[setting] = base_env(env).contract
        env.close()
    for job in jobs:
        _rows(job, contracts[_setting(job)].control_hz)
        if job.command is not None and job.task in TASKS:
            TASKS[job.task].check_command(job.command)
    return contracts


def _rows(job: CollectJob, control_hz: float) -> int:
    """How many rows a job asks for.

    Raises:
        InvalidInputError: if it is none.
    """
    rows = round(job.seconds * control_hz)
    if rows < 1:
        raise InvalidInputError(f"seconds must be at least a control period, {1 / control_hz:g} s, got {job.seconds:g}")
    return rows


def _is_done(job: CollectJob, path: Path, contract: PolicyContract, make_env: EnvFactory) -> bool:
    try:
        shard = Demonstrations.load(path)
    except InvalidInputError:  # absent or damaged: make it again
        return False
    made_from = {name: shard.meta.get(name) for name in ("job", "factory")}
    asked_for = {"job": job.as_dict(), "factory": _name_of(make_env)}
    if made_from != asked_for:
        raise ShardMismatchError(
            f"{path} was made from {made_from}, now asked for {asked_for}; use another folder or delete it"
        )
    differences = contract.differences(shard.contract)
    if differences:
        raise ShardMismatchError(f"{path} was made under another contract: {differences}; use another folder")
    return True


def _name_of(make_env: EnvFactory) -> str:
    """Which factory, as far as a name tells."""
    return f"{getattr(make_env, '__module__', '')}:{getattr(make_env, '__qualname__', type(make_env).__qualname__)}"


def _make_shard(job: CollectJob, path: Path, make_env: EnvFactory) -> None:
    with threadpool_limits(1):
        collect(**{f.name: getattr(job, f.name) for f in dataclasses.fields(job)}, make_env=make_env).save(path)
