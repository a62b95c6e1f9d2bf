"""Finds the furniture near a character's root path in the scene."""

from dataclasses import dataclass

import bpy
import numpy as np

from ...core.conditions import shot_steps
from ...core.errors import InputError
from ...core.progress import run_to_end
from ...core.sensor import REACH
from ...core.solids import Mesh
from ...director.surfaces import surface_points
from ..character.armature import bodies, character_scale, metres_per_unit
from ..character.settings import Settings, settings_of
from ..scene.furniture import furniture_now
from ..scene.lookup import find_object
from ..scene.scene_reader import read_scene
from .path_sources import places_over_time

__all__ = ["FoundFurniture", "find_furniture"]

_NEAR = 1.5
"""Metres from the path, in plan, within which furniture is near."""
_LOW = 0.07
"""Metres above the floor; floors and rugs are lower."""
_HIGH = 2.0
"""Metres above the floor; lamps and ceilings are higher."""
_SPACING = 0.1
"""Metres between the points on a surface."""
_PLACES_A_SECOND = 10
"""How many places of the path are looked at for each second."""
_UNSEEN = {"CURVE", "SURFACE", "META", "FONT"}
"""Types of objects that may have faces but are not meshes."""


@dataclass(frozen=True)
class FoundFurniture:
    """``names`` of the objects that lie in ``collection`` now; ``warnings``: sentences about what
    the sensor cannot see.
    """

    collection: bpy.types.Collection
    names: tuple[str, ...]
    warnings: tuple[str, ...]


def find_furniture(context: bpy.types.Context, armature: bpy.types.Object) -> FoundFurniture:
    """Link the visible meshes near the root's path into a collection "… Furniture", which becomes
    the character's.

    Characters and other armatures, what is parented to them or deformed by them, and floors do not
    count. What an earlier search has linked and is no longer near is unlinked again, if it also
    lies in another collection. ``InputError``: there is no root, nothing is near it, or the scene
    cannot be read; nothing is changed then.
    """
    scene, own = context.scene, armature.dafnet
    settings = settings_of(armature, scene, mode="FREE")
    path = _path(context, settings, armature)
    unit = metres_per_unit(scene)
    size = character_scale(armature, unit)
    candidates = [o for o in scene.objects if o not in bodies(scene)]

    collection = bpy.data.collections.new(f"{armature.name} Furniture")
    try:
        for each in candidates:
            if each.visible_get():
                collection.objects.link(each)

        meshes = furniture_now(
            context, settings_of(armature, scene, furniture=collection.name_full)
        )
        away = {name: _distance(found, path, size) for name, found in meshes.items()}
        near = {name for name, distance in away.items() if distance < _NEAR * size}
        if not near:
            raise InputError(
                f"No visible mesh lies within {_NEAR:g} m of the root's path; animate the root "
                "near the furniture first."
            )

        for each in list(collection.objects):
            if each.name not in near:
                collection.objects.unlink(each)

        read = read_scene(
            context, settings_of(armature, scene, mode="FREE", furniture=collection.name_full)
        )
        warnings = [*read.warnings, *run_to_end(shot_steps(read.scene, read.controls)).warnings]
    except InputError:
        bpy.data.collections.remove(collection)
        raise

    if unseen := sorted(f"'{name}'" for name in near if away[name] > REACH * size):
        warnings.append(
            f"Never closer than {REACH:g} m, so the character does not see: {', '.join(unseen)}."
        )

    return FoundFurniture(
        _adopt(scene, own, collection),
        tuple(sorted(near)),
        (*_ignored_warnings(candidates, path, unit, size), *warnings),
    )


def _adopt(
    scene: bpy.types.Scene, own: bpy.types.PropertyGroup, collection: bpy.types.Collection
) -> bpy.types.Collection:
    """Make ``collection`` the character's furniture: one that was found earlier takes its objects
    over, else it is used itself.
    """
    wanted = f"{own.id_data.name} Furniture"
    earlier = own.furniture
    if earlier is None or earlier == collection or earlier.name != wanted or earlier.library:
        scene.collection.children.link(collection)
        own.furniture = collection
        return collection

    for each in list(collection.objects):
        if each.name not in earlier.objects:
            earlier.objects.link(each)
    for each in list(earlier.objects):
        if each.name not in collection.objects and len(each.users_collection) > 1:
            earlier.objects.unlink(each)

    bpy.data.collections.remove(collection)
    return earlier


def _path(context: bpy.types.Context, settings: Settings, armature: bpy.types.Object) -> np.ndarray:
    """Places (N, 3) of the root during the shot, world, metres."""
    scene = context.scene
    if settings.root is None:
        raise InputError(
            f"The character '{armature.name}' has no root; choose its root object in the DAFNet "
            "panel."
        )

    step = max(1, round(scene.render.fps / scene.render.fps_base / _PLACES_A_SECOND))
    frames = [*range(settings.frame_start, settings.frame_end, step), settings.frame_end]
    return places_over_time(
        context, find_object(settings, settings.root, "root"), frames
    ) * metres_per_unit(scene)


def _distance(meshes: list[Mesh], path: np.ndarray, size: float) -> float:
    """Metres from the path (N, 3) over the floor to what of the meshes stands on it; infinite
    beyond what is near.
    """
    low, high = path.min(0) - _NEAR * size, path.max(0) + _NEAR * size
    points = surface_points(meshes, _SPACING * size, (low[:2], high[:2]))
    points = points[((points > low) & (points < high))[:, :2].all(1)]
    points = np.unique(np.round(points / (0.5 * _SPACING * size)), axis=0) * (0.5 * _SPACING * size)
    over = points[:, None, 2] - path[None, :, 2]
    away = np.linalg.norm(points[:, None, :2] - path[None, :, :2], axis=-1)
    standing = (over > _LOW * size) & (over < _HIGH * size)
    return float(np.min(away, where=standing, initial=np.inf))


def _ignored_warnings(
    candidates: list[bpy.types.Object], path: np.ndarray, unit: float, size: float
) -> list[str]:
    """Sentences about what stands near the path but is hidden, or is not a mesh."""
    hidden: list[str] = []
    others: list[str] = []
    for each in candidates:
        seen = each.visible_get()
        if (each.type == "MESH" and seen) or each.type not in {"MESH", *_UNSEEN}:
            continue
        if each.type == "CURVE" and not (
            each.data.bevel_depth or each.data.extrude or each.data.bevel_object
        ):
            continue

        matrix = np.array(each.matrix_world, float)
        corners = (np.array(each.bound_box) @ matrix[:3, :3].T + matrix[:3, 3]) * unit
        low, high = corners.min(0), corners.max(0)
        beyond = np.maximum(np.maximum(low[:2] - path[:, :2], path[:, :2] - high[:2]), 0.0)
        near = np.linalg.norm(beyond, axis=1) < _NEAR * size
        standing = (high[2] - path[:, 2] > _LOW * size) & (low[2] - path[:, 2] < _HIGH * size)
        if (near & standing).any():
            (others if seen else hidden).append(f"'{each.name}'")

    out = []
    if hidden:
        out.append(
            f"Hidden near the path, so ignored: {', '.join(hidden)}; show what should count."
        )
    if others:
        out.append(f"Not meshes, so ignored: {', '.join(others)}; convert what should count.")

    return out
