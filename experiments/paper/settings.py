"""What the paper collected and trained, as settings: its tables, and how much is made of them; and the commands."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

import trainers
from experiments.paper.published import KINDS
from experiments.study import option
from experts import HARDWARE_LIKE
from go1_mtl_gym import TASKS, EstimatorNoise
from go1_mtl_gym.env_config import EXPERT_ONLY
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import finite_vector, number_in, one_of
from trainers import BCConfig
from trainers.data.collection import EPISODE_S
from trainers.data.environments import derive_seed
from trainers.policies.checkpoint import checked_device

Command = tuple[float, float, float]
"""(vx [m/s], vy [m/s], yaw rate [rad/s])."""
PRECISIONS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {"float32": {}, "medium": {"matmul_precision": "medium"}, "bfloat16": {"autocast": True}}
)
"""Name -> how `trainers.BCConfig` asks for it. "medium" multiplies matrices in bfloat16 and keeps float32 between them,
"bfloat16" computes all of the network in it; weights, loss and measurements are float32 in all of them."""
MOST_COMMANDS = 100
"""Most commands of one use; their seeds stand this far apart."""


@dataclass(frozen=True)
class Table:
    """One table of the paper.

    Attributes:
        name: of the table here.
        published: name of the paper's table that it stands beside, in `PUBLISHED`.
        gaits: names of the tasks, in head order.
        world: arguments of `go1_mtl_gym.Go1Env` that make data as the table's.
        named: gait -> the command that the authors held out, for all gaits; empty if they name none.

    Raises:
        InvalidInputError: if commands are named for some gaits and not for others, or one is beyond its task's limit.
    """

    name: str
    published: str
    gaits: tuple[str, ...]
    world: Mapping[str, Any]
    named: Mapping[str, Command] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("world", "named"):
            object.__setattr__(self, name, dict(getattr(self, name)))  # views of dictionaries cannot be pickled
        if self.named and set(self.named) != set(self.gaits):
            raise InvalidInputError(f"commands must be named for none or all of {self.gaits}, got {[*self.named]}")
        for gait, command in self.named.items():
            TASKS[gait].check_command(command)

    @property
    def env_kwargs(self) -> dict[str, Any]:
        """Of the environments: the paper's 34 numbers, the task id, and the gains of this project."""
        kwargs = {"tasks": self.gaits, "channels": (), "history": 1, "kp": 50.0, "kd": 2.0}
        return kwargs | dict(self.world)

    @property
    def policy_kwargs(self) -> dict[str, Any]:
        """Of the policies' environments: what only the expert notices is left out."""
        return {name: value for name, value in self.env_kwargs.items() if name not in EXPERT_ONLY}


SIMULATION = Table(
    "simulation",
    "simulation",
    ("trot", "jump", "bound"),
    {"control_hz": 1000},
    {"trot": (0.7, 0.3, 0.0), "jump": (0.6, 0.3, 0.0), "bound": (0.5, 0.2, 0.0)},
)
HARDWARE = Table("hardware", "hardware", ("trot", "walk"), HARDWARE_LIKE)
HALF_NOISE = Table(
    "hardware_half_noise",
    "hardware",
    ("trot", "walk"),
    {**HARDWARE_LIKE, "estimator_noise": EstimatorNoise().scaled(0.5)},
)
"""With the whole noise, what an expert makes of the true state differs from its noisy answer by more than the paper's
students do from theirs."""
ESTIMATOR = Table(
    "hardware_estimator",
    "hardware",
    ("trot", "walk"),
    {**HARDWARE_LIKE, "estimator_noise": None, "state_estimator": True},
)
"""As on a robot, where what the expert knows of the state comes from the readings that the student sees."""
TABLES = MappingProxyType({table.name: table for table in (SIMULATION, HARDWARE, HALF_NOISE, ESTIMATOR)})
"""The tables by name, in the order of the page."""


@dataclass(frozen=True)
class PaperOptions:
    """How much is collected and how it is cloned, in every table.

    Raises:
        InvalidInputError: if a number is outside its range, or the device is not there.
    """

    train_commands: int = option(20, "per gait; 20 in the paper")
    unseen_commands: int = option(10, "per gait, held out on top of those that the authors name")
    seconds: float = option(EPISODE_S, "recorded with each command [s], at most an episode; 30 in the paper")
    span: tuple[float, float] = option(
        (0.8, 0.5), "largest |vx| and |vy| of a drawn command [m/s]; those of the paper. The yaw rate is 0"
    )
    gap: float = option(0.05, "held-out commands are at least this far from every other one [m/s]")
    data_seed: int = option(0, "of commands and episodes; trainings have their own")
    widths: tuple[int, ...] = option((512,), "units of every hidden layer, a policy each; 2560 in the paper")
    seeds: tuple[int, ...] = option((0, 1, 2, 3, 4), "of the trainings")
    steps: int = option(20_000, "gradient steps of every training")
    batch_size: int = option(1024, "rows per step, shared evenly among the gaits")
    learning_rate: float = option(2e-3, "peak of the one-cycle schedule")
    normalization: str = option("min_max", "of inputs and outputs; the paper's is 'min_max'")
    space: str = option("radians", "of the loss, see trainers.BCConfig")
    precision: str = option("bfloat16", "of the trainings, one of PRECISIONS")
    curve_points: int = option(40, "entries of a curve of the held-out loss")
    curve_rows: int = option(3000, "held-out rows per gait that such an entry is measured on")
    kinds: tuple[str, ...] = option(tuple(KINDS), "of policies")
    device: str = option("cpu", "of the trainings, 'cpu' or 'cuda'")
    threads: int = option(1, "of each training on a CPU; changes the last digits")

    def __post_init__(self) -> None:
        for name in ("train_commands", "unseen_commands"):
            number_in(getattr(self, name), 1, MOST_COMMANDS, name)
        number_in(self.batch_size, max(len(table.gaits) for table in TABLES.values()), 1e7, "batch_size")
        number_in(self.seconds, 0.1, EPISODE_S, "seconds")
        number_in(self.data_seed, 0, 10_000, "data_seed")
        for name, high in (("widths", 1e5), ("seeds", 2**31 - 1)):
            values = getattr(self, name)
            if not values or len(set(values)) < len(values):
                raise InvalidInputError(f"{name} must be different numbers, at least one, got {values}")
            for value in values:
                number_in(value, name == "widths", high, name)
        for name in ("curve_points", "curve_rows"):
            number_in(getattr(self, name), 1, 1e6, name)
        if not (finite_vector(self.span, 2, "span") > 0).all() or not self.gap >= 0:
            raise InvalidInputError(f"span must be positive and gap >= 0, got {self.span} and {self.gap}")
        one_of(self.precision, tuple(PRECISIONS), "precision")
        for kind in self.kinds:
            one_of(kind, tuple(KINDS), "kind of policy")
        checked_device(self.device)
        number_in(self.threads, 1, 1024, "threads")
        self.bc(0, 1.0)

    def bc(self, seed: int, fraction: float) -> BCConfig:
        """How to clone.

        Args:
            seed: of the order of the rows.
            fraction: of the gaits that the policy learns; a network of one gait draws as many of its rows per step as
                a network of all gaits does.
        """
        return BCConfig(
            steps=self.steps,
            batch_size=round(self.batch_size * fraction),
            learning_rate=self.learning_rate,
            space=self.space,
            log_interval=max(1, round(self.steps / self.curve_points)),
            seed=seed,
            **PRECISIONS[self.precision],
        )

    def largest(self, gait: str) -> np.ndarray:
        """Largest |vx|, |vy| [m/s] and |yaw rate| [rad/s] that are drawn: `span`, within the task's limit."""
        return np.minimum([*self.span, 0.0], TASKS[gait].command_limit)


QUICK = PaperOptions(
    train_commands=2,
    unseen_commands=1,
    seconds=0.5,
    widths=(16,),
    seeds=(0,),
    steps=40,
    batch_size=96,
    curve_points=2,
    curve_rows=100,
)
"""Everything is made, nothing is made well."""


# -- Commands ----------------------------------------------------------------------------------------------------------

TRAIN, NAMED, UNSEEN = "train", "named", "unseen"
"""What a shard is for: training, or testing with the authors' held-out command, or with others that are held out."""
TRIES = 10_000


def draw_apart(
    rng: np.random.Generator, count: int, largest: np.ndarray, others: Sequence[Command], gap: float
) -> list[Command]:
    """Uniform draws of commands that keep away from some others.

    Args:
        rng: that is drawn from.
        count: how many.
        largest: of each component's absolute value, shape (3,).
        others: what a draw must be at least `gap` away from in (vx, vy).
        gap: [m/s].

    Raises:
        InvalidInputError: if no such command is found in 10,000 draws.
    """
    taken = np.array(others, dtype=float).reshape(-1, 3)[:, :2]
    drawn: list[Command] = []
    for _ in range(TRIES):
        if len(drawn) == count:
            return drawn
        command = rng.uniform(-1.0, 1.0, 3) * largest
        if (np.linalg.norm(taken - command[:2], axis=1) >= gap).all():
            drawn.append(tuple((command + 0.0).tolist()))
    raise InvalidInputError(f"expected room for {count} commands {gap} m/s from {len(taken)} others, got {len(drawn)}")


def commands(table: Table, gait: str, options: PaperOptions) -> dict[str, list[Command]]:
    """The commands of a gait by what they are for; those held out are `options.gap` from all that are trained on."""
    largest, named = options.largest(gait), [table.named[gait]] if table.named else []
    rngs = [np.random.default_rng(derive_seed(table.name, gait, use, options.data_seed)) for use in (TRAIN, UNSEEN)]
    train = draw_apart(rngs[0], options.train_commands, largest, named, options.gap)
    unseen = draw_apart(rngs[1], options.unseen_commands, largest, [*train, *named], options.gap)
    return {TRAIN: train, NAMED: named, UNSEEN: unseen}


def shard_jobs(table: Table, options: PaperOptions) -> dict[str, list[trainers.CollectJob]]:
    """Descriptions of the shards, one per gait and command, by what they are for."""
    jobs: dict[str, list[trainers.CollectJob]] = {TRAIN: [], NAMED: [], UNSEEN: []}
    for gait in table.gaits:
        for block, (use, given) in enumerate(commands(table, gait, options).items()):
            first = (options.data_seed * len(jobs) + block) * MOST_COMMANDS
            jobs[use] += [
                trainers.CollectJob(gait, first + i, options.seconds, command, None, table.env_kwargs)
                for i, command in enumerate(given)
            ]
    return jobs
