"""How the algorithms train: settings, which can be read and written without PyTorch."""

import dataclasses

from go1_mtl_gym.errors import InvalidInputError

SPACES = ("radians", "normalized")
"""In which the cloning loss is taken."""
PRECISIONS = ("highest", "high", "medium")
"""Of float32 matrix products, as `torch.set_float32_matmul_precision` has them."""


@dataclasses.dataclass(frozen=True)
class BCConfig:
    """How to clone.

    Attributes:
        steps: gradient steps.
        batch_size: rows per step, shared evenly among the tasks.
        learning_rate: peak of the one-cycle schedule.
        warmup: fraction of the steps before the peak.
        weight_decay: of AdamW.
        max_grad_norm: gradients longer than this are shortened.
        space: "radians" or "normalized"; see `trainers.algorithms.losses.MultiTaskLoss`.
        ema_decay: if positive, the result is an exponential moving average of the weights with this decay per step.
        log_interval: steps between entries of log and history.
        seed: of the order of the rows.
        mirror: learn from every row and from its image in a mirror (`trainers.mirrored`), where the gait has one.
        matmul_precision: of float32 matrix products while training: "highest", "high" or "medium", as
            `torch.set_float32_matmul_precision` has it. Faster where the processor has something faster to offer.
        autocast: whether the network computes in bfloat16, which is faster still; the weights stay float32.

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    steps: int = 7000
    batch_size: int = 1024
    learning_rate: float = 2e-3
    warmup: float = 0.1
    weight_decay: float = 1e-4
    max_grad_norm: float = 1.0
    space: str = "radians"
    ema_decay: float = 0.0
    log_interval: int = 250
    seed: int = 0
    mirror: bool = False
    matmul_precision: str = "highest"
    autocast: bool = False

    def __post_init__(self) -> None:
        for name in ("steps", "batch_size", "log_interval", "learning_rate", "max_grad_norm"):
            if not getattr(self, name) > 0:
                raise InvalidInputError(f"{name} must be positive, got {getattr(self, name)!r}")
        for name in ("warmup", "ema_decay"):
            if not 0 <= getattr(self, name) < 1:
                raise InvalidInputError(f"{name} must lie in [0, 1), got {getattr(self, name)!r}")
        if self.weight_decay < 0:
            raise InvalidInputError(f"weight_decay must be >= 0, got {self.weight_decay!r}")
        for name, known in (("space", SPACES), ("matmul_precision", PRECISIONS)):
            if getattr(self, name) not in known:
                raise InvalidInputError(f"{name} must be one of {', '.join(known)}; got {getattr(self, name)!r}")


@dataclasses.dataclass(frozen=True)
class DAggerConfig:
    """How to collect a round.

    Attributes:
        seconds_per_task: rows recorded per task and round [s].
        beta: probability that a block of the first round is the expert's.
        beta_decay: factor on beta per round.
        block_s: shortest and longest block [s].
        takeover_rad: the expert takes over when the root mean square over the joints of the learner's joint targets
            less its own exceeds this [rad]; None never. See `trainers.BlockCollector`.
        round_weight: how many times as often a row of a round is drawn in training as a row of the base.
        seed: of everything random in collection.

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    seconds_per_task: float = 60.0
    beta: float = 0.5
    beta_decay: float = 1.0
    block_s: tuple[float, float] = (0.3, 1.0)
    takeover_rad: float | None = None
    round_weight: int = 1
    seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "block_s", tuple(self.block_s))
        if not self.seconds_per_task > 0 or self.seed < 0:
            raise InvalidInputError(f"seconds_per_task must be > 0 and seed >= 0, got {self}")
        if not (0 <= self.beta <= 1 and 0 <= self.beta_decay <= 1):
            raise InvalidInputError(f"beta and beta_decay must lie in [0, 1], got {self}")
        if len(self.block_s) != 2 or not 0 < self.block_s[0] <= self.block_s[1]:
            raise InvalidInputError(f"block_s must be 0 < shortest <= longest, got {self.block_s}")
        if self.takeover_rad is not None and not self.takeover_rad > 0:
            raise InvalidInputError(f"takeover_rad must be None or positive, got {self.takeover_rad}")
        if isinstance(self.round_weight, bool) or not isinstance(self.round_weight, int) or self.round_weight < 1:
            raise InvalidInputError(f"round_weight must be an integer of at least 1, got {self.round_weight!r}")

    def beta_of(self, round_num: int) -> float:
        """Probability of an expert block in a round, counted from 0."""
        return self.beta * self.beta_decay**round_num


@dataclasses.dataclass(frozen=True)
class PhaseConfig:
    """How to train a `PhaseEstimator`.

    Attributes:
        steps: gradient steps.
        batch_size: rows per step.
        learning_rate: peak of the one-cycle schedule.
        weight_decay: of AdamW.
        seed: of the order of the rows.

    Raises:
        InvalidInputError: if a figure is outside its range.
    """

    steps: int = 4000
    batch_size: int = 1024
    learning_rate: float = 2e-3
    weight_decay: float = 1e-4
    seed: int = 0

    def __post_init__(self) -> None:
        if not (self.steps > 0 and self.batch_size > 0 and self.learning_rate > 0 and self.weight_decay >= 0):
            raise InvalidInputError(f"steps, batch_size and learning_rate must be > 0, weight_decay >= 0; got {self}")
