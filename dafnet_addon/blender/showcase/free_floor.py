"""Finds floor that is free, near the 3D cursor: examples do not stand in what is there."""

from collections.abc import Collection, Iterator

import bpy
import numpy as np
from mathutils import Vector

__all__ = ["free_floor"]

_LOW, _HIGH = 0.05, 2.0
"""Metres over the floor, between which something is in the way."""
_ROOM = 6.0
"""Metres across, of what is a room or the ground and no piece in it."""
_STEP = 0.5
"""Metres between the places that are tried."""
_FARTHEST = 12.0
"""Metres from the cursor up to which they are."""


def free_floor(
    scene: bpy.types.Scene,
    low: np.ndarray,
    high: np.ndarray,
    unit: float,
    but: Collection[bpy.types.Object] = (),
) -> Vector:
    """Where the middle of something goes that needs the floor from ``low`` to ``high`` (2,), metres
    around it: the 3D cursor, or the nearest place beside what stands there; the cursor where there
    is none. World, Blender units. ``but``: what is not in the way.
    """
    middle = scene.cursor.location.copy()
    boxes = np.array(list(_in_the_way(scene, middle.z, unit, but))).reshape(-1, 2, 2)
    for offset in _offsets():
        place = np.array(middle[:2]) * unit + offset
        apart = (boxes[:, 0] > place + high) | (boxes[:, 1] < place + low)
        if apart.any(axis=1).all():
            return middle + Vector((*(offset / unit), 0.0))
    return middle


def _offsets() -> list[np.ndarray]:
    """Places (2,) around the cursor, metres, the nearest first."""
    steps = np.arange(-_FARTHEST, _FARTHEST + _STEP, _STEP)
    grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    return list(grid[np.argsort(np.linalg.norm(grid, axis=1), kind="stable")])


def _in_the_way(
    scene: bpy.types.Scene, floor: float, unit: float, but: Collection[bpy.types.Object]
) -> Iterator[np.ndarray]:
    """The boxes (2, 2) over the floor, metres, of the visible meshes that stand on it."""
    for each in scene.objects:
        if each.type != "MESH" or each in but or not each.visible_get():
            continue
        matrix = np.array(each.matrix_world, float)
        corners = (np.array(each.bound_box) @ matrix[:3, :3].T + matrix[:3, 3]) * unit
        low, high = corners.min(axis=0), corners.max(axis=0)
        stands = high[2] > floor * unit + _LOW and low[2] < floor * unit + _HIGH
        if stands and (high - low)[:2].max() < _ROOM:
            yield np.stack([low[:2], high[:2]])
