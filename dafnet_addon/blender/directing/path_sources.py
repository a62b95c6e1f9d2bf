"""Keys on a character's root from what the animator has already: a drawn curve, something that
moves, points on the floor.
"""

import re
from collections.abc import Callable, Generator, Sequence

import bpy
import numpy as np

from ...core.passage import SatOn, met_along
from ...core.paths import AFTER_SEAT, GETS_UP, Route, Stop, facing, route
from ...core.progress import stepwise, within
from ...core.root import forward_of
from ...core.trails import FASTEST, followed, trail
from ...director.walks import unit_doubt, ways
from ..character.armature import character_and_goal, is_character, objects_of
from ..character.settings import Settings, settings_of
from ..character.walk_rows import CURVE, OBJECT, POINTS, Asked, Manner
from ..compat import action_curves
from ..scene.dependencies import Dependencies
from ..scene.lookup import find_object
from ..scene.playback import nothing_deleted, play_steps
from .curve_lines import line_of
from .made_walks import intact_walks, note_walk, walks_kept_on_failure
from .root_keys import (
    first_key,
    key_route,
    keyable_root,
    remove_keys_from,
    restore_between,
    unchanged_on_failure,
)
from .walking import Beginning, Start, Walk, extend_range, passage_warnings, rest_at, start_of, walk

__all__ = [
    "along_curve",
    "along_object",
    "character_and_source",
    "floor_points",
    "is_curve",
    "may_move",
    "places_over_time",
    "through_points",
]

_READ = 0.1
"""Progress once the scene is read."""
_FOUND = 0.7
"""Progress once the way is found."""
_SPACING = 0.05
"""Metres between points on the furniture."""
_THERE = 0.1
"""Metres from the root to the beginning of a curve up to which it need not walk there first."""
_SAME_PLACE = 0.3
"""Metres from the root up to which the first of several points counts as reached."""


def is_curve(candidate: bpy.types.Object) -> bool:
    """Whether it is a curve that was drawn."""
    return candidate.type == "CURVE"


def may_move(candidate: bpy.types.Object) -> bool:
    """Whether keys, drivers, constraints or a parent may move it."""
    return bool(
        any(curve.data_path == "location" for curve in action_curves(candidate))
        or candidate.parent
        or candidate.constraints
        or (
            candidate.animation_data
            and (candidate.animation_data.drivers or candidate.animation_data.nla_tracks)
        )
    )


def character_and_source(
    context: bpy.types.Context, fits: Callable[[bpy.types.Object], bool]
) -> tuple[bpy.types.Object | None, bpy.types.Object | None]:
    """The character to direct (``armature.character_and_goal``), and the other selected object that
    ``fits``: the active one, or the only one.
    """
    character = character_and_goal(context)[0]
    if character is None:
        return None, None
    parts = objects_of(character)
    others = [o for o in context.selected_objects if o not in parts and fits(o)]
    active = context.object
    return character, active if active in others else others[0] if len(others) == 1 else None


def floor_points(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The selected empties that are not part of a character, in the order of their names; 10 comes
    after 9.
    """
    characters = [o for o in context.scene.objects if is_character(o)]
    parts = {part for character in characters for part in objects_of(character)}
    found = [o for o in context.selected_objects if o.type == "EMPTY" and o not in parts]
    return sorted(
        found,
        key=lambda o: [
            (not t.isdigit(), int(t) if t.isdigit() else 0, t.lower())
            for t in re.split(r"(\d+)", o.name)
        ],
    )


def _key_walk(
    context: bpy.types.Context,
    settings: Settings,
    start: Start,
    walked: Route,
    asked: Asked,
    end: Sequence[SatOn] | None = None,
    warnings: Sequence[str] = (),
) -> Generator[float, None, Walk]:
    """Key a route in place of the root's keys from its first frame on, and collect warnings; before
    that frame the root moves as it did. ``asked``: what it was made for; ``end``: see
    ``met_along``.
    """
    met = yield from within(met_along.steps(start.scene, walked.path, start.fps, end=end), 0.0, 0.9)
    places = walked.path.position[:, :2]
    doubt = yield from within(
        unit_doubt.steps(start.scene.solids, places, start.floor, start.size), 0.9, 1.0
    )
    root, first = keyable_root(settings), start.first
    armature = find_object(settings, settings.armature, "character")
    intact, last = intact_walks(armature), first + len(walked.path) - 1
    with walks_kept_on_failure(context.scene, armature), unchanged_on_failure(root):
        kept = remove_keys_from(root, first)
        key_route(context, root, walked, first=first, scale=1.0 / start.unit, fps=start.fps)
        restore_between(root, kept)
        note_walk(context.scene, armature, asked, first=first, last=last, intact=intact)
        extended = extend_range(context.scene, armature, last)

    told = (*passage_warnings(met, first), *warnings, *([doubt] if doubt else []))
    return Walk(first, last, extended, told)


@stepwise
def along_curve(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    curve: bpy.types.Object,
    *,
    speed: float = 1.1,
    seconds: float = 1.0,
    gets_up: float = GETS_UP,
    keep_facing: bool = False,
    backwards: bool = False,
    begins: Beginning | None = None,
) -> Generator[float, None, Walk]:
    """Let the character walk along a curve from the current frame on, and stand at its end for some
    ``seconds``.

    Where the root has earlier keys, it walks from where it is to the curve first; else the walk
    begins on the curve. Later keys are replaced. ``keep_facing``: it keeps looking where it looks
    now. ``backwards``: from the curve's end. ``gets_up``: see ``core.paths.Stop``; ``begins``:
    there instead of at the current frame. ``InputError``: not a curve, too short, or the root
    cannot be keyed. Then, or if the job is closed, nothing is changed.
    """
    settings, goal = settings_of(armature, context.scene), curve.name_full
    name = curve.name
    line = line_of(context, curve)[:: -1 if backwards else 1]
    first = first_key(keyable_root(settings))

    begins = begins or Beginning(context.scene.frame_current)
    at = yield from within(start_of(context, settings, begins), 0.0, _READ)
    points = line[:, :2] * at.unit
    away = float(np.linalg.norm(points[0] - at.place[:2]))

    start = None
    if away < _THERE or (first is not None and first < at.first):
        start = yield from within(rest_at(at, gets_up), _READ, _READ)
    if start is not None and away >= _THERE:
        way = yield from within(_corners_through(at, start, [points[0]]), _READ, _FOUND)
        points = np.concatenate([way[:-1], points])

    walked = trail(
        points,
        start,
        speed=speed,
        fps=at.fps,
        floor=at.floor,
        yaw=at.yaw if keep_facing else None,
        seconds=seconds,
        name=f"curve '{name}'",
    )
    asked = Asked(
        kind=CURVE,
        manner=Manner(speed, seconds, gets_up=gets_up),
        goal=goal,
        keep_facing=keep_facing,
        backwards=backwards,
    )
    return (yield from within(_key_walk(context, settings, at, walked, asked, ()), _FOUND, 1.0))


def _corners_through(
    at: Start, start: Stop, goals: Sequence[np.ndarray]
) -> Generator[float, None, np.ndarray]:
    """Corners (N, 2) of the way around the furniture from ``start`` through all ``goals`` (2,),
    including these.
    """
    forward = forward_of(start.yaw)
    here = np.array(start.position) + (AFTER_SEAT if start.seated else 0.0) * forward
    legs = yield from ways.steps(
        at.scene.solids, [here, *goals], floor=at.floor, size=at.size, spacing=_SPACING
    )
    return np.array(
        [corner for leg, goal in zip(legs, goals, strict=True) for corner in (*leg, goal)]
    )


@stepwise
def places_over_time(
    context: bpy.types.Context, source: bpy.types.Object, frames: Sequence[int]
) -> Generator[float, None, np.ndarray]:
    """Where an object is (N, 3) in ascending ``frames``, world, Blender units; the current frame
    stays. ``InputError``: it is deleted meanwhile.
    """
    places: dict[int, tuple[float, ...]] = {}

    def look(frame: int, depsgraph: bpy.types.Depsgraph, _shaped: set[bpy.types.Object]) -> None:
        places[frame] = tuple(source.evaluated_get(depsgraph).matrix_world.translation)

    simulations = Dependencies(context.scene).simulations([source], shaped=False)
    with nothing_deleted("the scene was read", "try again"):
        yield from play_steps(context, frames, simulations, look)

    return np.array([places[frame] for frame in frames], float)


@stepwise
def along_object(
    context: bpy.types.Context, armature: bpy.types.Object, source: bpy.types.Object
) -> Generator[float, None, Walk]:
    """Let the root go where ``source`` goes over the floor, in the same frames: those of its keys,
    else the scene's range.

    The root's later keys are replaced. ``InputError``: the source hardly moves, or the root cannot
    be keyed. Then, or if the job is closed, nothing is changed.
    """
    scene, name, goal = context.scene, source.name, source.name_full
    settings = settings_of(armature, scene)
    keys = [
        point.co[0]
        for curve in action_curves(source)
        if curve.data_path == "location"
        for point in curve.keyframe_points
    ]
    first, last = scene.frame_start, scene.frame_end
    if keys:
        first, last = int(np.floor(min(keys))), int(np.ceil(max(keys)))

    moves = places_over_time.steps(context, source, range(first, last + 1))
    at = yield from within(start_of(context, settings, first), 0.0, _READ)
    places = (yield from within(moves, _READ, _FOUND))[:, :2] * at.unit
    moved = followed(places, at.fps, at.yaw, at.floor)

    fastest = float(np.linalg.norm(np.diff(moved.path.position, axis=0), axis=1).max() * at.fps)
    hurried = (
        f"'{name}' moves at up to {fastest:.1f} m/s, faster than this character can walk; "
        "slow it down."
    )
    warnings = [hurried] if fastest > FASTEST else []
    written = _key_walk(context, settings, at, moved, Asked(OBJECT, Manner(), goal), None, warnings)
    return (yield from within(written, _FOUND, 1.0))


@stepwise
def through_points(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    points: list[bpy.types.Object],
    *,
    speed: float = 1.1,
    seconds: float = 1.0,
    gets_up: float = GETS_UP,
    to_cursor: bool = False,
    place: Sequence[float] | None = None,
    begins: Beginning | None = None,
) -> Generator[float, None, Walk]:
    """Let the character walk through the places of ``points`` and stand at the last.

    ``to_cursor``: the 3D cursor is the last one, or ``place`` (3,) instead of it; without points it
    is the only one. The walk continues from the root's last key, else from the current frame,
    around the furniture and without pauses. ``gets_up``, ``begins``: see ``walk``. ``InputError``:
    there is no way, or the root cannot be keyed. Then, or if the job is closed, nothing is changed.
    """
    if not points:
        job = walk.steps(
            context, armature, None, seconds, speed, gets_up=gets_up, place=place, begins=begins
        )
        return (yield from job)

    settings = settings_of(armature, context.scene)
    names = tuple(point.name_full for point in points)
    spots = [point.matrix_world.translation for point in points]
    end = None
    if to_cursor:
        x, y, z = place or context.scene.cursor.location
        end = (float(x), float(y), float(z))
    flat = [np.array(spot, float)[:2] for spot in [*spots, *([end] if end else [])]]

    at = yield from within(start_of(context, settings, begins), 0.0, _READ)
    places = [spot * at.unit for spot in flat]
    if len(places) > 1 and np.linalg.norm(places[0] - at.place[:2]) < _SAME_PLACE:
        del places[0]

    start = yield from within(rest_at(at, gets_up), _READ, _READ)
    way = yield from within(_corners_through(at, start, places), _READ, _FOUND)

    last = way[-1] - (way[-2] if len(way) > 1 else np.array(start.position))
    via = [(float(x), float(y)) for x, y in way]
    goal = Stop(via.pop(), facing(last), seconds)
    walked = route(start, *via, goal, speed=speed, fps=at.fps, floor=at.floor)
    manner = Manner(speed, seconds, gets_up=gets_up)
    asked = Asked(kind=POINTS, manner=manner, points=names, place=end)
    return (yield from within(_key_walk(context, settings, at, walked, asked, ()), _FOUND, 1.0))
