"""``go1-mtl-gym collect --out FOLDER``."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.env_config import DEFAULT_CHANNELS, DEFAULT_HISTORY
from go1_mtl_gym.tasks import BUILT_IN_TASKS
from go1_mtl_gym.validation import integer_in
from trainers.cli.names import ChannelName, Command, GaitName
from trainers.cli.options import parse
from trainers.data.collection import CollectJob, collect_all
from trainers.data.environments import PerturbationConfig
from trainers.data.operator import OperatorConfig
from trainers.utils.cli import writable_folder

GAINS = PDGains()


@dataclasses.dataclass(frozen=True)
class Options:
    """Record demonstrations of the expert: shards that any machine makes alike from their gait and seed.

    Attributes:
        out: Folder of the shards; those that are there already are kept.
        tasks: Gaits that the robot knows, in the order of the task id; each is demonstrated.
        shards: How many of each gait.
        seconds: Duration of the rows of a shard [s].
        seed: Of the first shard of each gait; those after it count up.
        command: Forward and sideways velocity [m/s] and yaw rate [rad/s] throughout; drawn if not given.
        clean: Leave the expert undisturbed.
        hands: Let an operator's hands drive and push, in place of drawn commands and gaits.
        perturbation: How the expert is disturbed, unless it is left alone.
        channels: Optional parts of the observation.
        history: Proprioceptive frames in the observation.
        control_hz: Rate of the policy [Hz].
        kp: Stiffness of the actuators [N m/rad].
        kd: Their damping [N m s/rad].
        jobs: Processes.
    """

    out: Path
    tasks: tuple[GaitName, ...] = GaitName.each(BUILT_IN_TASKS)
    shards: int = 1
    seconds: float = 30.0
    seed: int = 0
    command: Command = None
    clean: bool = False
    hands: bool = False
    perturbation: PerturbationConfig = PerturbationConfig()
    channels: tuple[ChannelName, ...] = ChannelName.each(DEFAULT_CHANNELS)
    history: int = DEFAULT_HISTORY
    control_hz: int = 50
    kp: float = GAINS.kp
    kd: float = GAINS.kd
    jobs: int = 1


def run(words: Sequence[str]) -> None:
    """Make the shards that are not there yet."""
    options = parse(Options, words, "collect")
    jobs = jobs_of(options)
    out = writable_folder(options.out)
    print(f"{len(jobs)} shards of {options.seconds:g} s; those that are in {out} already are kept", flush=True)
    try:
        paths = collect_all(jobs, out, options.jobs, progress=True)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"finished shards are in {out}; the same command goes on") from None
    size = sum(path.stat().st_size for path in paths) / 1e6
    print(f"{len(paths)} shards, {size:.1f} MB, in {out}; trainers.Demonstrations.load reads one")


def jobs_of(options: Options) -> list[CollectJob]:
    """Descriptions of the shards, one of every gait after the other.

    Raises:
        InvalidInputError: if an option cannot be.
    """
    names = ("tasks", "channels", "history", "control_hz", "kp", "kd")
    env_kwargs = {name: getattr(options, name) for name in names}
    count = integer_in(options.shards, 1, 10**6, "shards")
    perturbation = None if options.clean else disturbed(options)
    return [
        CollectJob(task, options.seed + shard, options.seconds, options.command, perturbation, env_kwargs)
        for shard in range(count)
        for task in options.tasks
    ]


def disturbed(options: Options) -> PerturbationConfig:
    """How the expert is disturbed, by an operator too if one is asked for."""
    if not options.hands:
        return options.perturbation
    hands = OperatorConfig() if len(options.tasks) > 1 else OperatorConfig().of_one_gait()
    return dataclasses.replace(options.perturbation, operator=hands)
