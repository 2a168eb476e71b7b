"""``go1-mtl-gym play``, whose options are the fields of `trainers.play.options.PlayOptions`."""

from collections.abc import Sequence
from typing import Annotated, Any

import tyro

from go1_mtl_gym.errors import InvalidInputError
from trainers.cli.names import GaitName
from trainers.cli.options import parse, unchecked, values_of
from trainers.play.options import PlayOptions

Options: Any = unchecked(
    PlayOptions,
    task=GaitName | None,
    size=Annotated[tuple[int, int] | None, tyro.conf.arg(metavar="WIDTH HEIGHT")],
)


def run(words: Sequence[str]) -> None:
    """Let somebody play, or film what is played."""
    if words and not words[0].startswith("-"):  # evaluate and certify take a policy so
        if any(word.split("=")[0] == "--policy" for word in words):
            raise InvalidInputError(f"one policy can drive: {words[0]!r} came, and --policy as well")
        words = ["--policy", *words]
    options = PlayOptions(**values_of(parse(Options, words, "play")))
    from trainers.play.program import play

    play(options)
