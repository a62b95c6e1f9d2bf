"""Seats that furniture says itself where they are: custom properties ``OMI_seat``, as glTF has them
(``gltf_seats``), in extras or made by hand.
"""

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...core.errors import InputError
from ...director.seats import MarkedSeat
from ..gltf_seats import NAME

__all__ = ["mark", "marked_on", "require_markable"]

_POINTS = ("back", "foot", "knee")


def marked_on(objects: Sequence[bpy.types.Object], unit: float) -> tuple[MarkedSeat, ...]:
    """The seats marked on objects; ``unit``: metres of a Blender unit.

    Raises InputError where one is marked otherwise than as three points.
    """
    return tuple(_read(each, unit) for each in objects if each.get(NAME) is not None)


def _read(carrier: bpy.types.Object, unit: float) -> MarkedSeat:
    seat = carrier[NAME]
    try:
        points = [np.array(seat[name], float) for name in _POINTS]
        angle = float(seat.get("angle", 0.5 * np.pi))
    except (KeyError, TypeError, ValueError, AttributeError, IndexError):
        points, angle = [], 0.0
    if not points or not all(p.shape == (3,) and np.isfinite(p).all() for p in points):
        raise InputError(
            f"'{carrier.name}': its {NAME} needs back, foot and knee, three numbers each; correct "
            "it in the custom properties, or remove it."
        )
    world = [carrier.matrix_world @ Vector((x, -z, y)) for x, y, z in points]
    back, foot, knee = (np.array(point, float) * unit for point in world)
    return MarkedSeat(back, foot, knee, angle)


def require_markable(carrier: bpy.types.Object) -> None:
    """Raises InputError where an object has no frame of its own to mark a seat in."""
    try:
        carrier.matrix_world.inverted()
    except ValueError as error:
        raise InputError(
            f"'{carrier.name}' has a scale of 0, so no seat can be marked on it; apply its scale "
            "first."
        ) from error


def mark(carrier: bpy.types.Object, seat: MarkedSeat, unit: float, frame: Matrix) -> None:
    """Write down a seat, metres of the world, on an object whose own frame is there; ``unit``:
    metres of a Blender unit.
    """
    inverse = frame.inverted()
    made = {}
    for name in _POINTS:
        x, y, z = inverse @ Vector(getattr(seat, name) / unit)
        made[name] = [x, z, -y]
    carrier[NAME] = made
