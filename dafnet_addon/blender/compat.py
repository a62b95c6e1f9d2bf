"""Everything in which Blender 4.2, 4.5, 5.0 and 5.2 differ for this add-on.

Actions have slots from 4.4 on, and ``Action.fcurves`` is gone in 5.0; images and video are
media types of their own from 5.0 on; what a modifier gives to its node group is properties of its
own from 5.2 on.
"""

from collections.abc import Callable
from typing import Any

import bpy

__all__ = [
    "new_action",
    "add_strip",
    "assign_action",
    "playback_restorer",
    "action_curves",
    "animated_paths",
    "playing_paths",
    "remove_curves",
    "shares_curves",
    "node_inputs",
    "node_tree_of",
    "output_image",
    "output_numbers",
    "output_video",
]

_SLOTS = bpy.app.version >= (4, 4, 0)


def new_action(
    owner: bpy.types.Object,
    name: str,
) -> tuple[bpy.types.Action, Callable[[str, int, str], bpy.types.FCurve]]:
    """A new action for ``owner``, not assigned yet, and a function (path, index, group) that adds a
    curve to it.

    With an empty ``group`` the curve is in none.
    """
    action = bpy.data.actions.new(name)
    if _SLOTS:
        slot = action.slots.new(id_type="OBJECT", name=owner.name)
        curves = (
            action.layers.new("Layer").strips.new(type="KEYFRAME").channelbag(slot, ensure=True)
        )
    else:
        curves = action

    def add(path: str, index: int, group: str) -> bpy.types.FCurve:
        curve = curves.fcurves.new(path, index=index)
        if group:
            curve.group = curves.groups.get(group) or curves.groups.new(group)
        return curve

    return action, add


def assign_action(owner: bpy.types.Object, action: bpy.types.Action) -> None:
    """Let ``owner`` play ``action``, with nothing mixed into it."""
    data = owner.animation_data_create()
    data.action = action
    data.action_blend_type, data.action_influence = "REPLACE", 1.0
    if _SLOTS:
        # Without one the action would not play.
        data.action_slot = action.slots[0]


def add_strip(track: bpy.types.NlaTrack, action: bpy.types.Action) -> bpy.types.NlaStrip:
    """Add a strip that plays an action at its own frames."""
    strip = track.strips.new(action.name, round(action.frame_range[0]), action)
    if _SLOTS:
        strip.action_slot = action.slots[0]
    return strip


def playback_restorer(owner: bpy.types.Object) -> Callable[[bpy.types.Object], None]:
    """A function that makes ``owner`` play again what it plays now, mixed as it is now.

    It takes the object, which may have to be found again after an undo, as may the action.
    """
    data = owner.animation_data
    if data is None:
        return lambda found: found.animation_data_clear()

    played = data.action
    name, kept = (played.name_full, played.use_fake_user) if played else (None, False)
    mixed = data.action_blend_type, data.action_influence
    slot = data.action_slot.handle if _SLOTS and data.action_slot else None
    last_slot = data.last_slot_identifier if _SLOTS else ""

    def restore(found: bpy.types.Object) -> None:
        data = found.animation_data_create()
        try:
            now = played.name_full if played else None
        except ReferenceError:
            now = name
        action = next((each for each in bpy.data.actions if each.name_full == now), None)
        data.action = action
        data.action_blend_type, data.action_influence = mixed
        if _SLOTS:
            if action:
                data.action_slot = next(
                    (each for each in action.slots if each.handle == slot), None
                )
            data.last_slot_identifier = last_slot

        if action:
            action.use_fake_user = kept

    return restore


def action_curves(owner: bpy.types.Object) -> list[bpy.types.FCurve]:
    """The curves of the action that ``owner`` plays."""
    data = owner.animation_data
    if data is None or data.action is None:
        return []
    return _curves_of(data.action, data.action_slot if _SLOTS else None)


def _curves_of(action: bpy.types.Action, slot: Any) -> list[bpy.types.FCurve]:
    """The curves of an action's slot; where there are no slots, all."""
    if not _SLOTS:
        return list(action.fcurves)
    if slot is None:
        return []

    bags = (strip.channelbag(slot) for layer in action.layers for strip in layer.strips)
    return [curve for bag in bags if bag for curve in bag.fcurves]


def remove_curves(owner: bpy.types.Object, path: str) -> None:
    """Remove the curves of this data path from the action that ``owner`` plays."""
    data = owner.animation_data
    if data is None or data.action is None:
        return
    if not _SLOTS:
        bags: list[Any] = [data.action]
    else:
        strips = (strip for layer in data.action.layers for strip in layer.strips)
        bags = [strip.channelbag(data.action_slot) for strip in strips] if data.action_slot else []
    for bag in filter(None, bags):
        for curve in [each for each in bag.fcurves if each.data_path == path]:
            bag.fcurves.remove(curve)


def animated_paths(owner: bpy.types.ID) -> set[str]:
    """The data paths that the action of ``owner``, its NLA strips or its drivers may move."""
    data = getattr(owner, "animation_data", None)
    if data is None:
        return set()

    actions = {
        data.action,
        *(strip.action for track in data.nla_tracks for strip in track.strips),
    } - {None}
    paths = {curve.data_path for action in actions for curve in all_curves(action)}
    return paths | {driver.data_path for driver in data.drivers}


def playing_paths(owner: bpy.types.ID) -> set[str]:
    """The data paths of ``owner`` that its own keys, its NLA strips or its drivers move now: muted
    strips and drivers do not.
    """
    data = owner.animation_data
    if data is None:
        return set()

    curves = [*action_curves(owner), *(driver for driver in data.drivers if not driver.mute)]
    strips = [strip for track in data.nla_tracks if not track.mute for strip in track.strips]
    while strips:
        strip = strips.pop()
        if strip.mute:
            continue
        strips += strip.strips  # those that it holds together
        if strip.action:
            curves += _curves_of(strip.action, strip.action_slot if _SLOTS else None)
    return {curve.data_path for curve in curves}


def all_curves(action: bpy.types.Action) -> list[bpy.types.FCurve]:
    """The curves of all slots."""
    if not _SLOTS:
        return list(action.fcurves)
    strips = (strip for layer in action.layers for strip in layer.strips)
    return [curve for strip in strips for bag in strip.channelbags for curve in bag.fcurves]


def shares_curves(owner: bpy.types.ID, other: bpy.types.ID) -> bool:
    """Whether both play the same curves of one action."""
    mine, theirs = owner.animation_data, getattr(other, "animation_data", None)
    if mine is None or theirs is None or mine.action is None or theirs.action != mine.action:
        return False
    return not _SLOTS or theirs.action_slot_handle == mine.action_slot_handle


def node_inputs(modifier: bpy.types.NodesModifier) -> list[Any]:
    """The values that a modifier gives to its node group."""
    if bpy.app.version < (5, 2, 0):
        return list(modifier.values())

    inputs = modifier.properties.inputs
    sockets = [
        getattr(inputs, kind.identifier)
        for kind in inputs.bl_rna.properties
        if kind.type == "POINTER" and kind.identifier != "rna_type"
    ]
    return [socket.value for socket in sockets if hasattr(socket, "value")]


def node_tree_of(material: bpy.types.Material) -> bpy.types.NodeTree:
    """The nodes of a new material, which is there by itself from 5.0 on."""
    if material.node_tree is None:
        material.use_nodes = True
    return material.node_tree


def output_image(scene: bpy.types.Scene) -> None:
    """Let the scene render to a PNG file."""
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format = "PNG"


def output_numbers(scene: bpy.types.Scene) -> None:
    """Let the scene render to an OpenEXR file whose pixels are numbers in single precision."""
    output_image(scene)
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGBA", "32"


def output_video(scene: bpy.types.Scene) -> None:
    """Let the scene render to an H.264 MP4 file."""
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "VIDEO"
    image.file_format = "FFMPEG"
    scene.render.ffmpeg.format = "MPEG4"
    scene.render.ffmpeg.codec = "H264"
    scene.render.ffmpeg.constant_rate_factor = "HIGH"
