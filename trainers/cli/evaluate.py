"""``go1-mtl-gym evaluate [POLICY]``."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tyro

from trainers.cli.names import Command, Gaits
from trainers.cli.options import Unless, parse
from trainers.data.operator import OperatorConfig
from trainers.utils.cli import writable_file
from trainers.utils.files import write_json


@dataclasses.dataclass(frozen=True)
class Options:
    """Drive a policy or the expert in closed loop, and count successes.

    Attributes:
        policy: File of a policy, "clocked" or "phase_free" (in the package), or "expert".
        tasks: Gaits; all that the policy knows if not given.
        episodes: How many of each gait.
        seconds: Duration of an episode [s].
        seed: Of all episodes.
        command: Forward and sideways velocity [m/s] and yaw rate [rad/s] of all episodes; drawn if not given.
        command_interval: Draw a new command every so many seconds; one per episode if not given.
        corners: Draw commands from the corners of the gait's range.
        hands: Let an operator's hands drive, in place of drawn commands.
        jobs: Processes.
        out: JSON file for every episode's figures.
        robot: MJCF file of another Go1.
    """

    policy: tyro.conf.Positional[str] = "clocked"
    tasks: Gaits = ()
    episodes: int = 20
    seconds: float = 30.0
    seed: int = 1
    command: Command = None
    command_interval: Unless[float] = None
    corners: bool = False
    hands: bool = False
    jobs: int = 1
    out: Unless[Path] = None
    robot: Unless[str] = None


def run(words: Sequence[str]) -> None:
    """Score a policy in one gait after the other."""
    options = parse(Options, words, "evaluate")
    if options.out is not None:
        writable_file(options.out)
    from go1_mtl_gym import TASKS
    from trainers import evaluate
    from trainers.evaluation.agents import identity, opened

    agent = opened(options.policy)
    results = {}
    robot: dict[str, Any] = {} if options.robot is None else {"robot": options.robot}
    tasks = tuple(dict.fromkeys(options.tasks)) or tasks_of(agent)
    if options.command is not None:
        for task in tasks:  # before the first one is measured
            TASKS[task].check_command(options.command)
    print(f"{options.episodes} episodes of {options.seconds:g} s per gait, {driven(options)}; seed {options.seed}")
    for task in tasks:
        results[task] = evaluate(
            agent,
            task,
            episodes=options.episodes,
            seconds=options.seconds,
            seed=options.seed,
            commands=None if options.command is None else [options.command],
            command_interval=options.command_interval,
            corners=options.corners,
            operator=OperatorConfig().of_one_gait() if options.hands else None,
            n_jobs=options.jobs,
            progress=True,
            **robot,
        )
        print(results[task])
    if options.out is not None:
        scores = {task: result.as_dict() for task, result in results.items()}
        write_json(options.out, {"policy": identity(options.policy), "seed": options.seed, "tasks": scores})
        print(f"every episode is in {options.out}")


def driven(options: Options) -> str:
    """Whose commands the robot gets, in a few words."""
    if options.hands:
        return "in an operator's hands"
    if options.command is not None:
        return "with the command {:g} {:g} {:g}".format(*options.command)
    kind = "a drawn corner of the range" if options.corners else "a drawn command"
    again = "" if options.command_interval is None else f", anew every {options.command_interval:g} s"
    return f"with {kind} each{again}"


def tasks_of(agent: Any) -> tuple[str, ...]:
    """The gaits that an agent knows: of an expert, all that come with the package."""
    from go1_mtl_gym import BUILT_IN_TASKS

    return tuple(getattr(agent, "env_kwargs", {}).get("tasks") or BUILT_IN_TASKS)
