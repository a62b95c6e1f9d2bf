"""In which unit a length was likely meant that is not one of people or furniture in metres."""

from .errors import InputError
from .text import metres

__all__ = ["FURNITURE", "PERSON", "likely_unit", "require_human_height"]

PERSON = (1.2, 2.3)
"""Metres from sole to crown that are likely."""
FURNITURE = (0.2, 2.5)
"""Metres over the floor to the lowest top in a room that are likely."""

_TALLEST = 4.0
"""Metres of the tallest body that motion is made for."""
_METRES = {"centimetres": 0.01, "millimetres": 0.001, "inches": 0.0254, "feet": 0.3048}
"""Of each unit, the most common first, how many metres it is."""


def likely_unit(length: float, usual: tuple[float, float]) -> tuple[str, float] | None:
    """The unit that brings a length into the ``usual`` range, metres, and how many metres it is;
    None where none does, or where the length is usual in metres.

    >>> likely_unit(175.0, PERSON)
    ('centimetres', 0.01)
    >>> likely_unit(69.0, PERSON)
    ('inches', 0.0254)
    """
    low, high = usual
    if low <= length <= high:
        return None
    return next(
        ((name, size) for name, size in _METRES.items() if low <= length * size <= high), None
    )


def require_human_height(height: float, whose: str, remedy: str = "") -> None:
    """Raises InputError where nobody is as tall as ``height`` metres, with the unit that was likely
    meant. ``whose``: who would be; ``remedy``: what to do, where it is not to give another number.

    >>> require_human_height(175.0, "A character")
    Traceback (most recent call last):
    dafnet_addon.core.errors.InputError: A character would be 175 m tall, which looks like \
centimetres; give 1.75 m.
    """
    if height <= _TALLEST:
        return
    unit = likely_unit(height, PERSON)
    looks = f", which looks like {unit[0]}" if unit else ""
    size = height * unit[1] if unit else 1.75
    raise InputError(
        f"{whose} would be {metres(height)} tall{looks}; {remedy or f'give {size:.2f} m'}."
    )
