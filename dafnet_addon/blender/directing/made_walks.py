"""Which walks the keys of a root were made for, and whether they were edited since."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from hashlib import sha256
from typing import Any

import bpy

from ...core.errors import InputError
from ..character.standing import note_standing
from ..character.walk_rows import Asked, WalkRow, asked_in, manner_of, set_manner
from ..overridable import add_named, rows_of_library
from ..scene.lookup import object_named
from .root_keys import MOVES, keys_within

__all__ = [
    "edited_from",
    "forget_walks",
    "intact_walks",
    "note_walk",
    "walks_kept_on_failure",
]

_EDITED = "edited"
"""The digest of a walk whose keys were edited before another one replaced its end."""


def note_walk(
    scene: bpy.types.Scene,
    character: bpy.types.Object,
    asked: Asked,
    *,
    first: int,
    last: int,
    intact: Sequence[bool],
) -> None:
    """Add a row for a walk that was keyed from frame ``first`` to ``last``, in place of those that
    began there or later; it becomes the chosen one.

    ``intact``: of each row, whether its keys were as they were made before this walk was keyed.
    """
    own: Any = character.dafnet
    for row, was in zip(own.walks, intact, strict=True):
        # The keys before one that takes another's place are joined to it otherwise.
        if row.first < first <= row.last:
            row.last = first
            row.digest = _digest(own.root, row.first, first) if was else _EDITED
    forget_walks(character, first)

    row = add_named(own.walks)
    _fill(row, scene, asked)
    row.first, row.last = first, last
    row.digest = _digest(own.root, first, last)
    own.active_walk = len(own.walks) - 1
    note_standing(character)


def _fill(row: WalkRow, scene: bpy.types.Scene, asked: Asked) -> None:
    """Let a row say what was asked for."""
    row.kind = asked.kind
    row.goal = object_named(scene, asked.goal)
    for name in asked.points:
        row.points.add().point = object_named(scene, name)
    row.placed = asked.place is not None
    row.place = asked.place or (0.0, 0.0, 0.0)
    set_manner(row, asked.manner)
    for name in ("tables", "pull_out", "by_keys", "keep_facing", "backwards"):
        setattr(row, name, getattr(asked, name))


@contextmanager
def walks_kept_on_failure(scene: bpy.types.Scene, character: bpy.types.Object) -> Iterator[None]:
    """A block that keys walks: if it fails, the rows are as they were, and so is what is asked of
    the next one, and where the character is known to have stood.
    """
    own: Any = character.dafnet
    rows = [(asked_in(row), row.first, row.last, row.digest) for row in own.walks]
    chosen, manner = own.active_walk, manner_of(own)
    stood = tuple(own.stood) if own.is_property_set("stood") else None
    try:
        yield
    except BaseException:
        for k in reversed(range(rows_of_library(character, "walks"), len(own.walks))):
            own.walks.remove(k)
        for k, (asked, first, last, digest) in enumerate(rows):
            if k == len(own.walks):
                _fill(add_named(own.walks), scene, asked)
            row = own.walks[k]
            row.first, row.last, row.digest = first, last, digest
        own.active_walk = chosen
        set_manner(own, manner)
        if stood is None:
            own.property_unset("stood")
        else:
            own.stood = stood
        raise


def forget_walks(character: bpy.types.Object, first: int) -> None:
    """Drop the rows of walks that begin at frame ``first`` or later.

    ``InputError``: one of them is of the library that the character is overridden from.
    """
    own: Any = character.dafnet
    if any(row.first >= first for row in list(own.walks)[: rows_of_library(character, "walks")]):
        raise InputError(
            f"A walk that '{character.name}' has from its library begins at frame {first} or "
            "later, and an override cannot replace it; make the character local."
        )
    for k in reversed(range(len(own.walks))):
        if own.walks[k].first >= first:
            own.walks.remove(k)
    own.active_walk = max(0, min(own.active_walk, len(own.walks) - 1))


def intact_walks(character: bpy.types.Object) -> tuple[bool, ...]:
    """Of each row, whether its keys are as they were made."""
    own: Any = character.dafnet
    return tuple(own.root is not None and _intact(own.root, row) for row in own.walks)


def edited_from(character: bpy.types.Object, index: int) -> bool:
    """Whether keys would be lost that nobody asked for, if the walk of this row and those after it
    were made anew: edited ones, and later ones. The key where it begins does not count.
    """
    own: Any = character.dafnet
    rows = list(own.walks)[index:]
    if not rows or own.root is None:
        return False
    if not any(keys_within(own.root, MOVES, rows[0].first + 1e-3)):
        return False
    return not all(_intact(own.root, row) for row in rows) or any(
        keys_within(own.root, MOVES, rows[-1].last + 1e-3)
    )


def _intact(root: bpy.types.Object, row: WalkRow) -> bool:
    return bool(row.digest == _digest(root, row.first, row.last))


def _digest(root: bpy.types.Object, first: int, last: int) -> str:
    """What tells a root's keys after frame ``first`` up to ``last`` from others."""
    return sha256(b"".join(sorted(keys_within(root, MOVES, first + 1e-3, last)))).hexdigest()
