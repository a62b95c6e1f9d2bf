"""The furniture near the root as it is in the current frame, measured once and kept for the
overlays.
"""

import bpy
import numpy as np

from ...core.distance import prepared, scaled
from ...core.errors import InputError
from ...core.solids import Box, Mesh, Scene
from ..character.settings import settings_of
from ..scene.furniture import furniture_now
from .cache import cache

__all__ = ["furniture_near"]

_FLOOR_STEP = 0.02
"""Metres to which the floor's height is rounded: a swaying root does not measure furniture anew."""
_REACH = 1.35
"""Metres around the root within which furniture matters."""
_BELOW = 0.3
"""Metres below the root within which it matters."""
_ABOVE = 2.3
"""Metres above the root within which it matters."""
_CAPACITY = 2
"""Collections kept: a take may be of another size than the character is now."""


class _Piece:
    """One mesh of the furniture, with its bounds ``low`` and ``high`` (3,) in the world, metres.

    Its distance field is computed when it is first near enough to matter.
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        points = np.asarray(mesh.vertices) @ mesh.matrix[:3, :3].T + mesh.matrix[:3, 3]
        self.low, self.high = points.min(axis=0), points.max(axis=0)
        self._measured: Mesh | Box | None = None

    def measured(self, floor: float, size: float) -> Mesh | Box:
        """The mesh with its distance field, canonical metres."""
        if self._measured is None:
            own = scaled(Scene((self.mesh,)), 1.0 / size)
            self._measured = prepared(own, floor / size)[0].solids[0]
        return self._measured


def furniture_near(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    place: np.ndarray,
    size: float,
    floor: float,
) -> Scene:
    """The character's furniture around a root at ``place`` (3,), world metres, in canonical metres;
    empty where none can be seen.

    ``size``: the body's over the canonical one. ``floor``: its height, world metres.
    """
    furniture = armature.dafnet.furniture
    if furniture is None:
        return Scene()

    floor = _FLOOR_STEP * round(floor / _FLOOR_STEP)
    members = tuple((o.session_uid, o.visible_get()) for o in furniture.all_objects)
    key = (
        cache.furniture,
        context.scene.session_uid,
        armature.session_uid,
        members,
        floor,
        round(size, 6),
    )
    pieces = cache.recall("furniture", key, lambda: _pieces(context, armature), _CAPACITY)

    low = place - size * np.array((_REACH, _REACH, _BELOW))
    high = place + size * np.array((_REACH, _REACH, _ABOVE))
    near = [piece for piece in pieces if (piece.low < high).all() and (piece.high > low).all()]
    return Scene(tuple(piece.measured(floor, size) for piece in near))


def _pieces(context: bpy.types.Context, armature: bpy.types.Object) -> list[_Piece]:
    settings = settings_of(armature, context.scene, frame_start=0, frame_end=0)
    try:
        found = furniture_now(context, settings)
    except InputError:
        return []
    return [_Piece(mesh) for meshes in found.values() for mesh in meshes]
