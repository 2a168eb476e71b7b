"""``go1-mtl-gym train``: the main job, whose options are the fields of `trainers.JobConfig`."""

import dataclasses
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from go1_mtl_gym.gait_space import GaitSpace
from trainers.cli.names import ChannelName, GaitName, PresetName
from trainers.cli.options import PROGRAM, Unless, parse, said, unchecked, values_of
from trainers.data.operator import OperatorConfig
from trainers.pipeline.config import JobConfig
from trainers.pipeline.presets import ABOUT
from trainers.utils.cli import program

_Hands: Any = unchecked(OperatorConfig)
_Gaits: Any = unchecked(GaitSpace)
_Settings: Any = unchecked(
    JobConfig,
    preset=PresetName,
    tasks=tuple[GaitName, ...],
    channels=tuple[ChannelName, ...],
    operator=_Hands | None,
    gaits=_Gaits,
)
_Folder = Unless[Path]
_FIRST = ("preset", "out")
"""Options that the help begins with."""
SAID = {
    "preset": "Settings to start from, which the other options change. "
    + "; ".join(f"{name}: {about}" for name, about in ABOUT.items()),
    "out": "Folder of the results; an interrupted run goes on in the same one. runs/<date> if not given",
}


def _values(settings: JobConfig) -> dict[str, Any]:
    """Values of the options for some settings: names are names, and the operator is one that checks nothing."""
    hands = None if settings.operator is None else _Hands(**dataclasses.asdict(settings.operator))
    fields = {each.name: getattr(settings, each.name) for each in dataclasses.fields(settings)}
    return fields | {
        "operator": hands,
        "gaits": _Gaits(**dataclasses.asdict(settings.gaits)),
        "preset": PresetName(settings.preset),
        "tasks": GaitName.each(settings.tasks),
        "channels": ChannelName.each(settings.channels),
        "out": None,
    }


def _options() -> type:
    """The settings and the folder; what everybody gives comes first."""
    types = {each.name: each.type for each in dataclasses.fields(_Settings)} | {
        "preset": said(PresetName, SAID["preset"]),
        "out": said(_Folder, SAID["out"]),
    }
    names, values = dict.fromkeys((*_FIRST, *types)), _values(JobConfig())
    fields = [(name, types[name], dataclasses.field(default=values[name])) for name in names]
    return dataclasses.make_dataclass("Options", fields, namespace={"__doc__": DESCRIPTION}, frozen=True)


DESCRIPTION = (
    "Teach one network several gaits of a Go1 from an MPC expert, and measure how well it moves. "
    "Durations are seconds of robot time per gait; the defaults shown are the preset's."
)
Options = _options()


def run(words: Sequence[str]) -> None:
    """Run the job."""
    config, out = parse_job(words)
    from trainers.pipeline.main_job import run_job

    run_job(config, out, shlex.join([PROGRAM, "train", *words]), drive=f"{program()} play --policy")


def parse_job(words: Sequence[str], command: str = "train") -> tuple[JobConfig, Path | None]:
    """Read the options of the main job; ``--help`` and unknown options end the program.

    Args:
        words: after the command.
        command: as in `trainers.cli.options.parse`.

    Returns:
        The settings, and the output folder (None: choose one).

    Raises:
        InvalidInputError: if a setting cannot be.
    """
    settings = JobConfig.from_preset(preset_of(words))
    given = values_of(parse(Options, words, command, Options(**_values(settings))))
    out = given.pop("out")
    return JobConfig(**given), out


def preset_of(words: Sequence[str]) -> str:
    """The preset that is asked for, whose values stand for all options that are not given.

    Raises:
        InvalidInputError: if there is no such preset.
    """
    preset = "default"
    for word, following in zip(words, [*words[1:], ""]):
        name, equals, value = word.partition("=")
        if name == "--preset":
            preset = value if equals else following
    return PresetName.read(preset)
