"""Options of a command, read by tyro from the dataclass that describes them."""

import dataclasses
import inspect
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_args, get_type_hints

import tyro

from trainers.cli.names import Name
from trainers.utils.docstrings import described

if TYPE_CHECKING:
    from tyro.constructors import ConstructorRegistry

PROGRAM = "go1-mtl-gym"
"""What a user types."""
Options = TypeVar("Options")
Kind = TypeVar("Kind")


def default_unless_none(default: str) -> str:
    """What the help adds of a default: nothing where it would be "None", and what that means is said already."""
    return "" if default == "None" else f"(default: {default})"


_HINT = tyro.conf.arg(help_behavior_hint=default_unless_none)
Unless = Annotated[Kind | None, _HINT]
"""An option whose help says what happens unless it is given."""


def parse(kind: type[Options], words: Sequence[str], command: str, default: Options | None = None) -> Options:
    """The options that a user gave; ``--help`` and errors end the program with status 0 and 2.

    Args:
        kind: a dataclass, whose docstring says what each option is.
        words: after the command.
        command: its name; with the program's for one that is not ours, such as "examples/dagger.py".
        default: what stands for options that were not given; None: the fields' own defaults.

    Raises:
        InvalidInputError: if one is no name of what it is to name.
    """
    program = command if "/" in command else f"{PROGRAM} {command}"
    defaults: dict[str, Any] = {} if default is None else {"default": default}
    options = tyro.cli(
        kind,
        prog=program,
        description=first_paragraph(kind),
        args=list(words),
        config=CONFIG,
        registry=_registry(),
        **defaults,
    )
    return _with_plain_names(options)


CONFIG = (tyro.conf.AvoidSubcommands, tyro.conf.FlagCreatePairsOff)
"""Nested settings are options with a dot, not commands; a switch has one name, not two."""


def completion(kinds: dict[str, tuple[type, str]], words: Sequence[str]) -> None:
    """Print or write the script that completes the whole command line, as tyro has it.

    Args:
        kinds: command -> its options and what it does.
        words: ``--tyro-print-completion SHELL`` or ``--tyro-write-completion SHELL PATH``.
    """
    commands: Any = None
    for name, (kind, summary) in kinds.items():
        subcommand = tyro.conf.subcommand(name, description=summary, prefix_name=False)
        command = Annotated.__class_getitem__((kind, subcommand))  # type: ignore[attr-defined]  # made at run time
        commands = command if commands is None else commands | command
    tyro.cli(commands, prog=PROGRAM, args=list(words), config=CONFIG, registry=_registry(closed=True))


def unchecked(kind: type, **types: Any) -> type:
    """A dataclass of the fields of another one that checks nothing.

    tyro fills it, so that `kind` itself refuses what cannot be, in its own words: ``kind(**values_of(options))``.

    Args:
        kind: a dataclass, whose docstring says what each field is.
        types: of fields that are not read as they are annotated.
    """
    says, hints = described(kind), get_type_hints(kind)

    def type_of(each: "dataclasses.Field[Any]") -> Any:
        text, type_ = says.get(each.name, ""), types.get(each.name, hints[each.name])
        return said(type_ if each.default is not None or "None" in text else Annotated[type_, _HINT], text)

    return dataclasses.make_dataclass(
        f"{kind.__name__}Options",
        [(each.name, type_of(each), _default(each)) for each in dataclasses.fields(kind)],
        namespace={"__doc__": first_paragraph(kind)},
        frozen=True,
    )


def with_number(words: Sequence[str], option: str, number: int) -> list[str]:
    """Words in which an option that may stand alone has its number: "--video" becomes "--video 5"."""
    out: list[str] = []
    for word, following in zip(words, [*words[1:], "--"]):
        out += [word, str(number)] if word == option and following.startswith("--") else [word]
    return out


def said(kind: Any, text: str) -> Any:
    """A type with what the help says of it."""
    return Annotated[kind, tyro.conf.arg(help=text[:1].upper() + text[1:])]


def values_of(options: Any) -> dict[str, Any]:
    """The values of a dataclass by field, dataclasses in it likewise."""
    return dataclasses.asdict(options)


def first_paragraph(kind: type) -> str:
    """Of a docstring, on one line."""
    return " ".join(inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[0].split())


def _with_plain_names(options: Any) -> Any:
    """The same options with strings for every `Name`, each of which is checked."""

    def plain(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(plain, value))
        return value.read(value) if isinstance(value, Name) else value

    return dataclasses.replace(
        options, **{each.name: plain(getattr(options, each.name)) for each in dataclasses.fields(options)}
    )


def _default(each: "dataclasses.Field[Any]") -> Any:
    if each.default_factory is not dataclasses.MISSING:
        return dataclasses.field(default_factory=each.default_factory)
    return dataclasses.field() if each.default is dataclasses.MISSING else dataclasses.field(default=each.default)


def _registry(closed: bool = False) -> "ConstructorRegistry":
    """How words become values of the kinds that tyro does not know.

    Args:
        closed: name the words of a `Name` as the only ones, which lets a shell complete them. Otherwise the `Name`
            itself refuses others: it knows which one was meant.
    """
    registry = tyro.constructors.ConstructorRegistry()

    def one(kind: Any) -> dict[str, Any]:
        """What the help shows for a value, and the only words for it if they are to be named."""
        if issubclass(kind, Name):
            return {"metavar": f"{{{','.join(kind.known)}}}", "choices": kind.known if closed else None}
        return {"metavar": kind.__name__.upper()}

    @registry.primitive_rule
    def optional(info: "tyro.constructors.PrimitiveTypeInfo") -> "tyro.constructors.PrimitiveConstructorSpec | None":
        kinds = [kind for kind in get_args(info.type) if kind is not type(None)]
        if len(kinds) == len(get_args(info.type)) or len(kinds) != 1 or not isinstance(kinds[0], type):
            return None
        if not issubclass(kinds[0], (int, float, str, Path)):
            return None
        return tyro.constructors.PrimitiveConstructorSpec(
            nargs=1,
            instance_from_str=lambda words: None if words[0] == "None" else kinds[0](words[0]),
            is_instance=lambda value: value is None or isinstance(value, kinds[0]),
            str_from_instance=lambda value: [str(value)],
            **one(kinds[0]),
        )

    @registry.primitive_rule
    def names(info: "tyro.constructors.PrimitiveTypeInfo") -> "tyro.constructors.PrimitiveConstructorSpec | None":
        kind: Any = info.type
        if not (isinstance(kind, type) and issubclass(kind, Name)):
            return None
        return tyro.constructors.PrimitiveConstructorSpec(
            nargs=1,
            instance_from_str=lambda words: kind(words[0]),
            is_instance=lambda value: isinstance(value, str),
            str_from_instance=lambda value: [str(value)],
            **one(kind),
        )

    return registry
