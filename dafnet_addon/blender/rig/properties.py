"""What the animator sets on a rig (``Object.dafnet_rig``): its bones by joint, and how to bake onto
it.
"""

from typing import Any

import bpy
from bpy.props import CollectionProperty, EnumProperty, IntProperty, PointerProperty, StringProperty

from ...core.errors import InputError
from ...core.skeleton import JOINTS
from ..character.armature import is_character
from ..overridable import LOCALLY, ROWS_LOCALLY
from . import maps
from .detection import detect_map

__all__ = ["character_for", "map_of", "presets", "register", "rig_of", "show_map", "unregister"]


def _is_character(_settings: "RigSettings", candidate: bpy.types.Object) -> bool:
    return is_character(candidate)


class RigRow(bpy.types.PropertyGroup):
    """One joint (``name``) and the bone for it."""

    bone: StringProperty(
        override=LOCALLY,
        name="Bone",
        options=set(),
        description="Bone of this joint; leave it empty where the rig has none",
    )


class RigSettings(bpy.types.PropertyGroup):
    """Settings of an armature that is not a DAFNet character."""

    rows: CollectionProperty(
        override=ROWS_LOCALLY, type=RigRow, options=set(), description="Bones of the joints"
    )
    active_row: IntProperty(
        override=LOCALLY, name="Joint", options=set(), description="The row that is selected"
    )
    convention: StringProperty(
        override=LOCALLY,
        name="Convention",
        options=set(),
        description="Name of the preset that the bones come from",
    )
    more: StringProperty(
        override=LOCALLY,
        options={"HIDDEN"},
        description="What else the preset knows about the rig's controls",
    )
    root_bone: StringProperty(
        override=LOCALLY,
        name="Root Bone",
        options=set(),
        description="Bone that carries the whole rig",
    )
    character: PointerProperty(
        override=LOCALLY,
        name="Character",
        type=bpy.types.Object,
        poll=_is_character,
        options=set(),
        description="DAFNet character whose motion is baked onto this armature",
    )
    root_motion: EnumProperty(
        override=LOCALLY,
        name="Root Motion",
        default="OBJECT",
        options=set(),
        description="What carries the character through the scene",
        items=[
            (
                "OBJECT",
                "Object",
                "The armature object moves over the floor and turns with the character",
            ),
            (
                "BONE",
                "Root Bone",
                "The root bone moves over the floor and turns with the character",
            ),
            ("HIPS", "Hips", "Only the hips move; object and root bone stay"),
        ],
    )
    limbs: EnumProperty(
        override=LOCALLY,
        name="Limbs",
        default="FK",
        options=set(),
        description="Which controls of arms and legs are keyed",
        items=[
            ("FK", "FK", "Rotate each bone of the arms and legs"),
            (
                "IK",
                "IK",
                "Place the hand, foot and pole controls; for rigs whose preset knows them, such "
                "as Rigify",
            ),
        ],
    )


_GROUPS = (RigRow, RigSettings)


def register() -> None:
    """Add the settings to every object."""
    for cls in _GROUPS:
        bpy.utils.register_class(cls)
    bpy.types.Object.dafnet_rig = PointerProperty(
        type=RigSettings, name="DAFNet Rig", override=LOCALLY
    )


def unregister() -> None:
    """Undo ``register``."""
    del bpy.types.Object.dafnet_rig
    for cls in reversed(_GROUPS):
        bpy.utils.unregister_class(cls)


def rig_of(context: bpy.types.Context) -> bpy.types.Object | None:
    """The animator's own armature: the active one, or the one whose mesh is active."""
    active = context.object
    if active is not None and active.type != "ARMATURE":
        active = active.parent
    return (
        active
        if active is not None and active.type == "ARMATURE" and not is_character(active)
        else None
    )


def character_for(context: bpy.types.Context, rig: bpy.types.Object) -> bpy.types.Object:
    """The character to bake from: the rig's own setting, else a selected one, else the only one of
    the scene.

    ``InputError``: there is none, or more than one to choose from.
    """
    chosen = rig.dafnet_rig.character
    there = [o for o in context.scene.objects if is_character(o)]
    if chosen is not None:
        if chosen not in there:
            raise InputError(
                f"The character '{chosen.name}' is not in the scene; choose another one in the "
                "Your Rig panel."
            )
        return chosen

    several = [o for o in there if o in context.selected_objects] or there
    if not several:
        raise InputError(
            "There is no DAFNet character in the scene; add one and generate a motion first."
        )

    if len(several) > 1:
        raise InputError(
            "There are several characters; choose one in the Your Rig panel, or select it with "
            "the rig."
        )

    return several[0]


def show_map(rig: bpy.types.Object, rig_map: maps.RigMap) -> None:
    """Put a map into the rig's settings, one row a joint."""
    own = rig.dafnet_rig
    for joint in JOINTS:
        # Rows that come from a library cannot be removed from an override, but changed.
        row = own.rows.get(joint) or own.rows.add()
        row.name, row.bone = joint, rig_map.joints.get(joint, "")
    own.convention, own.root_bone = rig_map.name, rig_map.root or ""
    own.more = maps.as_text(rig_map)


def map_of(rig: bpy.types.Object) -> maps.RigMap:
    """The map in the rig's settings, or the detected one if none has been set yet."""
    own = rig.dafnet_rig
    if not own.more:
        return detect_map(rig)
    return maps.with_bones(
        maps.from_text(own.more),
        own.root_bone or None,
        {row.name: row.bone for row in own.rows if row.bone},
    )


def presets(_settings: Any, _context: bpy.types.Context) -> list[tuple[str, str, str]]:
    """All maps as the items of a menu."""
    items = []
    for key, file in maps.map_files().items():
        try:
            rig_map = maps.load_map(file)
        except InputError:
            continue
        items.append((key, rig_map.name, rig_map.about))

    _menu_items[:] = items
    return _menu_items


_menu_items: list[tuple[str, str, str]] = []
"""Blender needs the strings of a dynamic menu to live on."""
