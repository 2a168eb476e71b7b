"""Files that are either complete or not there."""

import dataclasses
import functools
import json
import math
import os
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from go1_mtl_gym.errors import InvalidInputError


def write_atomically(path: str | os.PathLike[str], write: Callable[[BinaryIO], object]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it over `path`.

    A crash at any point leaves the old file, or none, never half of the new one. Missing folders are made.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{uuid.uuid4().hex}.tmp")  # a name as long as may be leaves no room for more
    try:
        with open(temporary, "xb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_json(path: str | os.PathLike[str], value: Any) -> None:
    """Write `json_ready` of a value atomically, indented."""
    text = json.dumps(json_ready(value), indent=1) + "\n"
    write_atomically(path, lambda file: file.write(text.encode()))


def read_json(path: str | os.PathLike[str], kind: str) -> Any:
    """Values of a JSON file.

    Args:
        path: of the file.
        kind: what the file should be, in the message, such as "script".

    Raises:
        InvalidInputError: if there is no such file, or it holds something else than JSON.
    """
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidInputError(f"{os.fspath(path)!r} is no {kind}: {error}") from error
    except RecursionError:
        raise InvalidInputError(f"{os.fspath(path)!r} is no {kind}: its brackets are nested too deep") from None


def read_object(path: str | os.PathLike[str], kind: str) -> dict[str, Any]:
    """The object in a JSON file, with the arguments of `read_json`.

    Raises:
        InvalidInputError: as `read_json`, or if the file holds another value.
    """
    value = read_json(path, kind)
    if not isinstance(value, dict):
        raise InvalidInputError(
            f"{os.fspath(path)!r} is no {kind}: a JSON object was expected, got {type(value).__name__}"
        )
    return value


def json_ready(value: Any) -> Any:
    """Copy of nested dicts and sequences in which NaN and infinity are None and numpy values are Python's."""
    if isinstance(value, dict):
        return {str(name): json_ready(item) for name, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [json_ready(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def json_form(value: Any, name: str) -> Any:
    """JSON values that describe something, so that it can be written down and compared.

    Frozen dataclasses become dictionaries, sequences lists, numpy's numbers Python's, what stands at the top level of a
    module its ``"module:name"``, and a `functools.partial` a dictionary of function and arguments.

    Args:
        value: what is described.
        name: of the value, in the message.

    Raises:
        InvalidInputError: if it has no such form.
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {each.name: json_form(getattr(value, each.name), name) for each in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): json_form(item, f"{name}[{key!r}]") for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [json_form(item, name) for item in value]
    if isinstance(value, np.generic):
        return json_form(value.item(), name)
    if isinstance(value, functools.partial):
        arguments = {"args": json_form(value.args, name), "keywords": json_form(value.keywords, name)}
        return {"partial": json_form(value.func, name), **arguments}
    if value is None or isinstance(value, (bool, int, str)) or (isinstance(value, float) and math.isfinite(value)):
        return value
    module, qualified = getattr(value, "__module__", None), getattr(value, "__qualname__", "<")
    if callable(value) and module and "<" not in qualified:
        return f"{module}:{qualified}"
    raise InvalidInputError(
        f"{name} must be something that JSON can hold, a frozen dataclass of it, or a function or class at the top "
        f"level of a module, got {value!r}"
    )
