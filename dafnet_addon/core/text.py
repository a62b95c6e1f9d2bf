"""Words from outside (a file's metadata, the names in a scene): made safe to show, and read as
JSON.
"""

import json
import math
import unicodedata
from collections.abc import Iterable
from difflib import get_close_matches
from numbers import Number
from typing import Any

__all__ = ["duration", "metres", "nearest_known", "printable", "read_json"]

_DEEPEST = 32  # lists and objects within each other
_LONGEST = 18  # digits of a whole number
_NAMED = 12  # words that a sentence names


def printable(words: object, max_length: int = 200) -> str:
    """Text, a number or None on one line: at most ``max_length`` characters, and "…" for what is
    cut off; of all else, its type.

    What a terminal would obey instead of showing it (control characters, line ends, marks that turn
    the direction of writing, halves of characters) becomes its escape, such as ``\\x1b``.
    """
    text = words if isinstance(words, str) else _brief(words)
    if len(text) > max_length:
        text = text[:max_length] + "…"
    return "".join(
        each if _is_shown(each) else each.encode("unicode_escape").decode("ascii") for each in text
    )


def metres(length: float) -> str:
    """A length in metres with its unit, in two digits or more: 0.0095 m, 95 m, 1,250 m."""
    return f"{length:,.0f} m" if length >= 10.0 else f"{length:.2g} m"


def duration(seconds: float) -> str:
    """A time, as closely as it is worth saying: 8 s, 5 min, 2 h 20 min."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


def nearest_known(word: str, known: Iterable[str]) -> str:
    """What to say of a ``word`` that is not known: a question for the one most like it, else all of
    them (some, where they are many).

    >>> nearest_known("secnds", ("seconds", "facing"))
    "did you mean 'seconds'?"
    """
    words = sorted({*known})
    like = get_close_matches(word.lower(), [each.lower() for each in words], 1)
    for each in words:
        if [each.lower()] == like:
            return f"did you mean '{each}'?"

    if not words:
        return "nothing is known here."
    listed = ", ".join(f"'{each}'" for each in words[:_NAMED])
    return f"known are {listed}{' and more' if len(words) > _NAMED else ''}."


def _brief(thing: object) -> str:
    if not isinstance(thing, Number | None):
        return f"of the type {type(thing).__name__}"  # all of an array's numbers take long to write
    try:
        return str(thing)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        return "a huge number"


def _is_shown(character: str) -> bool:
    return character.isprintable() or unicodedata.category(character) == "Zs"


def read_json(text: str) -> Any:
    """What a JSON text says.

    Raises ValueError, whose words go on from the text's name ("is not JSON"), for what is not
    JSON, for NaN and infinity, whole numbers of more than 18 digits, a name that comes twice in an
    object, halves of characters, and what is nested over 32 deep.
    """
    try:
        found = json.loads(text, object_pairs_hook=_once, parse_int=_whole)
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError("is not JSON") from error
    _check(found, _DEEPEST)
    return found


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len({key for key, _ in pairs}) != len(pairs):
        raise ValueError("names something twice")
    return dict(pairs)


def _whole(digits: str) -> int:
    if len(digits) > _LONGEST:
        raise ValueError("holds a number that is too large")
    return int(digits)


def _check(value: Any, deeper: int) -> None:
    if isinstance(value, dict | list):
        if deeper == 0:
            raise ValueError("is nested too deep")
        for each in (*value.keys(), *value.values()) if isinstance(value, dict) else value:
            _check(each, deeper - 1)
    elif isinstance(value, str):
        if any("\ud800" <= each <= "\udfff" for each in value):
            raise ValueError("holds half a character")
    elif isinstance(value, float) and not math.isfinite(value):
        raise ValueError("holds a number that is not finite")
