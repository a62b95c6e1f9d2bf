"""What the overlays have computed, kept until the scene changes, so that redrawing what has not
changed costs nothing.
"""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

import bpy

from ..character.armature import is_character

__all__ = ["OverlayCache", "cache"]

_T = TypeVar("_T")


class OverlayCache:
    """Results of several kinds, each found by what it was computed from.

    ``edits`` counts changes of the scene, and ``furniture`` those that may have moved or reshaped a
    piece of furniture. Both belong in the key of a result that depends on such things.
    """

    def __init__(self) -> None:
        self.edits = 0
        self.furniture = 0
        self._results: dict[str, dict[Hashable, Any]] = {}

    def __len__(self) -> int:
        return sum(len(results) for results in self._results.values())

    def note_edit(self, depsgraph: bpy.types.Depsgraph | None) -> None:
        """Something in the scene has changed; None: anything may have."""
        self.edits += 1
        self.note_frame(depsgraph)

    def note_frame(self, depsgraph: bpy.types.Depsgraph | None) -> None:
        """The scene shows another frame, where furniture may have moved."""
        if depsgraph is None or any(_may_be_furniture(update) for update in depsgraph.updates):
            self.furniture += 1

    def forget(self) -> None:
        """Drop all results."""
        self._results.clear()
        self.note_edit(None)

    def recall(self, kind: str, key: Hashable, compute: Callable[[], _T], capacity: int = 1) -> _T:
        """The result for this key, computed if it is not there yet.

        Of each ``kind`` the last ``capacity`` results are kept.
        """
        results = self._results.setdefault(kind, {})
        if key not in results:
            result = compute()
            while len(results) >= capacity:
                results.pop(next(iter(results)))  # the oldest one
            results[key] = result

        found: _T = results[key]
        return found


def _may_be_furniture(update: bpy.types.DepsgraphUpdate) -> bool:
    """Whether an update moves or reshapes something that may be furniture."""
    changed = update.id.original
    if not isinstance(changed, bpy.types.Object) or not (
        update.is_updated_transform or update.is_updated_geometry
    ):
        return False

    if changed.type in {"ARMATURE", "CAMERA", "LIGHT"} or (
        changed.type == "EMPTY" and changed.instance_type == "NONE"
    ):
        return False

    wearer = changed.parent
    return not (wearer and is_character(wearer))


cache = OverlayCache()
"""The only one."""
