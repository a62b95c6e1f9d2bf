"""Bakes a take onto the character: keyframes in a new action."""

from collections.abc import Callable
from typing import NamedTuple

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.root import yaw_of
from ...core.rotations import (
    continuous_signs,
    matrix_from_quaternion,
    quaternion_from_matrix,
    rotate,
    transpose,
)
from ...core.skeleton import JOINTS, PELVIS
from ...core.take import Take
from ..character.armature import character_scale
from ..character.mannequin import FACING
from ..character.nla_modes import require_not_tweaked_nor_solo
from ..compat import action_curves, assign_action, new_action
from .curves import copy_curve

__all__ = [
    "TRANSFORMS",
    "Channels",
    "bake",
    "channels_of",
    "has_drivers",
    "key_curves",
    "has_bone_overrides",
    "ready_to_pose",
    "require_bakeable",
]

TRANSFORMS = ("location", "rotation", "scale")
"""How the data paths of an object's own transform begin."""


def require_bakeable(armature: bpy.types.Object, unit: float = 1.0) -> float:
    """The character's size (``character_scale``), if it can be baked onto. ``InputError`` where it
    cannot.
    """
    if armature.type != "ARMATURE":
        raise InputError(
            f"'{armature.name}' is not an armature; select a character made with Add Character."
        )
    override = armature.override_library
    if armature.library or (override and override.is_system_override):
        raise InputError(
            f"The armature '{armature.name}' is linked, or an override that may not be edited; "
            "make an editable library override of it, or make it local."
        )

    if armature.parent:
        raise InputError(
            f"The armature '{armature.name}' has a parent; clear it, and parent the root object "
            "instead."
        )

    if any(not constraint.mute for constraint in armature.constraints) or has_drivers(
        armature, TRANSFORMS
    ):
        raise InputError(
            f"The armature '{armature.name}' has object constraints or drivers; mute them and "
            "constrain the root."
        )

    delta = (
        *armature.delta_location,
        *armature.delta_rotation_euler,
        *(s - 1.0 for s in armature.delta_scale),
    )
    if any(delta):
        raise InputError(
            f"The armature '{armature.name}' has delta transforms; apply them and try again."
        )

    if armature.data.pose_position == "REST":
        raise InputError(
            f"The armature '{armature.name}' shows its rest position; set it to Pose Position."
        )

    require_not_tweaked_nor_solo(armature)

    return character_scale(armature, unit)


def has_bone_overrides(armature: bpy.types.Object) -> bool:
    """Whether constraints or drivers of joints' bones change what an action plays."""
    constraints = (
        constraint for name in JOINTS for constraint in armature.pose.bones[name].constraints
    )
    return any(not constraint.mute for constraint in constraints) or has_drivers(
        armature, "pose.bones["
    )


def has_drivers(armature: bpy.types.Object, paths: str | tuple[str, ...]) -> bool:
    """Whether drivers that are not muted move anything whose data path begins like one of these."""
    drivers = armature.animation_data.drivers if armature.animation_data else ()
    return any(not driver.mute and driver.data_path.startswith(paths) for driver in drivers)


def bake(
    take: Take, armature: bpy.types.Object, frame_start: int, name: str, unit: float = 1.0
) -> bpy.types.Action:
    """Key every frame of ``take`` from ``frame_start`` on, in a new action ``name`` that
    ``armature`` plays.

    The object follows the root (location and heading), each bone turns, and the pelvis moves: bone
    lengths are constant, so all 22 bone heads lie on ``take.joints``. ``unit`` is the length of a
    Blender unit in metres. Earlier actions are kept by a fake user, and all other curves of the
    present one (the mode, influences, custom properties, further bones) are carried over to the new
    action.

    ``InputError``: the armature is linked, overridden, parented, constrained, edited, or its size
    differs from the take's; nothing is changed then.
    """
    scale = require_bakeable(armature, unit)
    if abs(scale - take.scale) > 1e-3 * take.scale:
        raise InputError(
            f"The character '{armature.name}' no longer has the size of the take; generate it "
            "again."
        )

    if not all(np.isfinite(values).all() for values in (take.joints, take.rotations, take.root)):
        raise InputError("The take holds values that are not numbers; generate it again.")

    frames = frame_start + np.arange(len(take), dtype=float)
    posed = channels_of(armature, take.joints, take.rotations, take.root, unit)
    previous = armature.animation_data.action if armature.animation_data else None
    carried = [curve for curve in action_curves(armature) if not _is_motion(curve.data_path)]
    action, add_curve = new_action(armature, name)
    action.use_fake_user = True

    key_curves(add_curve, "location", "Root", frames=frames, values=posed.places)
    key_curves(add_curve, "rotation_euler", "Root", frames=frames, values=posed.angles)
    for j, joint_name in enumerate(JOINTS):
        path = f'pose.bones["{joint_name}"].'
        if j == PELVIS:
            key_curves(add_curve, path + "location", joint_name, frames=frames, values=posed.pelvis)

        key_curves(
            add_curve,
            path + "rotation_quaternion",
            joint_name,
            frames=frames,
            values=continuous_signs(posed.turns[:, j]),
        )

    for curve in carried:
        copy_curve(curve, add_curve)

    if previous:
        previous.use_fake_user = True

    ready_to_pose(armature)
    assign_action(armature, action)
    return action


def ready_to_pose(armature: bpy.types.Object) -> None:
    """Set the modes of rotation that ``channels_of`` are for, and clear the joints' bones."""
    armature.rotation_mode = "XYZ"
    for joint_name in JOINTS:
        bone = armature.pose.bones[joint_name]
        bone.matrix_basis.identity()
        bone.rotation_mode = "QUATERNION"


class Channels(NamedTuple):
    """What T frames of a body are on an armature, in Blender's units: the object's ``places`` and
    Euler ``angles`` (T, 3), the ``pelvis`` bone's location (T, 3), and the ``turns`` (T, 22, 4) of
    the joints' bones, quaternions.
    """

    places: np.ndarray
    angles: np.ndarray
    pelvis: np.ndarray
    turns: np.ndarray


def channels_of(
    armature: bpy.types.Object,
    joints: np.ndarray,
    rotations: np.ndarray,
    root: np.ndarray,
    unit: float,
) -> Channels:
    """Those of ``joints`` (T, 22, 3), ``rotations`` (T, 22, 4) and ``root`` (T, 4, 4), as in a
    take: the object follows the root, each bone turns, and the pelvis moves.
    """
    to_root = transpose(root[:, :3, :3])
    heading = np.unwrap(yaw_of(root[:, :2, 1])) + np.pi
    pelvis = rotate(FACING @ to_root, joints[:, PELVIS] - root[:, :3, 3]) / (
        unit * armature.scale[0]
    )
    local = matrix_from_quaternion(rotations)
    local[:, 0] = to_root @ local[:, 0]
    rest = np.array([armature.data.bones[name].matrix_local for name in JOINTS])
    axes = FACING @ rest[:, :3, :3]
    own = rest[PELVIS]
    return Channels(
        places=root[:, :3, 3] / unit,
        angles=np.stack([0 * heading, 0 * heading, heading], axis=1),
        pelvis=(pelvis - own[:3, 3]) @ own[:3, :3],
        turns=quaternion_from_matrix(transpose(axes) @ local @ axes),
    )


def key_curves(
    add_curve: Callable[[str, int, str], bpy.types.FCurve],
    path: str,
    group: str,
    *,
    frames: np.ndarray,
    values: np.ndarray,
) -> None:
    """One linear curve with keys at ``frames`` (T,) for each column of ``values`` (T, D)."""
    for index, column in enumerate(values.T):
        curve = add_curve(path, index, group)
        points = curve.keyframe_points
        points.add(len(frames))
        points.foreach_set("co", np.stack([frames, column], axis=1).astype(np.float32).ravel())
        points.foreach_set("interpolation", np.full(len(frames), _LINEAR, np.int32))
        curve.update()


def _is_motion(path: str) -> bool:
    """Whether a data path is what a take moves: the object, and the bones that are joints."""
    return path.startswith((*TRANSFORMS, "delta_", *_JOINT_PATHS))


_JOINT_PATHS = tuple(f'pose.bones["{name}"].{part}' for name in JOINTS for part in TRANSFORMS)
_LINEAR = bpy.types.Keyframe.bl_rna.properties["interpolation"].enum_items["LINEAR"].value
