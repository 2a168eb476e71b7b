"""Settings of the main job: fields that are checked once, and what follows from them for each stage."""

import dataclasses
import operator
import os
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any, get_args

import numpy as np

from go1_mtl_gym import BUILT_IN_TASKS, DomainRandomization
from go1_mtl_gym.env_config import DEFAULT_CHANNELS, DEFAULT_HISTORY
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gait_space import GaitSpace
from go1_mtl_gym.sensing.observation import CHANNELS
from go1_mtl_gym.tasks import ANY_GAIT, check_task_names, gait_can_change
from go1_mtl_gym.validation import interval_s, number_in, one_of, parameters_of
from trainers.algorithms.config import BCConfig, DAggerConfig, PhaseConfig
from trainers.data.environments import PerturbationConfig
from trainers.data.operator import OperatorConfig
from trainers.pipeline.presets import PRESETS
from trainers.policies.modes import MODES
from trainers.utils.files import json_ready

NOISE_RAD = 0.06
"""Largest standard deviation of the noise on the expert's actions in perturbed demonstrations [rad]."""
ROUND_NOISE_RAD = 0.02
"""The same in DAgger rounds, where the learner perturbs enough [rad]."""
EACH, ENDS = 0.3, 0.4
"""Probability with which each figure of the world is drawn in a randomized episode, and then is an end of its range."""
DEVICES = ("cpu", "cuda")


def _from(low: float, default: Any, above: bool = False) -> Any:
    """A field of a number that is at least `low`, or greater than it."""
    return dataclasses.field(default=default, metadata={"low": low, "above": above})


@dataclasses.dataclass(frozen=True)
class JobConfig:
    """What the main job does; all durations are seconds of robot time per task.

    Numbers may be numpy's; they are kept as Python's, so that every configuration can be written to a file.

    Attributes:
        preset: name of the preset that the rest started from.
        tasks: which gaits, in head order.
        rounds: DAgger rounds.
        seed: of everything random.
        n_envs: worker processes.
        device: of the training, "cpu" or "cuda".
        threads: of the training on a CPU; their number can change the last digits of a result.
        channels: optional parts of the observation.
        history: proprioceptive frames in the observation.
        control_hz: rate of the policy [Hz].
        kp: stiffness of the actuators [N m/rad].
        kd: their damping [N m s/rad].
        clean_s: undisturbed demonstrations.
        perturbed_s: perturbed demonstrations.
        hard_push_s: perturbed demonstrations that are pushed hard.
        randomized_s: perturbed demonstrations with physics and sensors that are drawn.
        held_out_s: undisturbed demonstrations that no policy learns from, for the R2.
        operator: whose hands drive in perturbed demonstrations, rounds and evaluation; None draws commands and gaits.
        margin: how far the operator of demonstrations and rounds reaches, as a multiple of the deflection that the
            policy is evaluated with.
        hard_push_interval: mean time between pushes at the edge of what the expert bears in `hard_push_s` [s]; in
            rounds they come half as often. None pushes hard nowhere.
        randomized: fraction of the episodes in rounds whose physics and sensors are drawn, by the ranges of
            `go1_mtl_gym.DomainRandomization`.
        world_s: length of the episodes that may be randomized [s]; the next one has another world.
        task_interval: shortest and longest time between changes of gait in perturbed episodes without an operator, or
            None.
        corner_fraction: probability with which a new command in these is a corner of its range.
        mirror: whether to learn from the mirror image of every row too.
        shard_s: length of a shard, which begins with a standing start.
        dagger_s: recorded in each DAgger round.
        takeover_rad: in rounds the expert takes over when the learner is so far from it [rad]; None never.
        round_weight: how many times as often a row of a round is drawn in training as a demonstration.
        width: units of each hidden layer.
        normalization: of inputs and outputs, see `trainers.MultiHeadPolicy`.
        batch_size: rows per gradient step.
        clone_steps: gradient steps of cloning.
        round_steps: gradient steps of each round.
        phase_free_s: the policy's walks that the phase-free policy learns the phase from, per gait; 0 makes none.
        phase_free_history: frames of proprioception that it reads.
        phase_free_steps: gradient steps of its phase estimator.
        episodes: of the evaluation, per task and agent, with drawn commands, and as many in the operator's hands.
        episode_s: their length [s].
        command_interval: time between drawn commands in them [s].
        round_episodes: episodes per task after each DAgger round.
        round_video_s: length of the film of every round in the log; 0 makes none.
        video_s: length of the videos.
        gaits: that are drawn where the one task is "any_gait".
        wandb: whether to log to Weights & Biases too, with the package of that name.

    Raises:
        InvalidInputError: if a setting cannot be.
    """

    preset: str = "default"
    tasks: tuple[str, ...] = BUILT_IN_TASKS
    rounds: int = _from(0, 3)
    seed: int = _from(0, 0)
    n_envs: int = _from(1, os.cpu_count() or 1)
    device: str = "cpu"
    threads: int = _from(1, 1)
    channels: tuple[str, ...] = DEFAULT_CHANNELS
    history: int = _from(1, DEFAULT_HISTORY)
    control_hz: int = _from(1, 50)
    kp: float = _from(0, 50.0, above=True)
    kd: float = _from(0, 2.0)
    clean_s: float = _from(0, 60.0)
    perturbed_s: float = _from(0, 210.0)
    hard_push_s: float = _from(0, 90.0)
    randomized_s: float = _from(0, 90.0)
    operator: OperatorConfig | None = OperatorConfig()
    margin: float = _from(0, 1.2, above=True)
    hard_push_interval: float | None = _from(0, 2.5, above=True)
    held_out_s: float = _from(0, 60.0, above=True)
    randomized: float = _from(0, 0.3)
    world_s: float = _from(0, 5.0, above=True)
    task_interval: tuple[float, float] | None = (2.0, 6.0)
    corner_fraction: float = _from(0, 0.25)
    mirror: bool = True
    shard_s: float = _from(0, 15.0, above=True)
    dagger_s: float = _from(0, 60.0, above=True)
    takeover_rad: float | None = _from(0, 0.2, above=True)
    round_weight: int = _from(1, 2)
    width: int = _from(1, 256)
    normalization: str = "mean_std"
    batch_size: int = _from(1, 1024)
    clone_steps: int = _from(1, 6000)
    round_steps: int = _from(1, 2500)
    phase_free_s: float = _from(0, 240.0)
    phase_free_history: int = _from(1, 10)
    phase_free_steps: int = _from(1, 4000)
    episodes: int = _from(1, 10)
    episode_s: float = _from(0, 30.0, above=True)
    command_interval: float = _from(0, 5.0, above=True)
    round_episodes: int = _from(1, 2)
    round_video_s: float = _from(0, 2.0)
    video_s: float = _from(0, 4.0, above=True)
    wandb: bool = False
    gaits: GaitSpace = GaitSpace()

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            if "low" in field.metadata:
                object.__setattr__(self, field.name, _number(getattr(self, field.name), field))
        object.__setattr__(self, "tasks", check_task_names(self.tasks))
        object.__setattr__(self, "channels", _names(self.channels))
        object.__setattr__(self, "task_interval", interval_s(self.task_interval, "task_interval"))
        one_of(self.normalization, MODES, "normalization")
        one_of(str(self.device).partition(":")[0], DEVICES, "device")
        if isinstance(self.operator, Mapping):
            object.__setattr__(self, "operator", OperatorConfig(**self.operator))
        object.__setattr__(self, "gaits", parameters_of(self.gaits, GaitSpace, "gaits"))
        for name in ("randomized", "corner_fraction"):
            number_in(getattr(self, name), 0.0, 1.0, name)
        if self.phase_free_s and self.has_clock and self.phase_free_history < self.history:
            raise InvalidInputError(
                f"without a clock the policy reads its {self.history} frames and more, got phase_free_history = "
                f"{self.phase_free_history}"
            )
        if min(self.shards(self.clean_s) + self.shards(self.perturbed_s), self.shards(self.held_out_s)) < 1:
            raise InvalidInputError(
                f"clean_s + perturbed_s and held_out_s must each fill a shard of shard_s = {self.shard_s:g} s, "
                f"got {self.clean_s:g} + {self.perturbed_s:g} and {self.held_out_s:g}"
            )

    # -- Other settings ------------------------------------------------------------------------------------------------

    @classmethod
    def from_preset(cls, name: str, **options: Any) -> "JobConfig":
        """Settings of a preset, some of them replaced.

        Args:
            name: one of `PRESETS`.
            options: fields of this class.

        Raises:
            InvalidInputError: if there is no such preset or field, or a value cannot be.
        """
        return cls(preset=one_of(name, tuple(PRESETS), "preset")).with_options(**(PRESETS[name] | options))

    def with_options(self, **options: Any) -> "JobConfig":
        """A copy with other values of some fields.

        Raises:
            InvalidInputError: if there is no such field, or a value cannot be.
        """
        names = [field.name for field in dataclasses.fields(self)]
        for name in options:
            one_of(name, names, "setting of the main job")
        return dataclasses.replace(self, **options)

    # -- What follows for the stages -----------------------------------------------------------------------------------

    @property
    def env_kwargs(self) -> dict[str, Any]:
        """Of the environments that demonstrations are collected in and policies act in."""
        names = ("tasks", "channels", "history", "control_hz", "kp", "kd")
        return {name: getattr(self, name) for name in (*names, *(["gaits"] if self.is_any_gait else []))}

    @property
    def literal_env_kwargs(self) -> dict[str, Any]:
        """Of the paper-literal policy: the 34 numbers and the task id."""
        return self.env_kwargs | {"channels": (), "history": 1}

    def randomization_kwargs(self, fraction: float) -> dict[str, Any]:
        """What environments have on top of `env_kwargs` if a fraction of their episodes is randomized.

        Their expert is told what was drawn; the student must find out.
        """
        if not fraction:
            return {}
        randomization = DomainRandomization(fraction=fraction, each=EACH, ends=ENDS)
        return {"randomization": randomization, "privileged": True, "episode_s": self.world_s}

    def perturbation(self, noise_rad: float, hard_push_interval: float | None = None) -> PerturbationConfig:
        """How an episode is perturbed.

        Args:
            noise_rad: largest standard deviation of the noise on actions [rad].
            hard_push_interval: mean time between the hard pushes of the operator, if there is one [s].
        """
        operator, several = self.operator, gait_can_change(self.tasks)
        if operator is not None:
            operator = dataclasses.replace(
                operator if several else operator.of_one_gait(),
                hard_push_interval=hard_push_interval,
                deflection=self.margin * operator.deflection,
            )
        return PerturbationConfig(
            noise_rad=noise_rad,
            corner_fraction=self.corner_fraction,
            task_interval=self.task_interval if several else None,
            operator=operator,
        )

    @property
    def round_perturbation(self) -> PerturbationConfig:
        """How the episodes of DAgger rounds are perturbed: the learner's own errors come on top."""
        interval = None if self.hard_push_interval is None else 2 * self.hard_push_interval
        return self.perturbation(ROUND_NOISE_RAD, interval)

    def shards(self, seconds: float) -> int:
        """How many shards hold the seconds of one task."""
        return round(seconds / self.shard_s)

    @property
    def is_literal(self) -> bool:
        """Whether the policy sees what the paper's sees, and the paper-literal baseline would be the same again."""
        return not self.channels and self.history == 1

    @property
    def is_any_gait(self) -> bool:
        """Whether the one task is that whose gait is drawn."""
        return self.tasks == (ANY_GAIT,)

    @property
    def has_clock(self) -> bool:
        """Whether the policy sees a gait clock and a command, and so can do without the clock later."""
        return {"command", "phase"} <= set(self.channels)

    @property
    def bc(self) -> BCConfig:
        """How to clone."""
        interval = max(50, self.clone_steps // 30)  # each entry of the log costs a pass over the held-out rows
        return BCConfig(
            steps=self.clone_steps,
            batch_size=self.batch_size,
            log_interval=interval,
            seed=self.seed,
            mirror=self.mirror,
        )

    @property
    def round_bc(self) -> BCConfig:
        """How to train in a DAgger round."""
        return dataclasses.replace(self.bc, steps=self.round_steps, learning_rate=1e-3)

    @property
    def baseline_bc(self) -> BCConfig:
        """How to train a baseline: with as many gradient steps as the policy got in all."""
        return dataclasses.replace(self.bc, steps=self.clone_steps + self.rounds * self.round_steps)

    @property
    def dagger(self) -> DAggerConfig:
        """How to collect a DAgger round."""
        return DAggerConfig(
            seconds_per_task=self.dagger_s,
            takeover_rad=self.takeover_rad,
            round_weight=self.round_weight,
            seed=self.seed,
        )

    @property
    def phase(self) -> PhaseConfig:
        """How to train the phase estimator."""
        return PhaseConfig(steps=self.phase_free_steps, seed=self.seed)

    def as_dict(self) -> dict[str, Any]:
        """The settings as JSON values."""
        return json_ready(dataclasses.asdict(self))


def _number(value: Any, field: "dataclasses.Field[Any]") -> int | float | None:
    """A field's value as Python's own number, checked against the field's lower bound."""
    if value is None and type(None) in get_args(field.type):
        return None
    low, above = field.metadata["low"], field.metadata["above"]
    kind = "an integer" if field.type is int else "a number"
    expected = f"{field.name} must be {kind} {'greater than' if above else 'of at least'} {low}, got {value!r}"
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        number = operator.index(value) if field.type is int else _finite(value)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(expected) from error
    if number < low or (above and number == low):
        raise InvalidInputError(expected)
    return number


def _finite(value: object) -> float:
    if not isinstance(value, Real) or not np.isfinite(float(value)):
        raise TypeError
    return float(value)


def _names(channels: Sequence[str]) -> tuple[str, ...]:
    if isinstance(channels, str):
        raise InvalidInputError(f"channels must be a sequence of names of channels, got {channels!r}")
    return tuple(one_of(name, tuple(CHANNELS), "channel") for name in channels)
