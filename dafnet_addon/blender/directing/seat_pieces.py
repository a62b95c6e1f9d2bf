"""The piece of furniture that a selected object is a part of, where a character finds it, and how
it is pulled out.
"""

from collections.abc import Iterable

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...core.errors import InputError
from ..character.armature import bodies, is_character, metres_per_unit
from ..compat import action_curves, playing_paths, remove_curves

__all__ = ["add_furniture", "collection_of", "movable", "move", "moved_back", "piece_of", "top_of"]

_LARGEST = 3.5
"""Metres across, of what is one piece though it has several objects; larger families are rooms."""
_AROUND = 3.0
"""Metres around a character and a seat, in which everything is its furniture."""
_CARRIERS = {"EMPTY", "MESH"}


def top_of(seat: bpy.types.Object) -> bpy.types.Object:
    """What carries all parts of the piece that an object belongs to: its highest parent whose
    family is not larger than furniture.
    """
    top, unit = seat, metres_per_unit(bpy.context.scene)
    while top.parent is not None and top.parent.type in _CARRIERS:
        if any(is_character(each) for each in top.parent.children_recursive):
            break
        low, high = _box([top.parent, *top.parent.children_recursive])
        if not (high - low).max() * unit <= _LARGEST:
            break
        top = top.parent
    return top


def piece_of(seat: bpy.types.Object) -> list[str]:
    """The names of the objects that make up a seat: itself first, then the others of its family."""
    top = top_of(seat)
    return list(dict.fromkeys(o.name for o in (seat, top, *top.children_recursive)))


def _box(objects: Iterable[bpy.types.Object]) -> tuple[np.ndarray, np.ndarray]:
    """The lowest and the highest corner (3,) of the box around objects with faces, Blender units;
    nothing where there are none.
    """
    corners = [
        np.array(each.bound_box) @ np.array(each.matrix_world)[:3, :3].T
        + np.array(each.matrix_world.translation)
        for each in objects
        if each.type == "MESH"
    ]
    if not corners:
        return np.zeros(3), np.zeros(3)
    points = np.concatenate(corners)
    return points.min(axis=0), points.max(axis=0)


def collection_of(
    seat: bpy.types.Object, armature: bpy.types.Object, scene: bpy.types.Scene
) -> bpy.types.Collection | None:
    """The collection that a seat lies in, as the furniture of a character that has none yet; None
    where it lies in the scene's own, or beside the character.
    """
    for collection in seat.users_collection:
        if collection != scene.collection and armature.name not in collection.all_objects:
            return collection
    return None


def add_furniture(
    seat: bpy.types.Object, armature: bpy.types.Object, scene: bpy.types.Scene
) -> bpy.types.Collection:
    """A new collection, not yet in the scene, of all that is visible around a character and a seat
    and is nobody's body.
    """
    made = bpy.data.collections.new(f"{armature.name} Furniture")
    reach = _AROUND / metres_per_unit(scene)
    own = armature.dafnet.root
    place = np.array((own or armature).matrix_world.translation)[:2]
    middle = np.array(seat.matrix_world.translation)[:2]
    low, high = np.minimum(place, middle) - reach, np.maximum(place, middle) + reach
    piece, people = set(piece_of(seat)), bodies(scene)
    for each in scene.objects:
        if each in people or not each.visible_get():
            continue
        near = each.name in piece or each.instance_type != "NONE"
        if not near and each.type == "MESH":
            first, last = _box([each])
            near = bool(((first[:2] <= high) & (last[:2] >= low)).all())
        if near:
            made.objects.link(each)
    return made


def movable(top: bpy.types.Object) -> None:
    """Raises InputError where a piece of furniture cannot be moved."""
    if (
        top.library
        or "location" in playing_paths(top)
        or any(top.lock_location)
        or any(not c.mute for c in top.constraints)
    ):
        raise InputError(
            f"'{top.name}' is linked, locked or constrained, or moved by keys, NLA strips or "
            "drivers, so it cannot be pulled out; move it yourself, or choose another seat."
        )


def move(top: bpy.types.Object, offset: np.ndarray, between: tuple[int, int] | None = None) -> None:
    """Move a piece by an offset (2,) in the world, Blender units; ``between`` two frames, with keys
    on its location, where these are given.
    """
    if between is not None:
        top.keyframe_insert("location", frame=between[0])
    top.matrix_world = Matrix.Translation(Vector((*offset.tolist(), 0.0))) @ top.matrix_world
    if between is not None:
        top.keyframe_insert("location", frame=between[1])


def moved_back(top: bpy.types.Object, frame: float) -> None:
    """Take the keys back with which ``move`` has pulled a piece out: it is where it was before, or
    as far from there as it was moved by hand since, in the current ``frame``.

    Raises InputError where its location has other keys as well.
    """
    curves = {c.array_index: c for c in action_curves(top) if c.data_path == "location"}
    if not curves:
        return
    if any(len(curve.keyframe_points) != 2 for curve in curves.values()):
        raise InputError(
            f"'{top.name}' has other keys of its location than those that pulled it out; remove "
            "these, or send the character anew."
        )
    place = list(top.location)
    for k, curve in curves.items():
        place[k] += curve.keyframe_points[0].co[1] - curve.evaluate(frame)
    remove_curves(top, "location")
    top.location = place
