"""Settings of the main job: presets, command line, and their check."""

import argparse
import dataclasses
import os
from typing import Any

from go1_mtl_gym import PAPER_TASKS, TASKS, DomainRandomization, InvalidInputError
from go1_mtl_gym.sensing.observation import CHANNELS
from trainers import BCConfig, DAggerConfig, PerturbationConfig

NOISE_RAD = 0.06
"""Largest standard deviation of the noise on the expert's actions in disturbed demonstrations [rad]."""
ROUND_NOISE_RAD = 0.02
"""The same in DAgger rounds, where the learner disturbs enough [rad]."""


@dataclasses.dataclass(frozen=True)
class JobConfig:
    """What the main job does; all durations are seconds of robot time per task.

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
        kp, kd: gains of the actuators [N m/rad, N m s/rad].
        clean_s, perturbed_s, held_out_s: demonstrations: undisturbed, disturbed, and undisturbed for the R2.
        randomized: share of the disturbed episodes whose physics and sensor noise are drawn, by the ranges of
            `go1_mtl_gym.DomainRandomization`.
        task_interval: shortest and longest time between changes of gait in disturbed episodes, or None.
        corner_fraction: probability with which a new command in them is a corner of its range.
        shard_s: length of a shard, which begins with a standing start.
        dagger_s: recorded in each DAgger round.
        takeover_rad: of the DAgger rounds, see `trainers.DAggerConfig`.
        width: units of each hidden layer.
        normalization: of inputs and outputs, see `trainers.MultiHeadPolicy`.
        batch_size: rows per gradient step.
        clone_steps, round_steps: gradient steps of cloning and of each round.
        phase_free_s: the student's walks that the phase_free student learns the phase from, per gait; 0 makes none.
        phase_free_history: frames of proprioception that it reads.
        phase_free_steps: gradient steps of its phase estimator.
        episodes, episode_s, command_interval: of the closed-loop evaluation, per task and learner; a new command comes
            every so many seconds.
        round_episodes: episodes per task after each DAgger round.
        video_s: length of the videos.

    Raises:
        InvalidInputError: if a setting cannot be.
    """

    preset: str = "default"
    tasks: tuple[str, ...] = PAPER_TASKS
    rounds: int = 3
    seed: int = 0
    n_envs: int = os.cpu_count() or 1
    device: str = "cpu"
    threads: int = 1
    channels: tuple[str, ...] = ("command", "phase", "last_action")
    history: int = 1
    control_hz: int = 50
    kp: float = 50.0
    kd: float = 2.0
    clean_s: float = 60.0
    perturbed_s: float = 300.0
    held_out_s: float = 60.0
    randomized: float = 0.3
    task_interval: tuple[float, float] | None = (2.0, 6.0)
    corner_fraction: float = 0.25
    shard_s: float = 15.0
    dagger_s: float = 60.0
    takeover_rad: float | None = None
    width: int = 256
    normalization: str = "mean_std"
    batch_size: int = 1024
    clone_steps: int = 6000
    round_steps: int = 2500
    phase_free_s: float = 240.0
    phase_free_history: int = 10
    phase_free_steps: int = 4000
    episodes: int = 20
    episode_s: float = 30.0
    command_interval: float = 5.0
    round_episodes: int = 2
    video_s: float = 4.0

    def __post_init__(self) -> None:
        for name in ("tasks", "channels"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        unknown = [name for name in self.tasks if name not in TASKS]
        if unknown or not self.tasks:
            raise InvalidInputError(f"tasks must be some of {', '.join(TASKS)}; got {self.tasks}")
        if self.rounds < 0 or self.n_envs < 1 or self.threads < 1 or self.seed < 0:
            raise InvalidInputError(f"rounds and seed must be >= 0, n_envs and threads >= 1, got {self}")

    @property
    def env_kwargs(self) -> dict[str, Any]:
        """Of the environments that demonstrations are collected in and students act in."""
        return {
            "tasks": self.tasks,
            "channels": self.channels,
            "history": self.history,
            "control_hz": self.control_hz,
            "kp": self.kp,
            "kd": self.kd,
        }

    @property
    def world(self) -> dict[str, Any]:
        """What is different about environments in which disturbed episodes and rounds take place."""
        return {"randomization": DomainRandomization(fraction=self.randomized)} if self.randomized else {}

    def disturbed(self, noise_rad: float) -> PerturbationConfig:
        """How a disturbed episode is disturbed, with action noise of at most `noise_rad`."""
        several = len(self.tasks) > 1
        return PerturbationConfig(
            noise_rad=noise_rad,
            corner_fraction=self.corner_fraction,
            task_interval=self.task_interval if several else None,
        )

    @property
    def literal_env_kwargs(self) -> dict[str, Any]:
        """Of the paper-literal student: the 34 numbers and the task id."""
        return self.env_kwargs | {"channels": (), "history": 1}

    @property
    def has_clock(self) -> bool:
        """Whether the student sees a gait clock and a command, and so can do without the clock later."""
        return {"command", "phase"} <= set(self.channels) and self.history == 1

    @property
    def bc(self) -> BCConfig:
        """How to clone."""
        interval = max(50, self.clone_steps // 30)  # each entry of the log costs a pass over the held-out rows
        return BCConfig(steps=self.clone_steps, batch_size=self.batch_size, log_interval=interval, seed=self.seed)

    @property
    def round_bc(self) -> BCConfig:
        """How to train in a DAgger round."""
        return dataclasses.replace(self.bc, steps=self.round_steps, learning_rate=1e-3)

    @property
    def dagger(self) -> DAggerConfig:
        """How to collect a DAgger round."""
        return DAggerConfig(seconds_per_task=self.dagger_s, takeover_rad=self.takeover_rad, seed=self.seed)


PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "smoke": {
        "rounds": 1,
        "clean_s": 3.0,
        "perturbed_s": 6.0,
        "held_out_s": 3.0,
        "shard_s": 3.0,
        "dagger_s": 2.0,
        "width": 64,
        "batch_size": 256,
        "clone_steps": 300,
        "round_steps": 100,
        "phase_free_s": 2.0,
        "phase_free_steps": 100,
        "episodes": 2,
        "episode_s": 5.0,
        "round_episodes": 1,
        "video_s": 1.0,
    },
    # arXiv 2505.08574: 20 commands of 30 s per gait at 1 kHz, clean; min-max scaling; 2560 units; no DAgger.
    "paper": {
        "rounds": 0,
        "channels": (),
        "control_hz": 1000,
        "clean_s": 600.0,
        "perturbed_s": 0.0,
        "randomized": 0.0,
        "task_interval": None,
        "phase_free_s": 0.0,
        "held_out_s": 60.0,
        "shard_s": 30.0,
        "width": 2560,
        "threads": os.cpu_count() or 1,
        "normalization": "min_max",
        "clone_steps": 30_000,
        "episodes": 5,
    },
}


def parse(arguments: list[str] | None = None) -> tuple[JobConfig, str | None]:
    """Read the command line.

    Returns:
        The settings, and the output folder (None: choose one).
    """
    parser = argparse.ArgumentParser(
        description="Teach one network several gaits of a Go1 from an MPC expert, and measure how well it moves.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add("--preset", choices=tuple(PRESETS), default="default", help="smoke: 2 minutes; default: 15; paper: a day")
    add("--out", help="folder of the results; an interrupted run goes on in the same one (default: runs/<date>)")
    add("--tasks", nargs="+", choices=tuple(TASKS), default=list(PAPER_TASKS), help="gaits, in head order")
    add("--rounds", type=int, default=None, help="DAgger rounds; the preset's if not given")
    add("--seed", type=int, default=0, help="of everything random")
    add("--n-envs", type=int, default=os.cpu_count() or 1, help="worker processes")
    add("--device", default="cpu", help="of the training: cpu or cuda")
    add(
        "--channels",
        nargs="*",
        choices=tuple(CHANNELS),
        default=None,
        help="parts of the observation; the preset's if not given",
    )
    add("--history", type=int, default=1, help="proprioceptive frames in the observation")
    add("--control-hz", type=int, default=None, help="rate of the policy; the preset's if not given")
    given = vars(parser.parse_args(arguments))
    out = given.pop("out")
    settings = PRESETS[given["preset"]] | {name: value for name, value in given.items() if value is not None}
    return JobConfig(**settings), out
