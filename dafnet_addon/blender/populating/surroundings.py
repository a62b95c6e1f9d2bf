"""A scene of Blender's as the director's room: what stands in it, what has a name, where the floor
is.
"""

from collections.abc import Iterator

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.solids import Mesh
from ...director.room import Room
from ...director.seats import MarkedSeat
from ..character.armature import is_character, metres_per_unit
from ..scene.furniture import meshes_in
from ..scene.marked_seats import marked_on

__all__ = ["furniture_of_room", "room_of", "standing_objects"]

FURNITURE = "Furniture"
"""The name of the collection that furniture lies in."""


def standing_objects(scene: bpy.types.Scene) -> set[bpy.types.Object]:
    """The visible objects that may be furniture: all but armatures, and what is parented to them,
    follows or is deformed by them.
    """
    bodies: set[bpy.types.Object] = set()
    for each in scene.objects:
        if each.type == "ARMATURE":
            bodies |= {each, *each.children_recursive}
            bodies.add(each.dafnet.root if is_character(each) else None)
        elif any(m.type == "ARMATURE" and m.object is not None for m in each.modifiers):
            bodies.add(each)
    return {each for each in scene.objects if each.visible_get()} - bodies


def furniture_of_room(scene: bpy.types.Scene) -> bpy.types.Collection:
    """The collection "Furniture", where the room has one, else a new one of all that stands in
    it.
    """
    found = next((each for each in scene.collection.children if each.name == FURNITURE), None)
    if found is None:
        found = bpy.data.collections.new(FURNITURE)
        for each in standing_objects(scene):
            if each.type == "MESH":
                found.objects.link(each)
        scene.collection.children.link(found)
    return found


def room_of(context: bpy.types.Context) -> Room:
    """The scene in its present frame; world, metres.

    Meshes are furniture by the names of their objects, those parented to another mesh parts of it;
    collections are groups; empties, cameras and lights can be looked at or walked to, and curves
    walked along.
    """
    scene = context.scene
    unit = metres_per_unit(scene)
    members = standing_objects(scene)
    solids = tuple(meshes_in(context.evaluated_depsgraph_get(), members, unit))
    named = {solid.name for solid in solids}
    others = [each for each in scene.objects if each in members and each.name not in named]
    marked, misread = _marked(members, named, unit)
    return Room(
        solids=solids,
        parts={
            each.name: _whole(each, named)
            for each in members
            if each.name in named and _whole(each, named) != each.name
        },
        groups=dict(_groups(scene, named)),
        points={
            each.name: np.array(each.matrix_world.translation) * unit
            for each in others
            if each.type in {"EMPTY", "CAMERA", "LIGHT"}
        },
        lines={each.name: line for each in others if (line := _line(each, unit)) is not None},
        marked=marked,
        misread=misread,
        floor=_floor(solids),
    )


def _marked(
    members: set[bpy.types.Object], named: set[str], unit: float
) -> tuple[dict[str, tuple[MarkedSeat, ...]], dict[str, str]]:
    """The seats that pieces say themselves, by their names: marked on a mesh, or on what carries it
    or hangs on it; and of those that do not say it as seats are marked, what is wrong.
    """
    found: dict[str, tuple[MarkedSeat, ...]] = {}
    misread: dict[str, str] = {}
    for each in sorted(members, key=lambda each: each.name):
        seats: tuple[MarkedSeat, ...] = ()
        wrong = ""
        try:
            seats = marked_on([each], unit)
        except InputError as error:
            wrong = str(error)
        if not seats and not wrong:
            continue
        family = [each, *_carriers(each), *each.children_recursive]
        mesh = next((other for other in family if other.name in named), None)
        if mesh is None:
            continue
        name = _whole(mesh, named)
        if wrong:
            misread[name] = wrong
        else:
            found[name] = (*found.get(name, ()), *seats)
    return found, misread


def _carriers(part: bpy.types.Object) -> list[bpy.types.Object]:
    """What an object is parented to, the nearest first."""
    return [] if part.parent is None else [part.parent, *_carriers(part.parent)]


def _whole(part: bpy.types.Object, named: set[str]) -> str:
    """The name of the uppermost mesh that an object is parented to."""
    while part.parent is not None and part.parent.name in named:
        part = part.parent
    return str(part.name)


def _groups(scene: bpy.types.Scene, named: set[str]) -> Iterator[tuple[str, list[str]]]:
    for collection in scene.collection.children_recursive:
        members = [each.name for each in collection.all_objects if each.name in named]
        if members:
            yield collection.name, members


def _line(curve: bpy.types.Object, unit: float) -> np.ndarray | None:
    """Points (N, 3) along a curve without a body."""
    if curve.type != "CURVE" or not curve.data.splines:
        return None
    made = curve.to_mesh()
    try:
        local = np.array([vertex.co for vertex in made.vertices], float).reshape(-1, 3)
    finally:
        curve.to_mesh_clear()
    if len(local) < 2:
        return None
    matrix = np.array(curve.matrix_world)
    return np.asarray((local @ matrix[:3, :3].T + matrix[:3, 3]) * unit)


_LEVEL = 0.02
"""Metres of height that count as one level."""
_COVERS = 0.3
"""Share of the room's extent that a floor covers, at least."""
_SMALLEST = 4.0
"""Square metres of a floor; tables are smaller."""


def _floor(solids: tuple[Mesh, ...]) -> float:
    """The height of the floor: the lowest level at which surfaces that look up cover much of the
    room, and at least half as much as at any other; where there is none, what the furniture stands
    on.
    """
    levels, areas, points = [np.zeros(0, int)], [np.zeros(0)], [np.zeros((0, 3))]
    for solid in solids:
        matrix = np.asarray(solid.matrix, float).reshape(-1, 4, 4)[0]
        world = np.asarray(solid.vertices) @ matrix[:3, :3].T + matrix[:3, 3]
        corners = world[np.asarray(solid.triangles)]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(normal, axis=1) / 2.0
        up = normal[:, 2] > 0.99 * 2.0 * area
        levels.append(np.rint(corners[up, :, 2].mean(axis=1) / _LEVEL).astype(int))
        areas.append(area[up])
        points.append(np.stack([world.min(axis=0), world.max(axis=0)]))

    extents = np.concatenate(points)
    if not len(extents):
        return 0.0
    known, which = np.unique(np.concatenate(levels), return_inverse=True)
    total = np.bincount(which.reshape(-1), np.concatenate(areas), len(known))
    across = float(np.prod(np.ptp(extents[:, :2], axis=0)))
    least = max(_SMALLEST, _COVERS * across, 0.5 * float(total.max(initial=0.0)))
    floors = known[total >= least]
    return float(floors[0]) * _LEVEL if len(floors) else float(extents[:, 2].min())
