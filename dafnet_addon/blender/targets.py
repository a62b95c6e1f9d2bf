"""The empties that head and hands follow, made where a character has none."""

import bpy

from ..core.errors import InputError
from .armature import character_scale

__all__ = ["add_targets", "missing_targets"]

_TARGETS = {"head": ("head", "Head", 0.2), "hand_left": ("left_wrist", "Left Hand", 0.15),
            "hand_right": ("right_wrist", "Right Hand", 0.15)}
"""The bone of each, its name, and the size that it is shown at, metres of a body of 1.75 m."""


def missing_targets(context: bpy.types.Context, armature: bpy.types.Object) -> list[str]:
    """The targets of the settings that are not set or not in the scene."""
    found = {role: getattr(armature.dafnet, role) for role in _TARGETS}
    return [role for role, target in found.items() if target is None or target.name not in context.scene.objects]


def add_targets(context: bpy.types.Context, armature: bpy.types.Object) -> list[bpy.types.Object]:
    """Make the missing ones where head and hands are in the current frame, in the character's collection.

    ``InputError``: nothing is missing, or the armature is no character or linked; nothing is changed then.
    """
    missing = missing_targets(context, armature)
    if not missing:
        raise InputError(f"'{armature.name}' has targets for head and hands already; animate those.")
    if armature.library:
        raise InputError(f"The character '{armature.name}' is linked; make it local to add targets.")
    size = character_scale(armature)
    evaluated = armature.evaluated_get(context.evaluated_depsgraph_get())
    made = []
    for role in missing:
        bone, name, shown = _TARGETS[role]
        target = bpy.data.objects.new(f"{armature.name} {name}", None)
        target.empty_display_type, target.empty_display_size = "ARROWS", shown * size
        target.location = evaluated.matrix_world @ evaluated.pose.bones[bone].head
        armature.users_collection[0].objects.link(target)
        setattr(armature.dafnet, role, target)
        made.append(target)
    return made
