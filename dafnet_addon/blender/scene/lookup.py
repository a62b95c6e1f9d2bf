"""Finds what the settings name: a job keeps names instead of objects, since these may be deleted,
or replaced by an undo, while it runs.
"""

import bpy

from ...core.errors import InputError
from ...core.skeleton import TARGETS
from ..character.settings import Settings

__all__ = [
    "find_action",
    "find_collection",
    "find_object",
    "find_scene",
    "names_in_use",
    "object_named",
    "require_enabled",
]


def find_scene(settings: Settings) -> bpy.types.Scene:
    """The scene of the settings; ``InputError`` where it is gone."""
    scene = next((s for s in bpy.data.scenes if s.name_full == settings.scene), None)
    if scene is None:
        raise InputError(
            f"The scene '{settings.scene}' is no longer in this file; generate again from another."
        )
    return scene


def object_named(scene: bpy.types.Scene, name: str) -> bpy.types.Object | None:
    """The scene's object of this ``name_full``: a linked one and one of the file may share a
    ``name``.
    """
    return next((o for o in scene.objects if o.name_full == name), None)


def find_object(settings: Settings, name: str, role: str) -> bpy.types.Object:
    """The scene's object of this ``name_full``; ``role`` says in the ``InputError`` what it was
    for.

    An object that was deleted in the scene may live on in the file as long as a property names it:
    it counts as gone.
    """
    found = object_named(find_scene(settings), name)
    if found is None:
        raise InputError(
            f"The {role} '{name}' is not in the scene; choose another one in the DAFNet panel."
        )
    return found


def find_action(name: str) -> bpy.types.Action:
    """The action of this ``name_full``; ``InputError`` where it is gone."""
    found = next((a for a in bpy.data.actions if a.name_full == name), None)
    if found is None:
        raise InputError(
            f"The take '{name}' is no longer in this file; choose another one in the list."
        )
    return found


def find_collection(name: str) -> bpy.types.Collection:
    """The collection of this ``name_full``; ``InputError`` where it is gone."""
    found = next((c for c in bpy.data.collections if c.name_full == name), None)
    if found is None:
        raise InputError(
            f"The furniture collection '{name}' is not in this file; choose another in the DAFNet "
            "panel."
        )
    return found


def require_enabled(depsgraph: bpy.types.Depsgraph, needed: list[bpy.types.Object]) -> None:
    """``InputError`` where one is disabled in viewports: Blender moves those hidden with H, not
    these.
    """
    alive = {each.original for each in depsgraph.ids}
    for each in needed:
        if each not in alive:
            raise InputError(
                f"'{each.name}' or its collection is disabled in viewports; enable it, or hide it "
                "with H."
            )


def names_in_use(settings: Settings) -> set[str]:
    """Names of all that a generation with these settings uses and that is there: objects,
    furniture, its collection.
    """
    named = {
        settings.armature,
        settings.root,
        *(getattr(settings, role) for role in TARGETS),
    }
    named |= {settings.upper_body_source, settings.lower_body_source, settings.look_at}
    used = {o.name_full for o in find_scene(settings).objects if o.name_full in named}
    for collection in bpy.data.collections:
        if collection.name_full == settings.furniture:
            used |= {collection.name_full, *(o.name_full for o in collection.all_objects)}

    return used
