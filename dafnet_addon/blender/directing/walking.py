"""A character's walk around the furniture to a seat or to a place to stand, as keys on its root."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.distance import scaled
from ...core.errors import InputError
from ...core.passage import Passage, SatOn, listed, met_along
from ...core.paths import BEFORE_SEAT, Route, Stop, facing
from ...core.progress import stepwise, within
from ...core.solids import Scene
from ...director.seats import on_a_seat, seat_of
from ...director.walks import unit_doubt, walk_to
from ..character.armature import character_scale, metres_per_unit
from ..character.settings import Settings, settings_of
from ..scene.furniture import furniture_at
from ..scene.lookup import find_collection, find_object, find_scene
from .root_keys import key_route, keyable_root, last_key, unchanged_on_failure

__all__ = ["Start", "Walk", "extend_range", "rest_at", "start_of", "passage_warnings", "walk"]

_BEFORE = 0.2
"""Seconds of rest before the first step."""
_READ = 0.1
"""Progress once the scene is read."""
_SITTING_DOWN = BEFORE_SEAT + 0.2
"""Metres from a seat within which a walker is about to sit down on it."""


@dataclass(frozen=True)
class Walk:
    """What was keyed: frames ``first`` to ``last``, both included; whether the range had to be
    ``extended`` for them; ``warnings`` for the user.
    """

    first: int
    last: int
    extended: bool
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Start:
    """Where a character is at frame ``first``: ``place`` (3,) and ``yaw`` of its root, and the
    furniture then; canonical metres.

    ``unit``: a Blender unit in canonical metres. ``size``: the character's over the canonical one.
    """

    first: int
    fps: float
    unit: float
    size: float
    place: np.ndarray
    yaw: float
    scene: Scene

    @property
    def floor(self) -> float:
        return float(self.place[2])


def start_of(
    context: bpy.types.Context, settings: Settings, first: int | None = None
) -> Generator[float, None, Start]:
    """Read where a character is at frame ``first``, None for its root's last key or else the
    current frame. A job, see ``playback.play_steps``.
    """
    scene = find_scene(settings)
    root = keyable_root(settings)
    if first is None:
        keyed = last_key(root)
        first = scene.frame_current if keyed is None else keyed

    seen: list[tuple[float, np.ndarray, float]] = []

    def look() -> None:
        armature = find_object(settings, settings.armature, "character")
        root = keyable_root(settings)
        size = character_scale(armature, metres_per_unit(scene))
        seen.append((size, np.array(root.location, float), float(root.rotation_euler[2])))

    solids = yield from furniture_at(context, settings, first, look)
    yield 1.0
    ((size, location, yaw),) = seen
    unit = metres_per_unit(scene) / size
    return Start(
        first=first,
        fps=scene.render.fps / scene.render.fps_base,
        unit=unit,
        size=size,
        place=location * unit,
        yaw=yaw,
        scene=scaled(Scene(solids), 1.0 / size),
    )


def rest_at(start: Start) -> Generator[float, None, Stop]:
    """Where a root rests before it goes."""
    place = start.place[:2]
    seated = yield from on_a_seat.steps(start.scene.solids, place, start.floor)
    return Stop((float(place[0]), float(place[1])), start.yaw, _BEFORE, seated=seated)


@stepwise
def walk(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    seat: bpy.types.Object | None,
    seconds: float = 3.0,
    speed: float = 1.1,
) -> Generator[float, None, Walk]:
    """Let the character walk to ``seat`` and sit there for some ``seconds``, or, for None, to the
    3D cursor and stand.

    The walk continues from the root's last key, else from the current frame; earlier keys stay. The
    seat has to be in the character's furniture collection; where it has none, the seat's own
    becomes that. ``InputError``: there is nothing to sit on, no way, no room before the seat, or
    the root cannot be keyed. Then, or if the job is closed, nothing is changed.
    """
    scene, furniture = context.scene, armature.dafnet.furniture
    if seat is not None and furniture is None:
        furniture = _collection_of(seat, armature, scene)

    settings = settings_of(armature, scene, furniture=furniture.name_full if furniture else None)
    names = [seat.name, *(child.name for child in seat.children_recursive)] if seat else []
    goal = np.array(scene.cursor.location, float)

    start = yield from within(start_of(context, settings), 0.0, _READ)
    route, met, warnings = yield from within(
        _route(start, names, goal[:2] * start.unit, seconds, speed), _READ, 1.0
    )

    root = keyable_root(settings)
    character = find_object(settings, settings.armature, "character")
    own = find_collection(settings.furniture) if settings.furniture is not None else None
    with unchanged_on_failure(root):
        key_route(context, root, route, first=start.first, scale=1.0 / start.unit, fps=start.fps)

    character.dafnet.furniture = own
    last = start.first + len(route.path) - 1
    extended = extend_range(scene, character, last)
    return Walk(start.first, last, extended, (*passage_warnings(met, start.first), *warnings))


def extend_range(scene: bpy.types.Scene, armature: bpy.types.Object, last: int) -> bool:
    """Make the range that the character generates reach frame ``last``; whether its end had to be
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


def passage_warnings(met: Sequence[Passage], first: int) -> tuple[str, ...]:
    """A warning about the furniture that a walk, keyed from frame ``first`` on, leads through."""
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
    start: Start, names: Sequence[str], goal: np.ndarray, seconds: float, speed: float
) -> Generator[float, None, tuple[Route, tuple[Passage, ...], tuple[str, ...]]]:
    """The walk in metres of the canonical body to the seat, whose parts have these ``names``, or
    where there are none to ``goal`` (2,); the furniture that it leads through; warnings.
    """
    here = yield from within(rest_at(start), 0.0, 0.05)
    if names:
        route, passages = yield from within(
            _route_to_seat(start, here, names, seconds, speed), 0.05, 1.0
        )
        return route, passages, ()

    solids, floor, size = start.scene.solids, start.floor, start.size
    end = Stop((float(goal[0]), float(goal[1])), facing(goal - start.place[:2]), seconds)
    way = walk_to.steps(solids, here, end, speed, start.fps, floor, size)
    route = yield from within(way, 0.05, 0.6)

    met = met_along.steps(start.scene, route.path, start.fps, end=())
    passages = yield from within(met, 0.6, 0.95)
    doubt = yield from within(
        unit_doubt.steps(solids, route.path.position[:, :2], floor, size), 0.95, 1.0
    )
    return route, passages, (doubt,) if doubt else ()


def _route_to_seat(
    start: Start, here: Stop, names: Sequence[str], seconds: float, speed: float
) -> Generator[float, None, tuple[Route, tuple[Passage, ...]]]:
    """The walk from ``here`` to the seat, and the furniture that it leads through. ``InputError``
    where something stands before the seat.
    """
    solids, floor, size = start.scene.solids, start.floor, start.size
    seat, *_ = names
    parts = [solid for solid in solids if solid.name in names]
    if not parts:
        raise InputError(f"'{seat}' is not in the character's furniture collection; move it there.")

    spot = yield from within(
        seat_of.steps(parts, start.place[:2], floor, seat, size=size), 0.0, 0.15
    )
    end = Stop((float(spot.position[0]), float(spot.position[1])), spot.yaw, seconds, seated=True)
    way = walk_to.steps(solids, here, end, speed, start.fps, floor, size)
    route = yield from within(way, 0.15, 0.6)

    sat_on = SatOn(spot.position, spot.height, frozenset(solid.name for solid in parts))
    met = met_along.steps(start.scene, route.path, start.fps, [sat_on])
    passages = yield from within(met, 0.6, 1.0)

    gap = np.linalg.norm(route.path.position[:, :2] - spot.position, axis=1)
    sits_down_after = int(np.flatnonzero(gap > _SITTING_DOWN)[-1])
    for each in passages:
        if each.stop - 1 > sits_down_after and each.name not in names:
            raise InputError(
                f"'{each.name}' is in the way of sitting down on '{seat}'; pull "
                f"'{seat}' out, or choose another seat."
            )

    return route, passages
