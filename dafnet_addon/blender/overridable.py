"""What a library override of a character or a rig keeps in its own file: Blender grants it
property by property, and forgets the others when the file is opened again.
"""

from itertools import count
from typing import Any

import bpy
from bpy.app.handlers import persistent

__all__ = ["LOCALLY", "ROWS_LOCALLY", "add_named", "register", "rows_of_library", "unregister"]

LOCALLY = {"LIBRARY_OVERRIDABLE"}
"""The value of a property."""
ROWS_LOCALLY = {*LOCALLY, "USE_INSERTION"}
"""The rows that are added to a collection."""
_GROUPS = ("dafnet", "dafnet_rig")
"""The groups of settings that objects have."""


def add_named(rows: Any) -> Any:
    """A new row of a collection, with a name of its own: of rows without, an override loses some
    when its file is opened again.
    """
    name = next(name for k in count(1) if (name := str(k)) not in rows)
    row = rows.add()
    row.name = name
    return row


def rows_of_library(owner: bpy.types.Object, kind: str) -> int:
    """How many of an object's rows (``dafnet.walks``, ``takes``, ``tasks``), the first ones, come
    from the library that it is overridden from: they may be changed, but not removed.
    """
    override = owner.override_library
    return len(getattr(override.reference.dafnet, kind)) if override and override.reference else 0


@persistent
def _give_groups(*_given: Any) -> None:
    """Let what is overridden have the groups that its overrides have, which it gets as they are
    looked at: Blender 5.2 compares no settings with a group that was never made, and forgets them.
    """
    for each in bpy.data.objects:
        override = each.override_library
        if override and override.reference:
            for name in _GROUPS:
                getattr(override.reference, name)


def register() -> None:
    """Look after overrides whenever a file is saved."""
    bpy.app.handlers.save_pre.append(_give_groups)


def unregister() -> None:
    """Undo ``register``."""
    bpy.app.handlers.save_pre.remove(_give_groups)
