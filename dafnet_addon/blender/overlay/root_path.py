"""The root's path as the overlays show it: of the take that plays, else by the root's own keys."""

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Euler

from ...core.root import RootPath, root_from_matrices
from ...core.rotations import matrix_from_quaternion
from ..character.armature import metres_per_unit
from ..compat import action_curves
from .watched import played_now

__all__ = ["root_path"]


def root_path(
    context: bpy.types.Context, armature: bpy.types.Object
) -> tuple[RootPath, int] | None:
    """The root's path and its first frame: the played take's, in metres; else the root's own keys
    over the frame range.

    None where there is neither, or where constraints or drivers move the root, which only playing
    the scene could tell.
    """
    played = played_now(context, armature)
    if played is not None:
        return root_from_matrices(played.take.root)[0], played.action.dafnet.frame_start

    root, own, scene = armature.dafnet.root, armature.dafnet, context.scene
    if root is None:
        return None

    first, last = (
        (scene.frame_start, scene.frame_end)
        if own.use_scene_range
        else (own.frame_start, own.frame_end)
    )
    matrices = _keyed_matrices(root, range(first, last + 1))
    if matrices is None:
        return None

    path, _ = root_from_matrices(matrices)
    return RootPath(path.position * metres_per_unit(scene), path.yaw), first


def _keyed_matrices(root: bpy.types.Object, frames: range) -> np.ndarray | None:
    """World matrices (T, 4, 4) of the root by its keys alone, Blender units; a parent counts as it
    stands now.
    """
    curves = {(c.data_path, c.array_index): c for c in action_curves(root) if not c.mute}
    data = root.animation_data
    if (
        not curves
        or not len(frames)
        or (data and data.drivers)
        or any(not constraint.mute for constraint in root.constraints)
    ):
        return None

    def values(path: str, unkeyed: Sequence[float]) -> np.ndarray:
        channels = [curves.get((path, index)) for index in range(len(unkeyed))]
        return np.array(
            [
                [
                    c.evaluate(frame) if c else value
                    for c, value in zip(channels, unkeyed, strict=True)
                ]
                for frame in frames
            ]
        )

    basis = np.tile(np.eye(4), (len(frames), 1, 1))

    basis[:, :3, 3] = values("location", root.location)
    if root.rotation_mode == "QUATERNION":
        basis[:, :3, :3] = matrix_from_quaternion(
            values("rotation_quaternion", root.rotation_quaternion)
        )
    elif root.rotation_mode == "AXIS_ANGLE":
        basis[:, :3, :3] = np.array(root.matrix_basis.to_3x3().normalized())
    else:
        angles = values("rotation_euler", root.rotation_euler)
        basis[:, :3, :3] = [np.array(Euler(a, root.rotation_mode).to_matrix()) for a in angles]

    above = np.array(root.matrix_world @ root.matrix_basis.inverted_safe())
    return above @ basis if np.isfinite(above).all() else None
