"""What a docstring says of each name."""

import inspect
import re


def described(owner: object) -> dict[str, str]:
    """What a Google docstring says of each name under "Args" or "Attributes", on one line.

    Args:
        owner: a class or a function.
    """
    text = inspect.cleandoc(owner.__doc__ or "")
    section = re.search(r"^(?:Args|Attributes):\n((?:(?: .*)?\n?)+)", text, re.MULTILINE)
    entries: dict[str, str] = {}
    for names, said in re.findall(r"^ {4}(\w[\w, ]*): (.+(?:\n {8}.+)*)", section[1] if section else "", re.MULTILINE):
        for name in names.split(", "):
            entries[name] = " ".join(said.split()).replace("``", "`")
    return entries
