"""``go1-mtl-gym COMMAND [OPTIONS]`` and ``python -m trainers COMMAND [OPTIONS]``.

Which command it is gets known before anything else is imported, so that help comes at once.
"""

import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Any

COMMANDS = {
    "list": ("listing", "gaits, environments, packaged policies, presets, conditions"),
    "play": ("play", "drive the policy, or the expert, in a window; film it"),
    "train": ("train", "the main job: demonstrations, cloning, DAgger, evaluation, pictures"),
    "evaluate": ("evaluate", "drive a policy or the expert, and score it"),
    "certify": ("certify", "find out what a policy can be trusted with, as a JSON file and a page"),
    "collect": ("collect", "record the expert's demonstrations"),
    "doctor": ("doctor", "whether this machine has all that is needed, and what to do where it has not"),
}
"""Command -> the module below `trainers.cli` with its ``run(words)``, and what it does."""
COMPLETION = ("--tyro-print-completion", "--tyro-write-completion")


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status.

    Args:
        arguments: the words after the program's name; None takes those of this process.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words or words[0] in ("-h", "--help"):
        print(usage())
        return 0
    from trainers.utils.cli import main

    return main(_dispatch)(words)


def usage() -> str:
    """What ``--help`` says."""
    width = max(map(len, COMMANDS))
    lines = [f"  {name:{width}}  {summary}" for name, (_, summary) in COMMANDS.items()]
    return "\n".join(
        (
            "usage: go1-mtl-gym COMMAND [OPTIONS]\n",
            "A simulated Unitree Go1 that learns its gaits from a model predictive controller.\n",
            "commands:",
            *lines,
            "\nCOMMAND --help tells its options; --version the version;",
            "--tyro-print-completion bash|zsh|fish prints a script that completes all of this in the shell.",
        )
    )


def _dispatch(arguments: Sequence[str] | None) -> None:
    """Hand the other words to the command that the first one names."""
    from go1_mtl_gym import __version__
    from go1_mtl_gym.validation import one_of

    command, *words = arguments or ()
    if command == "--version":
        print(f"go1-mtl-gym {__version__}")
    elif command in COMPLETION:
        _complete([command, *words])
    else:
        _module(one_of(command, tuple(COMMANDS), "command")).run(words)


def _complete(words: Sequence[str]) -> None:
    from trainers.cli.options import completion

    kinds = {name: (_module(name).Options, summary) for name, (_, summary) in COMMANDS.items()}
    completion(kinds, words)


def _module(command: str) -> Any:
    try:
        return import_module(f"trainers.cli.{COMMANDS[command][0]}")
    except ModuleNotFoundError as error:
        if error.name != "tyro":
            raise
        from go1_mtl_gym.errors import Go1Error

        raise Go1Error("the command line needs tyro, which is not installed: python -m pip install tyro") from error
