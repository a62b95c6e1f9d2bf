"""Keys on a character's root from what the animator has already: a drawn curve, something that
moves, points on the floor.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.distance import scaled
from ..core.errors import InputError
from ..core.passage import Passage, met_along
from ..core.paths import AFTER_SEAT, Route, Stop, facing, route
from ..core.root import forward_of
from ..core.solids import Scene
from ..core.trails import FASTEST, followed, trail
from ..director.seats import on_a_seat
from ..director.surfaces import surface_points
from ..director.walks import around, way_round
from .armature import character_scale, is_character, metres_per_unit, parts_of, sent
from .compat import action_curves
from .dependencies import Dependencies
from .furniture import furniture_at
from .playback import frame_kept, in_order
from .root_keys import MOVES, keyable_root, keyed_along, last_key, unchanged_on_failure
from .settings import settings_of
from .walking import Walk, extended_to, told_of, walk

__all__ = [
    "along_curve",
    "as_moved",
    "chosen",
    "floor_points",
    "is_curve",
    "may_move",
    "places_of",
    "through_points",
]

_BEFORE = 0.2  # seconds of rest before the first step
_SPACING = 0.05  # metres between points on the furniture
_THERE = 0.1  # metres between a root and the line's beginning that need no walk


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


def chosen(
    context: bpy.types.Context, fits: Callable[[bpy.types.Object], bool]
) -> tuple[bpy.types.Object | None, bpy.types.Object | None]:
    """The character to direct (``armature.sent``), and the active or else the only selected other
    object that ``fits``.
    """
    character = sent(context)[0]
    if character is None:
        return None, None
    parts = parts_of(character)
    others = [o for o in context.selected_objects if o not in parts and fits(o)]
    active = context.object
    return character, active if active in others else others[0] if len(others) == 1 else None


def floor_points(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The selected empties that are not part of a character, in the order of their names; 10 comes
    after 9.
    """
    characters = [o for o in context.scene.objects if is_character(o)]
    parts = {part for character in characters for part in parts_of(character)}
    found = [o for o in context.selected_objects if o.type == "EMPTY" and o not in parts]
    return sorted(
        found,
        key=lambda o: [
            (not t.isdigit(), int(t) if t.isdigit() else 0, t.lower())
            for t in re.split(r"(\d+)", o.name)
        ],
    )


@dataclass(frozen=True)
class _Directed:
    """The character's ``root`` in the scene, its ``place`` (3,) and ``yaw`` at frame ``first`` and
    the furniture then, in canonical metres, of which a Blender unit is ``unit``; the character's
    ``size`` over the canonical one.
    """

    root: bpy.types.Object
    first: int
    unit: float
    size: float
    fps: float
    place: np.ndarray
    yaw: float
    solids: Scene

    @property
    def floor(self) -> float:
        return float(self.place[2])

    def start(self) -> Stop:
        """Where the root rests before it goes."""
        seated = on_a_seat(self.solids.solids, self.place[:2], self.floor)
        return Stop((float(self.place[0]), float(self.place[1])), self.yaw, _BEFORE, seated=seated)


def _directed(
    context: bpy.types.Context, armature: bpy.types.Object, first: int | None = None
) -> _Directed:
    """At frame ``first``, None for the root's last key or else the current frame. The scene's frame
    is as before.
    """
    scene = context.scene
    settings = settings_of(armature, scene)
    root = keyable_root(settings)
    fps, size = (
        scene.render.fps / scene.render.fps_base,
        character_scale(armature, metres_per_unit(scene)),
    )
    unit = metres_per_unit(scene) / size
    if first is None:
        keyed = last_key(root)
        first = scene.frame_current if keyed is None else keyed
    with frame_kept(scene):
        meshes = [
            mesh for found in furniture_at(context, settings, first).values() for mesh in found
        ]
        place, yaw = np.array(root.location, float) * unit, float(root.rotation_euler[2])
    return _Directed(
        root, first, unit, size, fps, place, yaw, scaled(Scene(tuple(meshes)), 1.0 / size)
    )


def _written(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    directed: _Directed,
    walked: Route,
    met: Sequence[Passage],
    *warnings: str,
) -> Walk:
    """Key a route over what the root has from its first frame on, and tell what is ``met``; before
    that it moves as it did.
    """
    root, first = directed.root, directed.first
    with unchanged_on_failure(root):
        kept = _cut(root, first)
        keyed_along(context, root, walked, first=first, scale=1.0 / directed.unit, fps=directed.fps)
        for curve in action_curves(root):
            for frame, value in kept.get((curve.data_path, curve.array_index), []):
                if abs(curve.evaluate(frame) - value) > 1e-5:
                    curve.keyframe_points.insert(frame, value).interpolation = "LINEAR"
            curve.update()
    last_frame = first + len(walked.path) - 1
    return Walk(
        first,
        last_frame,
        extended_to(context.scene, armature, last_frame),
        (*told_of(met, first), *warnings),
    )


def _cut(root: bpy.types.Object, first: int) -> dict[tuple[str, int], list[tuple[int, float]]]:
    """Remove a root's keys from frame ``first`` on; returns by curve the values of the frames after
    the last key that stays.
    """
    kept: dict[tuple[str, int], list[tuple[int, float]]] = {}
    for curve in action_curves(root):
        if curve.data_path not in MOVES:
            continue
        earlier = [point for point in curve.keyframe_points if point.co[0] < first]
        if earlier:
            last = earlier[-1]
            # else the next key would bend what leads to this one
            last.handle_left_type = last.handle_right_type = "FREE"
            between = range(int(np.floor(last.co[0])) + 1, first)
            kept[curve.data_path, curve.array_index] = [
                (frame, curve.evaluate(frame)) for frame in between
            ]
        for k in reversed(
            [k for k, point in enumerate(curve.keyframe_points) if point.co[0] >= first]
        ):
            curve.keyframe_points.remove(curve.keyframe_points[k], fast=True)
        curve.update()
    return kept


def _line_of(context: bpy.types.Context, curve: bpy.types.Object) -> np.ndarray:
    """The longest line (N, 3) of a curve as the scene evaluates it, world, Blender units."""
    if curve.type != "CURVE":
        raise InputError(f"'{curve.name}' is not a curve; select a Bezier, poly or NURBS curve.")
    evaluated = curve.evaluated_get(context.evaluated_depsgraph_get())
    lines = _lines(evaluated)
    if not lines:  # it has a bevel or another surface: the bare line, without its modifiers
        bare = bpy.data.objects.new(curve.name, curve.data.copy())
        data = bare.data
        try:
            data.bevel_mode, data.bevel_depth, data.extrude, data.bevel_object, data.dimensions = (
                "ROUND",
                0.0,
                0.0,
                None,
                "3D",
            )
            lines = _lines(bare)
        finally:
            bpy.data.objects.remove(bare)
            bpy.data.curves.remove(data)
    matrix = np.array(evaluated.matrix_world, float)
    world = [line @ matrix[:3, :3].T + matrix[:3, 3] for line in lines]
    if not world:
        raise InputError(f"The curve '{curve.name}' has no line; draw one on the floor.")
    return max(world, key=lambda line: float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()))


def _lines(owner: bpy.types.Object) -> list[np.ndarray]:
    """The chains of edges (N, 3) that a curve is drawn with, in its own space; none where it has
    faces.
    """
    mesh = owner.to_mesh()
    try:
        if mesh is None or len(mesh.polygons) or not len(mesh.edges):
            return []
        flat, edges = np.empty(3 * len(mesh.vertices)), np.empty(2 * len(mesh.edges), int)
        mesh.vertices.foreach_get("co", flat)
        mesh.edges.foreach_get("vertices", edges)
    finally:
        owner.to_mesh_clear()
    points, pairs = (
        flat.reshape(-1, 3),
        {tuple(sorted(pair)) for pair in edges.reshape(-1, 2).tolist()},
    )
    lines, start = [], 0
    for k in range(1, len(points) + 1):
        if k == len(points) or (k - 1, k) not in pairs:
            closed = (start, k - 1) in pairs and k - start > 2
            lines.append(points[[*range(start, k), *([start] if closed else [])]])
            start = k
    return [line for line in lines if len(line) > 1]


def along_curve(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    curve: bpy.types.Object,
    *,
    speed: float = 1.1,
    seconds: float = 1.0,
    keep_facing: bool = False,
    backwards: bool = False,
) -> Walk:
    """Let the character walk along a curve from the current frame on, and stand at its end for some
    ``seconds``.

    Where the root has keys before that, it goes from where it is to the curve first; else the walk
    begins on the curve. Later keys are replaced. ``keep_facing``: it looks where it looks now all
    the way. ``backwards``: from the curve's end. ``InputError``: no curve, too short, or the root
    cannot be keyed; nothing is changed then.
    """
    line = _line_of(context, curve)[:: -1 if backwards else 1]
    at = _directed(context, armature, context.scene.frame_current)
    points = line[:, :2] * at.unit
    keys = [
        p.co[0] for c in action_curves(at.root) if c.data_path in MOVES for p in c.keyframe_points
    ]
    away = float(np.linalg.norm(points[0] - at.place[:2]))
    start = at.start() if away < _THERE or (keys and min(keys) < at.first) else None
    if start is not None and away >= _THERE:
        points = np.concatenate([_way(at, start, [points[0]])[:-1], points])
    walked = trail(
        points,
        start,
        speed=speed,
        fps=at.fps,
        floor=at.floor,
        yaw=at.yaw if keep_facing else None,
        seconds=seconds,
        name=f"curve '{curve.name}'",
    )
    return _written(
        context, armature, at, walked, met_along(at.solids, walked.path, at.fps, end=())
    )


def _way(at: _Directed, start: Stop, goals: list[np.ndarray]) -> np.ndarray:
    """Corners (N, 2) of the way round the furniture from ``start`` through the places ``goals``
    (2,), with these.
    """
    forward = forward_of(start.yaw)
    here, corners = np.array(start.position) + (AFTER_SEAT if start.seated else 0.0) * forward, []
    points = surface_points(at.solids.solids, _SPACING, around([here, *goals])) - np.array(
        [0.0, 0.0, at.floor]
    )
    for goal in goals:
        corners += [*(np.array(corner) for corner in way_round(points, here, goal, at.size)), goal]
        here = goal
    return np.array(corners)


def places_of(
    context: bpy.types.Context, source: bpy.types.Object, frames: Sequence[int]
) -> np.ndarray:
    """Where an object is in some rising frames (N, 3), world, Blender units; the current frame
    stays.
    """
    places = {}
    with frame_kept(context.scene):
        for frame in in_order(
            frames, Dependencies(context.scene).simulations([source], shaped=False)
        ):
            context.scene.frame_set(frame)
            places[frame] = tuple(
                source.evaluated_get(context.evaluated_depsgraph_get()).matrix_world.translation
            )
    return np.array([places[frame] for frame in frames], float)


def as_moved(
    context: bpy.types.Context, armature: bpy.types.Object, source: bpy.types.Object
) -> Walk:
    """Let the root go where ``source`` goes over the floor, at the same frames: those of its keys,
    else of the scene's range.

    The root's keys from there on are replaced. ``InputError``: it hardly moves, or the root cannot
    be keyed; nothing is changed then.
    """
    scene = context.scene
    keys = [
        p.co[0]
        for c in action_curves(source)
        if c.data_path == "location"
        for p in c.keyframe_points
    ]
    first, last = (
        (int(np.floor(min(keys))), int(np.ceil(max(keys))))
        if keys
        else (scene.frame_start, scene.frame_end)
    )
    at = _directed(context, armature, first)
    places = places_of(context, source, range(first, last + 1))[:, :2] * at.unit
    moved = followed(places, at.fps, at.yaw, at.floor)
    fastest = float(np.linalg.norm(np.diff(moved.path.position, axis=0), axis=1).max() * at.fps)
    hurried = (
        f"'{source.name}' moves at up to {fastest:.1f} m/s, faster than this character can walk; "
        "slow it down."
    )
    met = met_along(at.solids, moved.path, at.fps)
    return _written(context, armature, at, moved, met, *([hurried] if fastest > FASTEST else []))


def through_points(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    points: list[bpy.types.Object],
    *,
    speed: float = 1.1,
    seconds: float = 1.0,
    to_cursor: bool = False,
) -> Walk:
    """Let the character walk through the places of ``points`` and stand at the last.

    ``to_cursor``: the 3D cursor is the last; it is the only one where there are no points. Goes on
    from the root's last key, else from the current frame, round the furniture and without rests in
    between. ``InputError``: no way, or the root cannot be keyed; nothing is changed then.
    """
    if not points:
        return walk(context, armature, None, seconds, speed)
    at = _directed(context, armature)
    spots = [point.matrix_world.translation for point in points] + [
        context.scene.cursor.location
    ] * to_cursor
    places = [np.array(spot, float)[:2] * at.unit for spot in spots]
    if len(places) > 1 and np.linalg.norm(places[0] - at.place[:2]) < 0.3:
        del places[0]  # it stands there already
    start = at.start()
    way = _way(at, start, places)
    last = way[-1] - (way[-2] if len(way) > 1 else np.array(start.position))
    via = [(float(x), float(y)) for x, y in way]
    goal = Stop(via.pop(), facing(last), seconds)
    walked = route(start, *via, goal, speed=speed, fps=at.fps, floor=at.floor)
    return _written(
        context, armature, at, walked, met_along(at.solids, walked.path, at.fps, end=())
    )
