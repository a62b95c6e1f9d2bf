"""Keys on a rig: its object, its controls, its settings, and what is put at rest."""

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Quaternion

from ...core.rotations import continuous_signs, normalised, quaternion_from_matrix
from ..pipeline.baker import key_curves
from .controls import Channels, Control
from .reading import rigid_parts

__all__ = [
    "Curves",
    "key_control",
    "key_object",
    "key_rest",
    "key_setting",
    "rekey_rotation",
]

Curves = Callable[[str, int, str], bpy.types.FCurve]
"""Adds the curve of a data path, an index and a group to an action."""


def key_rest(
    bone: bpy.types.PoseBone, add_curve: Curves, frame: float, kinds: tuple[str, ...]
) -> None:
    """Put a bone at rest, with one key for each kind of channels."""
    bone.matrix_basis.identity()
    start = f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].'
    path, rotation = _rotation_channels(bone.rotation_mode, np.array([[1.0, 0.0, 0.0, 0.0]]))
    at_rest = {
        "location": ("location", np.zeros((1, 3))),
        "rotation": (path, rotation),
        "scale": ("scale", np.ones((1, 3))),
    }
    for kind in kinds:
        path, values = at_rest[kind]
        key_curves(add_curve, start + path, bone.name, frames=np.array([frame]), values=values)


def key_setting(
    rig: bpy.types.Object, add_curve: Curves, *, bone: str, key: str, value: Any, frame: float
) -> None:
    """Set and key a custom property of a bone, where the bone has it as a number."""
    owner = rig.pose.bones[bone]
    if isinstance(owner.get(key), int | float):
        owner[key] = type(owner[key])(value)
        names = (bpy.utils.escape_identifier(part) for part in (bone, key))
        path = 'pose.bones["{}"]["{}"]'.format(*names)
        key_curves(add_curve, path, bone, frames=np.array([frame]), values=np.array([[value]]))


def key_object(
    rig: bpy.types.Object,
    add_curve: Curves,
    *,
    matrices: np.ndarray,
    frames: np.ndarray,
) -> None:
    """Key the object's own transform: ``matrices`` (T, 4, 4) at ``frames`` (T,)."""
    rotations, _ = rigid_parts(matrices, f"armature '{rig.name}'")
    path, values = _rotation_channels(rig.rotation_mode, _quaternions(rotations))
    key_curves(add_curve, "location", "Object", frames=frames, values=matrices[:, :3, 3])
    key_curves(add_curve, path, "Object", frames=frames, values=values)


def key_control(
    rig: bpy.types.Object,
    add_curve: Curves,
    control: Control,
    *,
    channels: Channels,
    index: int,
    frames: np.ndarray,
) -> dict[str, list[bpy.types.FCurve]]:
    """Key one control, the one with this ``index`` in ``channels``; its curves by channel."""
    bone = rig.pose.bones[control.bone]
    bone.matrix_basis.identity()
    path, values = _rotation_channels(bone.rotation_mode, _quaternions(channels.turns[:, index]))
    start = f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].'
    curves: dict[str, list[bpy.types.FCurve]] = {}

    def adding_to(channel: str) -> Curves:
        def add(path: str, index: int, group: str) -> bpy.types.FCurve:
            curve = add_curve(path, index, group)
            curves.setdefault(channel, []).append(curve)
            return curve

        return add

    if control.moves:
        moves = channels.moves[:, index]
        key_curves(
            adding_to("location"), start + "location", bone.name, frames=frames, values=moves
        )

    if control.pole is None:
        key_curves(adding_to("rotation"), start + path, bone.name, frames=frames, values=values)

    return curves


def rekey_rotation(
    bone: bpy.types.PoseBone,
    curves: list[bpy.types.FCurve],
    *,
    turns: np.ndarray,
    frames: np.ndarray,
) -> None:
    """Replace the keys of a bone's rotation ``curves`` by rotations ``turns`` (T, 3, 3)."""
    _, values = _rotation_channels(bone.rotation_mode, _quaternions(turns))
    for curve, column in zip(curves, values.T, strict=True):
        points = np.stack([frames, column], axis=1).astype(np.float32)
        curve.keyframe_points.foreach_set("co", points.ravel())
        curve.update()


def _rotation_channels(mode: str, quaternions: np.ndarray) -> tuple[str, np.ndarray]:
    """Data path and values (T, 3 or 4) of rotations (T, 4) in one of Blender's rotation modes,
    steady in time.
    """
    if mode == "QUATERNION":
        return "rotation_quaternion", quaternions

    if mode == "AXIS_ANGLE":
        axis, length = quaternions[:, 1:], np.linalg.norm(quaternions[:, 1:], axis=1)
        angle = 2.0 * np.arctan2(length, quaternions[:, 0])
        return "rotation_axis_angle", np.concatenate(
            [angle[:, None], normalised(axis, np.array([0.0, 1.0, 0.0]))], axis=1
        )

    angles, before = [], Euler((0.0, 0.0, 0.0), mode)
    for quaternion in quaternions:
        before = Quaternion(quaternion.tolist()).to_euler(mode, before)
        angles.append(tuple(before))

    return "rotation_euler", np.array(angles)


def _quaternions(turns: np.ndarray) -> np.ndarray:
    return continuous_signs(quaternion_from_matrix(turns))
