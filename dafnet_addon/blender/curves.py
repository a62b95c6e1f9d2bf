"""The curves of one action into another, with all that makes them play as they do."""

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

__all__ = ["copy_curve"]

_KEY_FIRST = ("co", "handle_left_type", "handle_right_type")
"""Of a key, what has to be set before its handles."""
_ELSEWHERE = {
    "co_ui",
    "select",
    "select_control_point",
    "select_left_handle",
    "select_right_handle",
    "lock",
    "name",
}
"""Properties that others stand for, that are of a moment, or that are set apart."""
_KINDS = {"FLOAT": np.float32, "INT": np.int32, "ENUM": np.int32, "BOOLEAN": np.bool_}


def copy_curve(
    source: bpy.types.FCurve, add_curve: Callable[[str, int, str], bpy.types.FCurve]
) -> bpy.types.FCurve:
    """Add to an action, by ``add_curve`` (see ``compat.new_action``), a curve that plays what
    ``source`` plays.

    Keys with their handles and easing, modifiers, extrapolation, whether it is muted or locked, and
    the group. A group that the action has already keeps its own settings: then a muted group of the
    source mutes the curve.
    """
    group = source.group
    target = add_curve(source.data_path, source.array_index, group.name if group else "")
    _alike(source, target, ("data_path", "array_index"))
    _keys(source, target)  # after the settings, some of which let Blender lay the handles anew
    for modifier in source.modifiers:
        _modifier(modifier, target.modifiers.new(modifier.type))
    if group and len(target.group.channels) == 1:
        _alike(group, target.group)
        target.group.lock = group.lock
    elif group and group.mute:
        target.mute = True
    target.lock = source.lock
    return target


def _keys(source: bpy.types.FCurve, target: bpy.types.FCurve) -> None:
    old, new = source.keyframe_points, target.keyframe_points
    if len(source.sampled_points):  # straight from sample to sample
        places = np.array([tuple(sample.co) for sample in source.sampled_points], np.float32)
        new.add(len(places))
        new.foreach_set("co", places.ravel())
        for point in new:
            point.interpolation = "LINEAR"
        return
    new.add(len(old))
    kinds = bpy.types.Keyframe.bl_rna.properties
    names = [kind.identifier for kind in kinds if kind.type in _KINDS and not kind.is_readonly]
    for name in (
        *_KEY_FIRST,
        *(name for name in names if name not in _KEY_FIRST and name not in _ELSEWHERE),
    ):
        length = max(1, getattr(kinds[name], "array_length", 1))
        values = np.empty(length * len(old), _KINDS[kinds[name].type])
        old.foreach_get(name, values)
        new.foreach_set(name, values)


def _modifier(source: bpy.types.FModifier, target: bpy.types.FModifier) -> None:
    _alike(source, target)
    if source.type != "ENVELOPE":
        return
    old, new = source.control_points, target.control_points
    for k in range(len(old)):
        new.add(float(k))
    # set one by one, each may crash Blender: it takes the point for a modifier then
    for name in ("frame", "min", "max"):
        values = np.empty(len(old), np.float32)
        old.foreach_get(name, values)
        new.foreach_set(name, values)


def _alike(source: Any, target: Any, apart: tuple[str, ...] = ()) -> None:
    """Set all plain properties of ``target`` as those of ``source`` are."""
    for kind in source.bl_rna.properties:
        if (
            kind.type in {*_KINDS, "STRING"}
            and not kind.is_readonly
            and kind.identifier not in {*_ELSEWHERE, *apart}
        ):
            setattr(target, kind.identifier, getattr(source, kind.identifier))
