"""TOML and JSON files that people write: tasks, shots, jobs."""

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from .errors import InputError
from .text import nearest_known, printable, read_json

__all__ = ["read_tables", "require_known"]

_LARGEST = 1 << 20  # bytes


def read_tables(file: Path, what: str) -> dict[str, Any]:
    """What a TOML or, by its ending, JSON file says; ``what`` it is, such as "tasks", for refusals.

    Raises InputError where it cannot be read, is too large, or is neither.
    """
    try:
        if file.stat().st_size > _LARGEST:
            raise InputError(
                f"'{file}' is larger than a file of {what}; give the one that you mean."
            )
        text = file.read_text(encoding="utf-8")
        data = read_json(text) if file.suffix.lower() == ".json" else tomllib.loads(text)
    except OSError as error:
        raise InputError(f"'{file}' cannot be read: {error.strerror}.") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"'{file}' is not TOML: {error}; mend it there.") from error
    except (ValueError, RecursionError) as error:
        said = error if isinstance(error, ValueError) else "is nested too deep"
        raise InputError(f"'{file}' {said}; write the {what} as UTF-8, TOML or JSON.") from error

    if not isinstance(data, dict):
        raise InputError(f"'{file}' is not a table; write the {what} by name in it.")
    return data


def require_known(data: object, known: Iterable[str], which: str) -> dict[str, Any]:
    """A table all of whose words are known. Raises InputError, which names the nearest one, for
    another word; ``which``: the table in the refusal, as the beginning of a sentence.
    """
    words = tuple(known)
    if not isinstance(data, dict):
        raise InputError(f"{which} is {_shown(data)}, not a table; write its words by name.")
    for key in data:
        if key not in words:
            said = printable(key, 40)
            raise InputError(f"{which} does not know '{said}'; {nearest_known(said, words)}")
    return data


def _shown(value: object) -> str:
    return f"'{printable(value, 40)}'" if isinstance(value, str) else printable(value, 40)
