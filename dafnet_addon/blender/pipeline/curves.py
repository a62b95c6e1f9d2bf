"""Copies animation curves with everything that makes them play as they do."""

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

__all__ = ["copy_curve"]

_BEFORE_HANDLES = ("co", "handle_left_type", "handle_right_type")
"""What of a key has to be set before its handles."""
_NOT_COPIED = {
    "co_ui",
    "select",
    "select_control_point",
    "select_left_handle",
    "select_right_handle",
    "lock",
    "name",
}
"""Properties that follow from others, say what is selected, or are copied separately."""
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
    _copy_properties(source, target, ("data_path", "array_index"))
    _copy_keys(
        source, target
    )  # after the settings: some of them make Blender recompute the handles
    for modifier in source.modifiers:
        _copy_modifier(modifier, target.modifiers.new(modifier.type))

    if group and len(target.group.channels) == 1:
        _copy_properties(group, target.group)
        target.group.lock = group.lock
    elif group and group.mute:
        target.mute = True

    target.lock = source.lock
    return target


def _copy_keys(source: bpy.types.FCurve, target: bpy.types.FCurve) -> None:
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
        *_BEFORE_HANDLES,
        *(name for name in names if name not in _BEFORE_HANDLES and name not in _NOT_COPIED),
    ):
        length = max(1, getattr(kinds[name], "array_length", 1))
        values = np.empty(length * len(old), _KINDS[kinds[name].type])
        old.foreach_get(name, values)
        new.foreach_set(name, values)


def _copy_modifier(source: bpy.types.FModifier, target: bpy.types.FModifier) -> None:
    _copy_properties(source, target)
    if source.type != "ENVELOPE":
        return

    old, new = source.control_points, target.control_points
    for k in range(len(old)):
        new.add(float(k))
    # Not point by point: setting a single one may crash Blender, which takes it for a modifier.
    for name in ("frame", "min", "max"):
        values = np.empty(len(old), np.float32)
        old.foreach_get(name, values)
        new.foreach_set(name, values)


def _copy_properties(source: Any, target: Any, skipped: tuple[str, ...] = ()) -> None:
    """Copy all plain properties of ``source`` to ``target``, except those ``skipped``."""
    for kind in source.bl_rna.properties:
        if (
            kind.type in {*_KINDS, "STRING"}
            and not kind.is_readonly
            and kind.identifier not in {*_NOT_COPIED, *skipped}
        ):
            setattr(target, kind.identifier, getattr(source, kind.identifier))
