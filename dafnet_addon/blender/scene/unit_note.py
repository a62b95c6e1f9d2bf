"""Whether the scene's unit looks wrong for a character, told from boxes before anything runs."""

from collections.abc import Iterator
from time import monotonic

import bpy
import numpy as np

from ...core.checks import FARTHEST
from ...core.errors import InputError
from ...core.solids import Box
from ...director.walks import unit_doubt
from ..character.armature import bodies, character_scale, metres_per_unit

__all__ = ["unit_note", "unit_note_lately"]

_LOOKED_AT = 400
"""Objects of a scene that are looked at."""
_FRESH = 1.0
"""Seconds for which an answer is kept."""
_lately: dict[tuple[int, int], tuple[float, str | None]] = {}
"""The answer given last, by its scene and its character, with when it was found."""


def unit_note(scene: bpy.types.Scene, armature: bpy.types.Object) -> str | None:
    """A sentence that says that the scene's furniture looks far too large or too small for a
    character, and the likely unit; None where it does not, or where that cannot be told.
    """
    unit = metres_per_unit(scene)
    try:
        size = character_scale(armature, unit)
    except InputError:
        return None
    own = armature.dafnet
    place = np.array((own.root or armature).matrix_world.translation, float) * unit / size
    among = own.furniture.all_objects if own.furniture is not None else scene.objects
    boxes = list(_boxes(among[:_LOOKED_AT], scene, unit / size))
    return unit_doubt(boxes, [place[:2]], float(place[2]), size) if boxes else None


def unit_note_lately(scene: bpy.types.Scene, armature: bpy.types.Object) -> str | None:
    """``unit_note`` as it was within the last second, for what asks at each redraw."""
    key, now = (scene.session_uid, armature.session_uid), monotonic()
    if key not in _lately or now - _lately[key][0] > _FRESH:
        _lately.clear()
        _lately[key] = now, unit_note(scene, armature)
    return _lately[key][1]


def _boxes(objects: list[bpy.types.Object], scene: bpy.types.Scene, scale: float) -> Iterator[Box]:
    """The boxes around visible meshes that are nobody's body; ``scale``: a Blender unit in metres
    of the canonical body.
    """
    people = bodies(scene)
    for each in objects:
        if each.type != "MESH" or each in people or not each.visible_get():
            continue
        matrix = np.array(each.matrix_world, float)
        corners = (np.array(each.bound_box) @ matrix[:3, :3].T + matrix[:3, 3]) * scale
        low, high = corners.min(axis=0), corners.max(axis=0)
        if np.isfinite(corners).all() and np.abs(corners).max() < FARTHEST:
            yield Box(0.5 * (low + high), 0.5 * (high - low), name=each.name)
