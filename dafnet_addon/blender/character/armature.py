"""The character in Blender: 22 bones named as the joints, the mannequin on them, and the empties
that direct it.

In the armature's space the character looks along −Y with its left at +X, as Blender's rigs do: the
canonical frame turned by half a circle about z (``mannequin.FACING``).
"""

import bpy
import numpy as np
from mathutils import Vector

from ...core.errors import InputError
from ...core.skeleton import JOINTS, OFFSETS, PARENTS, REST, STATURE, TARGETS, joint
from .mannequin import FACING, add_body
from .standing import note_standing

__all__ = [
    "bodies",
    "choose",
    "create_character",
    "character_of",
    "character_scale",
    "is_character",
    "metres_per_unit",
    "missing_bones",
    "objects_of",
    "owner_of",
    "character_and_goal",
    "selected_characters",
]

_CHAIN = {
    "pelvis": "spine1",
    "spine1": "spine2",
    "spine2": "spine3",
    "spine3": "neck",
    "neck": "head",
    "left_collar": "left_shoulder",
    "left_shoulder": "left_elbow",
    "left_elbow": "left_wrist",
    "left_hip": "left_knee",
    "left_knee": "left_ankle",
    "left_ankle": "left_foot",
}
"""The joint at which each bone's tail lies."""
_LEAVES = {"head": (0, 0, 0.16), "left_wrist": (-0.18, 0, 0), "left_foot": (0, 0.07, 0)}
"""From a last joint to its bone's tail, canonical metres."""


def metres_per_unit(scene: bpy.types.Scene) -> float:
    """Length of a Blender unit in metres: the scene's unit scale, or 1 where the scene has no unit
    system.
    """
    units = scene.unit_settings
    return 1.0 if units.system == "NONE" else units.scale_length


def missing_bones(armature: bpy.types.Object) -> list[str]:
    """The ``JOINTS`` that the armature has no bones for."""
    return [name for name in JOINTS if name not in armature.data.bones]


def is_character(candidate: bpy.types.Object) -> bool:
    """Whether an object is a character's armature.

    SMPL-X has bones of the same names, but in other places, and no root of ours.
    """
    if candidate.type != "ARMATURE" or missing_bones(candidate):
        return False
    if candidate.dafnet.root is not None or candidate.mode == "EDIT":
        return True

    try:
        character_scale(candidate)
    except InputError:
        return False

    return True


def objects_of(character: bpy.types.Object) -> set[bpy.types.Object]:
    """All objects that make up a character: its armature, what is parented to it, its root and its
    targets.
    """
    own = character.dafnet
    return {
        character,
        *character.children_recursive,
        own.root,
        *(getattr(own, role) for role in TARGETS),
    } - {None}


def bodies(scene: bpy.types.Scene) -> set[bpy.types.Object]:
    """Characters and other armatures, with what is parented to them, deformed by them, or directs
    them.
    """
    found: set[bpy.types.Object] = set()
    for each in scene.objects:
        if each.type == "ARMATURE":
            found |= objects_of(each)
        elif any(m.type == "ARMATURE" and m.object is not None for m in each.modifiers):
            found.add(each)
    return found


def character_of(context: bpy.types.Context) -> bpy.types.Object | None:
    """The character that all is about: the one that the active object is or belongs to, else a
    selected one, else the one that was chosen last (``choose``), else the only one of the scene.
    """
    if context.object and (owner := owner_of(context.scene, context.object)):
        return owner
    for each in context.selected_objects:
        if owner := owner_of(context.scene, each):
            return owner
    armatures = [o for o in context.scene.objects if o.type == "ARMATURE"]
    found = [o for o in armatures if o.dafnet.chosen and is_character(o)]
    found = found or [o for o in armatures if is_character(o)]
    return found[0] if len(found) == 1 else None


def choose(scene: bpy.types.Scene, character: bpy.types.Object) -> None:
    """Let everything be about this character of the scene until another one is chosen."""
    for each in scene.objects:
        if each.type == "ARMATURE" and each.dafnet.chosen != (each == character):
            each.dafnet.chosen = each == character


def selected_characters(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The character of ``character_of``, and then the others to which selected objects belong, by
    their names.
    """
    found = [owner_of(context.scene, each) for each in context.selected_objects]
    others = sorted({each for each in found if each is not None}, key=lambda o: o.name)
    first = character_of(context)
    return [*([first] if first else []), *(each for each in others if each != first)]


def owner_of(scene: bpy.types.Scene, part: bpy.types.Object) -> bpy.types.Object | None:
    """The character that an object of the scene is or belongs to: as its armature, its body, its
    root, one of its targets, or the animator's own rig that it is baked onto.
    """
    if part.type == "ARMATURE":
        character = part if is_character(part) else part.dafnet_rig.character
        return character if character and character.name in scene.objects else None
    if part.parent and is_character(part.parent):
        return part.parent

    for candidate in scene.objects:
        own = candidate.dafnet
        if candidate.type == "ARMATURE" and part in (
            own.root,
            *(getattr(own, role) for role in TARGETS),
        ):
            return candidate

    return None


def character_and_goal(
    context: bpy.types.Context,
) -> tuple[bpy.types.Object | None, bpy.types.Object | None]:
    """The character to direct and the furniture to send it to, as the selection says.

    The character is that of ``character_of``. The furniture is the active or the only selected
    object that does not belong to a character: a mesh, or an empty that holds meshes or a
    collection.
    """
    characters = [o for o in context.scene.objects if is_character(o)]
    character = character_of(context)
    parts = {part for each in characters for part in objects_of(each)}
    meshes = [o for o in context.selected_objects if o not in parts and _holds_meshes(o)]
    active = context.object
    goal = active if active in meshes else meshes[0] if len(meshes) == 1 else None
    return character, goal


def _holds_meshes(each: bpy.types.Object) -> bool:
    """Whether an object is a mesh, or an empty that holds some."""
    if each.type != "EMPTY":
        return bool(each.type == "MESH")
    return each.instance_collection is not None or any(
        child.type == "MESH" for child in each.children_recursive
    )


def character_scale(armature: bpy.types.Object, unit: float = 1.0) -> float:
    """Size of the character over the canonical body; ``unit`` is a Blender unit in metres.

    ``InputError``: bones are missing, their proportions, parents or inheritance were edited, or the
    object is scaled unevenly.
    """
    if armature.mode == "EDIT":
        raise InputError(f"The armature '{armature.name}' is in edit mode; leave it and try again.")

    if missing := missing_bones(armature):
        raise InputError(
            f"The armature '{armature.name}' has no bone '{missing[0]}'; use a character made "
            "with Add Character."
        )

    bones = [armature.data.bones[name] for name in JOINTS]
    chained = [bone.parent and bone.parent.name for bone in bones] == [
        JOINTS[p] if p >= 0 else None for p in PARENTS
    ]
    if not chained or not all(
        bone.use_inherit_rotation and bone.use_local_location for bone in bones
    ):
        raise InputError(
            f"The bones of '{armature.name}' were given other parents or another inheritance; add "
            "a new character."
        )

    heads = np.array([bone.head_local for bone in bones])
    offsets = heads[1:] - heads[list(PARENTS[1:])]
    canonical = OFFSETS[1:] @ FACING
    scale = float((offsets * canonical).sum() / (canonical**2).sum())
    if scale <= 0.0 or np.abs(offsets - scale * canonical).max() > 0.002 * scale:
        raise InputError(
            f"The bones of '{armature.name}' were moved in edit mode; add a new character instead."
        )

    size = np.array(armature.scale)
    if not np.isfinite(size).all() or size[0] <= 0.0 or np.ptp(size) > 1e-4 * size[0]:
        raise InputError(
            f"The armature '{armature.name}' is scaled unevenly; set its three scales to the same "
            "positive value."
        )

    return scale * float(size[0]) * unit


def create_character(
    context: bpy.types.Context,
    name: str = "Character",
    height: float = STATURE,
    build: float = 1.0,
) -> bpy.types.Object:
    """A character of this height (metres) at the 3D cursor: armature, body, and root, head and hand
    empties.

    It stands in a T-pose and looks along the world's +y, in a new collection of its own. ``build``:
    how thick trunk and limbs are, over the usual; bones and motion are the same.

    Returns the armature, whose ``dafnet`` settings name the empties. ``InputError``: Blender is not
    in object mode.
    """
    if context.mode != "OBJECT":
        raise InputError(
            "A character can only be added in object mode; leave the current mode first."
        )

    scale = height / STATURE / metres_per_unit(context.scene)
    collection = bpy.data.collections.new(name)
    context.scene.collection.children.link(collection)
    place = context.scene.cursor.location

    armature = _armature_object(context, collection, name, scale)
    armature.location = place
    armature.rotation_euler = (0.0, 0.0, np.pi)
    add_body(collection, armature, scale, build)

    def empty(role: str, point: tuple[float, float, float], size: float) -> bpy.types.Object:
        target = bpy.data.objects.new(f"{name} {role}", None)
        target.empty_display_type = "ARROWS"
        target.empty_display_size = size * scale
        target.location = place + Vector(point) * scale
        collection.objects.link(target)
        return target

    settings = armature.dafnet
    settings.root = empty("Root", (0.0, 0.0, 0.0), 0.4)
    settings.head = empty("Head", tuple(REST[joint("head")]), 0.2)
    settings.hand_left = empty("Left Hand", (-0.22, 0.08, 0.90), 0.15)
    settings.hand_right = empty("Right Hand", (0.22, 0.08, 0.90), 0.15)

    for selected in context.view_layer.objects.selected:
        selected.select_set(False)

    settings.root.select_set(True)
    armature.select_set(True)
    context.view_layer.objects.active = armature
    note_standing(armature)
    choose(context.scene, armature)
    return armature


def _mirrored(name: str) -> str:
    return name.replace("left_", "right_")


def _tail(name: str) -> np.ndarray:
    """The tail (3,) of a joint's bone, canonical metres."""
    left = name.replace("right_", "left_")
    side = np.array([-1.0 if left != name else 1.0, 1.0, 1.0])
    if left in _LEAVES:
        return REST[joint(name)] + side * _LEAVES[left]
    return REST[joint(_CHAIN[left] if left == name else _mirrored(_CHAIN[left]))]


def _armature_object(
    context: bpy.types.Context,
    collection: bpy.types.Collection,
    name: str,
    scale: float,
) -> bpy.types.Object:
    """An armature with a bone from joint to joint.

    Bones of arms and feet have their z axis up, the upright ones have it ahead.
    """
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    collection.objects.link(armature)
    context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")

    for j, joint_name in enumerate(JOINTS):
        bone = armature.data.edit_bones.new(joint_name)
        bone.head = scale * FACING @ REST[j]
        bone.tail = scale * FACING @ _tail(joint_name)
        if PARENTS[j] >= 0:
            bone.parent = armature.data.edit_bones[JOINTS[PARENTS[j]]]

        across = abs(bone.vector.normalized().x) > 0.7
        ahead = abs(bone.vector.normalized().y) > 0.7
        bone.align_roll(Vector((0, 0, 1)) if across or ahead else Vector((0, -1, 0)))

    bpy.ops.object.mode_set(mode="OBJECT")
    for bone in armature.pose.bones:
        bone.rotation_mode = "QUATERNION"

    armature.data.display_type = "STICK"
    armature.show_in_front = True
    return armature
