"""Words that an option takes one of: a shell completes them, and a misspelled one is answered by the closest."""

from collections.abc import Iterable
from typing import Annotated, ClassVar, TypeVar

import tyro

from go1_mtl_gym.sensing.observation import CHANNELS
from go1_mtl_gym.tasks import TASKS
from go1_mtl_gym.validation import one_of
from trainers.evaluation.conditions import CONDITIONS
from trainers.pipeline.presets import PRESETS

Known = TypeVar("Known", bound="Name")


class Name(str):
    """One of some words; a base class, and a string like any other once it is read."""

    label: ClassVar[str]
    known: ClassVar[tuple[str, ...]]

    @classmethod
    def read(cls, word: str) -> str:
        """The word itself.

        Raises:
            InvalidInputError: if it is none of those that are known; it says which one is close.
        """
        return one_of(str(word), cls.known, cls.label)

    @classmethod
    def each(cls: type[Known], words: Iterable[str]) -> tuple[Known, ...]:
        """Words as names, for the default of an option."""
        return tuple(map(cls, words))


class GaitName(Name):
    """A registered task."""

    label, known = "gait", tuple(TASKS)


class PresetName(Name):
    """A preset of the main job."""

    label, known = "preset", tuple(PRESETS)


class ChannelName(Name):
    """An optional part of the observation."""

    label, known = "channel", tuple(CHANNELS)


class ConditionName(Name):
    """A condition of a certificate."""

    label, known = "condition", tuple(CONDITIONS)


Gaits = Annotated[tuple[GaitName, ...], tyro.conf.arg(help_behavior_hint="")]
Conditions = Annotated[tuple[ConditionName, ...], tyro.conf.arg(help_behavior_hint="")]
"""None of them stands for all, and the help says so."""
Command = Annotated[
    tuple[float, float, float] | None, tyro.conf.arg(metavar="FORWARD LEFT TURN", help_behavior_hint="")
]
"""Velocities [m/s] and yaw rate [rad/s]; without one they are drawn, and the help says so."""
