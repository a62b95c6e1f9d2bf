"""The empties that a character follows, added where it has none: the root, and the targets of head,
hands and feet.
"""

from collections.abc import Sequence

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.skeleton import END_EFFECTORS, FEET_ASKED
from .armature import character_scale
from .standing import note_standing

__all__ = ["FEET", "HEAD_AND_HANDS", "add_root", "add_targets", "lacks_root", "missing_targets"]

_TARGETS = {
    "head": ("head", "Head", 0.2),
    "hand_left": ("left_wrist", "Left Hand", 0.15),
    "hand_right": ("right_wrist", "Right Hand", 0.15),
    "foot_left": ("left_ankle", "Left Foot", 0.15),
    "foot_right": ("right_ankle", "Right Foot", 0.15),
}
"""Of each target the bone, the name, and the size at which it is drawn, metres on a body of 1.75 m.
"""
HEAD_AND_HANDS = tuple(END_EFFECTORS)
FEET = tuple(FEET_ASKED)


def lacks_root(context: bpy.types.Context, armature: bpy.types.Object) -> bool:
    """Whether the root is not set or not in the scene."""
    root = armature.dafnet.root
    return root is None or root.name not in context.scene.objects


def add_root(context: bpy.types.Context, armature: bpy.types.Object) -> bpy.types.Object:
    """Add the root where the armature stands and looks in the current frame, in its collection.

    ``InputError``: it already has one, is not a character, or is linked; nothing is changed then.
    """
    if not lacks_root(context, armature):
        raise InputError(
            f"'{armature.name}' already has a root; animate '{armature.dafnet.root.name}'."
        )
    if armature.library:
        raise InputError(f"The character '{armature.name}' is linked; make it local to add a root.")

    size = character_scale(armature)
    place = armature.evaluated_get(context.evaluated_depsgraph_get()).matrix_world
    root = bpy.data.objects.new(f"{armature.name} Root", None)
    root.empty_display_type, root.empty_display_size = "ARROWS", 0.4 * size
    root.location = place.translation
    # Armatures look along -y, roots along y.
    root.rotation_euler = (0.0, 0.0, place.to_euler().z % (2.0 * np.pi) - np.pi)
    armature.users_collection[0].objects.link(root)
    armature.dafnet.root = root
    note_standing(armature)
    return root


def missing_targets(
    context: bpy.types.Context, armature: bpy.types.Object, roles: Sequence[str] = HEAD_AND_HANDS
) -> list[str]:
    """Those of the targets ``roles`` that are not set or not in the scene."""
    found = {role: getattr(armature.dafnet, role) for role in roles}
    return [
        role
        for role, target in found.items()
        if target is None or target.name not in context.scene.objects
    ]


def add_targets(
    context: bpy.types.Context, armature: bpy.types.Object, roles: Sequence[str] = HEAD_AND_HANDS
) -> list[bpy.types.Object]:
    """Add the missing ones of ``roles`` where head, hands and feet are in the current frame, in the
    character's collection.

    ``InputError``: nothing is missing, or the armature is not a character or is linked; nothing is
    changed then.
    """
    missing = missing_targets(context, armature, roles)
    if not missing:
        which = "feet" if roles == FEET else "head and hands"
        raise InputError(f"'{armature.name}' already has targets for {which}; animate those.")
    if armature.library:
        raise InputError(
            f"The character '{armature.name}' is linked; make it local to add targets."
        )

    size = character_scale(armature)
    evaluated = armature.evaluated_get(context.evaluated_depsgraph_get())
    added = []
    for role in missing:
        bone, name, shown = _TARGETS[role]
        target = bpy.data.objects.new(f"{armature.name} {name}", None)
        target.empty_display_type, target.empty_display_size = "ARROWS", shown * size

        target.location = evaluated.matrix_world @ evaluated.pose.bones[bone].head
        armature.users_collection[0].objects.link(target)

        setattr(armature.dafnet, role, target)
        added.append(target)

    return added
