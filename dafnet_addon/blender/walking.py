"""A character's walk round the furniture to a seat, or to a place to stand, as keys on its root."""

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.distance import scaled
from ..core.errors import InputError
from ..core.passage import Passage, SatOn, listed, met_along
from ..core.paths import BEFORE_SEAT, Route, Stop
from ..core.root import yaw_of
from ..core.solids import Mesh, Scene
from ..director.seats import on_a_seat, seat_of
from ..director.walks import walk_to
from .armature import character_scale, metres_per_unit
from .furniture import furniture_at
from .playback import frame_kept
from .root_keys import keyable_root, keyed_along, last_key, unchanged_on_failure
from .settings import settings_of

__all__ = ["Walk", "extended_to", "told_of", "walk"]

_BEFORE = 0.2  # seconds of rest before the first step
_BEFORE_SEAT = BEFORE_SEAT + 0.2  # metres from a seat within which one is coming to sit on it


@dataclass(frozen=True)
class Walk:
    """Frames ``first`` to ``last`` of the new keys; whether the scene's end had to be moved for
    them; sentences to be said.
    """

    first: int
    last: int
    extended: bool
    warnings: tuple[str, ...] = ()


def walk(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    seat: bpy.types.Object | None,
    seconds: float = 3.0,
    speed: float = 1.1,
) -> Walk:
    """Let the character walk to ``seat`` and sit there for some ``seconds``, or, for None, to the
    3D cursor and stand.

    Goes on from the root's last key, else from the current frame, where nothing before is changed.
    The seat has to be in the character's furniture collection; where it has none, the seat's own
    becomes that. ``InputError``: there is nothing to sit on, no way, no room before the seat, or
    the root cannot be keyed; nothing is changed then.
    """
    scene, own = context.scene, armature.dafnet
    furniture = own.furniture
    if seat is not None and furniture is None:
        furniture = _collection_of(seat, armature, scene)
    settings = settings_of(armature, scene, furniture=furniture.name_full if furniture else None)
    root = keyable_root(settings)
    keyed = last_key(root)
    first = scene.frame_current if keyed is None else keyed
    with frame_kept(scene):
        unit = metres_per_unit(scene)
        size = character_scale(armature, unit)
        found = furniture_at(context, settings, first)
        place, yaw = np.array(root.location, float) * unit / size, float(root.rotation_euler[2])
        goal = np.array(scene.cursor.location, float) * unit / size
    fps = scene.render.fps / scene.render.fps_base
    route, met = _route(found, seat, place, yaw, goal, seconds, speed, fps, size)
    last = first + len(route.path) - 1
    with unchanged_on_failure(root):
        keyed_along(context, root, route, first=first, scale=size / unit, fps=fps)
    own.furniture = furniture
    return Walk(first, last, extended_to(scene, armature, last), told_of(met, first))


def extended_to(scene: bpy.types.Scene, armature: bpy.types.Object, last: int) -> bool:
    """Let the range that the character generates reach to frame ``last``; whether its end had to be
    moved for that.
    """
    own = armature.dafnet
    if last <= (scene.frame_end if own.use_scene_range else own.frame_end):
        return False
    if own.use_scene_range:
        scene.frame_end = last
    else:
        own.frame_end = last
    return True


def told_of(met: Sequence[Passage], first: int) -> tuple[str, ...]:
    """A sentence about the furniture that a walk from frame ``first`` on leads through, if any."""
    places = listed(met, lambda each: f"from frame {first + each.start} to {first + each.stop - 1}")
    return (
        (
            f"The walk leads through furniture, {places}; make room there, or key the root "
            "another way.",
        )
        if met
        else ()
    )


def _collection_of(
    seat: bpy.types.Object, armature: bpy.types.Object, scene: bpy.types.Scene
) -> bpy.types.Collection:
    """The collection that a seat lies in, as the furniture of a character that has none yet."""
    for collection in seat.users_collection:
        if collection != scene.collection and armature.name not in collection.all_objects:
            return collection
    raise InputError(
        f"'{seat.name}' lies in no collection of its own; put the furniture into one and choose it."
    )


def _route(
    found: dict[str, list[Mesh]],
    seat: bpy.types.Object | None,
    place: np.ndarray,
    yaw: float,
    goal: np.ndarray,
    seconds: float,
    speed: float,
    fps: float,
    size: float,
) -> tuple[Route, tuple[Passage, ...]]:
    """The walk in metres of the canonical body, from the root's ``place`` (3,) to the seat or to
    ``goal`` (3,), and the furniture that it leads through.
    """
    floor = float(place[2])

    def canonical(meshes: list[Mesh]) -> Scene:
        return scaled(Scene(tuple(meshes)), 1.0 / size)

    everything = canonical([mesh for meshes in found.values() for mesh in meshes])
    start = Stop(
        (float(place[0]), float(place[1])),
        yaw,
        _BEFORE,
        seated=on_a_seat(everything.solids, place[:2], floor),
    )
    if seat is None:
        away = goal[:2] - place[:2]
        end = Stop((float(goal[0]), float(goal[1])), float(yaw_of(away)), seconds)
        route = walk_to(everything.solids, start, end, speed, fps, floor, size)
        return route, met_along(everything, route.path, fps, end=())
    names = [
        name
        for name in (seat.name, *(child.name for child in seat.children_recursive))
        if name in found
    ]
    if not names:
        raise InputError(
            f"'{seat.name}' is not in the character's furniture collection; move it there."
        )
    solids = canonical([mesh for name in names for mesh in found[name]]).solids
    spot = seat_of(solids, place[:2], floor, seat.name, size=size)
    end = Stop((float(spot.position[0]), float(spot.position[1])), spot.yaw, seconds, seated=True)
    route = walk_to(everything.solids, start, end, speed, fps, floor, size)
    met = met_along(
        everything, route.path, fps, [SatOn(spot.position, spot.height, frozenset(names))]
    )
    away = np.linalg.norm(route.path.position[:, :2] - spot.position, axis=1)
    comes = int(np.flatnonzero(away > _BEFORE_SEAT)[-1])
    for each in met:
        if each.stop - 1 > comes and each.name not in names:
            raise InputError(
                f"'{each.name}' stands where one comes to sit on '{seat.name}'; pull "
                f"'{seat.name}' out, or choose another seat."
            )
    return route, met
