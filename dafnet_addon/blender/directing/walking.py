"""A character's walk around the furniture to a seat or to a place to stand, as keys on its root."""

from collections.abc import Generator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...core.distance import scaled
from ...core.errors import InputError
from ...core.passage import Passage, SatOn, listed, met_along
from ...core.paths import BEFORE_SEAT, GETS_UP, SITS_DOWN, Route, Stop, facing
from ...core.progress import stepwise, within
from ...core.root import forward_of
from ...core.solids import Box, Mesh, Scene
from ...director.approach import Tucked, walk_to_seat
from ...director.places import before_a_top, marked_places, towards_top
from ...director.room import Piece, Room
from ...director.seats import MarkedSeat, SeatPlace, mark_of, on_a_seat, seats_of
from ...director.walks import AlreadyThere, unit_doubt, walk_to
from ..character.armature import character_scale, metres_per_unit
from ..character.settings import Settings, settings_of
from ..character.standing import standing
from ..character.walk_rows import PLACE, SEAT, Asked, Manner
from ..scene.furniture import furniture_at
from ..scene.lookup import find_collection, find_object, find_scene, object_named, require_enabled
from ..scene.marked_seats import mark, marked_on, require_markable
from .made_walks import intact_walks, note_walk, walks_kept_on_failure
from .root_keys import (
    key_route,
    keyable_root,
    last_key,
    remove_keys_from,
    restore_between,
    unchanged_on_failure,
)
from .seat_pieces import add_furniture, collection_of, movable, move, piece_of, top_of

__all__ = [
    "Beginning",
    "Start",
    "Walk",
    "extend_range",
    "rest_at",
    "start_of",
    "passage_warnings",
    "walk",
]

_BEFORE = 0.2
"""Seconds of rest before the first step."""
_READ = 0.1
"""Progress once the scene is read."""
_THERE = 0.3
"""Metres from a seat within which one sits on it already."""
_NEAR_SEAT = 1.0
"""Metres from a seat within which it is not pulled out by itself."""
_PULLED = 3
"""How often a seat is tried, being pulled out: for room on it, then for a way to it."""
_PULLS = 0.8
"""Seconds of pulling a seat out."""
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
    ``keyed``: whether that is where its keys end.
    """

    first: int
    fps: float
    unit: float
    size: float
    place: np.ndarray
    yaw: float
    scene: Scene
    keyed: bool = False

    @property
    def floor(self) -> float:
        return float(self.place[2])


@dataclass(frozen=True)
class Beginning:
    """Where a walk that is made again begins: at frame ``first``; ``pose`` (4,): place in Blender
    units and heading, None where its keys say so.
    """

    first: int
    pose: np.ndarray | None = None


def start_of(
    context: bpy.types.Context, settings: Settings, begins: Beginning | int | None = None
) -> Generator[float, None, Start]:
    """Read where a character is at a frame, None for its root's last key or else the current frame.
    A job, see ``playback.play_steps``.
    """
    scene = find_scene(settings)
    root = keyable_root(settings)
    keyed = last_key(root)
    if begins is None:
        begins = scene.frame_current if keyed is None else keyed
    if isinstance(begins, int):
        begins = Beginning(begins)
    pose = begins.pose
    if pose is None and keyed is None:
        armature = find_object(settings, settings.armature, "character")
        pose = standing(scene, armature, root, metres_per_unit(scene))

    seen: list[tuple[float, np.ndarray]] = []

    def look() -> None:
        armature = find_object(settings, settings.armature, "character")
        root = keyable_root(settings)
        require_enabled(context.evaluated_depsgraph_get(), [root])
        size = character_scale(armature, metres_per_unit(scene))
        seen.append((size, np.array([*root.location, root.rotation_euler[2]], float)))

    solids = yield from furniture_at(context, settings, begins.first, look)
    yield 1.0
    ((size, by_keys),) = seen
    pose = by_keys if pose is None else pose
    unit = metres_per_unit(scene) / size
    return Start(
        first=begins.first,
        fps=scene.render.fps / scene.render.fps_base,
        unit=unit,
        size=size,
        place=pose[:3] * unit,
        yaw=float(pose[3]),
        scene=scaled(Scene(solids), 1.0 / size),
        keyed=begins.first == keyed,
    )


def rest_at(start: Start, gets_up: float = GETS_UP) -> Generator[float, None, Stop]:
    """Where a root rests before it goes, and in how many seconds it gets up if that is a seat."""
    place = start.place[:2]
    seated = yield from on_a_seat.steps(start.scene.solids, place, start.floor)
    here = (float(place[0]), float(place[1]))
    return Stop(here, start.yaw, _BEFORE, seated=seated, gets_up=gets_up)


@dataclass(frozen=True)
class _Request:
    """What is asked for of a seat: the ``names`` of the piece's objects, that which was chosen
    first; ``place`` (2,), canonical metres: by which place on it, or where one goes if there is no
    piece; whether ``tables`` are seats; whether the piece is pulled ``out`` where something stands
    over it; in which ``manner``; its ``marked`` seats, if it says itself where one sits.
    """

    names: Sequence[str]
    place: np.ndarray
    tables: bool
    out: bool
    manner: Manner
    marked: Sequence[MarkedSeat] = ()


@dataclass(frozen=True)
class _Found:
    """A ``route``, the furniture that it leads through, ``warnings``, and by how much the seat is
    ``pulled`` (2,) out for it, canonical metres; the ``seat``, if one is sat on.
    """

    route: Route
    met: tuple[Passage, ...]
    warnings: tuple[str, ...] = ()
    pulled: np.ndarray | None = None
    seat: SeatPlace | None = None


@stepwise
def walk(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    seat: bpy.types.Object | None,
    seconds: float = 3.0,
    speed: float = 1.1,
    tables: bool = False,
    pull_out: bool = False,
    *,
    sits_down: float = SITS_DOWN,
    gets_up: float = GETS_UP,
    place: Sequence[float] | None = None,
    begins: Beginning | None = None,
    by_keys: bool = False,
    mark_seat: bool = False,
) -> Generator[float, None, Walk]:
    """Let the character walk to ``seat`` and sit there for some ``seconds``, or, for None, to the
    3D cursor and stand.

    All of the piece counts that the seat is a part of; where the cursor is on it, it says by which
    place, and to which side. ``place`` (3,): another one than the cursor's, in the world, or in the
    seat's own space. ``sits_down``, ``gets_up``: see ``core.paths.Stop``. The walk continues from
    the root's last key, else from the current frame; earlier keys stay. ``begins``: from there, in
    place of all later keys. The seat has to be in the character's furniture collection; where it
    has none, the seat's own becomes that, or a new one of all that stands around. ``pull_out``:
    move a seat that is tucked under something, or ``by_keys``, so that it comes out before the
    character is near. ``mark_seat``: keep where one sits on the piece, as glTF does.
    ``InputError``: there is nothing to sit on, no way, no room before the seat, or the root cannot
    be keyed. Then, or if the job is closed, nothing is changed.
    """
    scene, furniture = context.scene, armature.dafnet.furniture
    made = None
    if seat is not None and furniture is None:
        furniture = collection_of(seat, armature, scene)
        if furniture is None:
            furniture = add_furniture(seat, armature, scene)
            made = furniture.name_full
    asked = Asked(
        kind=PLACE if seat is None else SEAT,
        manner=Manner(speed, seconds, sits_down, gets_up),
        goal=seat.name_full if seat else "",
        place=_asked_place(scene, seat, place),
        tables=tables,
        pull_out=pull_out,
        by_keys=by_keys,
    )
    try:
        job = _walk(context, armature, asked, furniture, made, begins, mark_seat)
        return (yield from job)
    except BaseException:
        added = next((c for c in bpy.data.collections if c.name_full == made), None)
        if added is not None:
            bpy.data.collections.remove(added)
        raise


def _asked_place(
    scene: bpy.types.Scene, seat: bpy.types.Object | None, place: Sequence[float] | None
) -> tuple[float, float, float]:
    """Where one goes, in the world, or where on the seat, in its own space."""
    if place is None:
        there = scene.cursor.location
        place = seat.matrix_world.inverted_safe() @ there if seat else there
    return (float(place[0]), float(place[1]), float(place[2]))


def _walk(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    asked: Asked,
    furniture: bpy.types.Collection | None,
    made: str | None,
    begins: Beginning | None,
    mark_seat: bool,
) -> Generator[float, None, Walk]:
    scene = context.scene
    settings = settings_of(armature, scene, furniture=furniture.name_full if furniture else None)
    seat = object_named(scene, asked.goal)
    names = piece_of(seat) if seat is not None else []
    goal = Vector(asked.place or (0.0, 0.0, 0.0))
    goal = seat.matrix_world @ goal if seat is not None else goal
    if asked.pull_out and seat is not None:
        movable(top_of(seat))
    if mark_seat and seat is not None:
        require_markable(seat)

    start = yield from within(start_of(context, settings, begins), 0.0, _READ)
    place = np.array(goal[:2], float) * start.unit
    objects = [each for each in scene.objects if each.name in names]
    marked = marked_on(objects, start.unit)
    request = _Request(names, place, asked.tables, asked.pull_out, asked.manner, marked)
    found = yield from within(_route(start, request), _READ, 1.0)

    root = keyable_root(settings)
    character = find_object(settings, settings.armature, "character")
    own = find_collection(settings.furniture) if settings.furniture is not None else None
    route, warnings = found.route, found.warnings
    intact, last = intact_walks(character), start.first + len(route.path) - 1
    piece = scene.objects[names[0]] if names else None
    top = top_of(piece) if piece is not None and found.pulled is not None else None
    with ExitStack() as undo:
        undo.enter_context(walks_kept_on_failure(scene, character))
        for each in filter(None, (root, top)):
            undo.enter_context(unchanged_on_failure(each))
        kept = remove_keys_from(root, start.first) if begins is not None else {}
        key_route(context, root, route, first=start.first, scale=1.0 / start.unit, fps=start.fps)
        restore_between(root, kept)
        note_walk(scene, character, asked, first=start.first, last=last, intact=intact)

        # Once a piece is moved, Blender does not know yet where its parts are.
        frame = piece.matrix_world.copy() if piece is not None else Matrix()
        if top is not None and found.pulled is not None:
            offset = found.pulled / start.unit
            move(top, offset, _free_to_move(start, found) if asked.by_keys else None)
            frame = Matrix.Translation(Vector((*offset.tolist(), 0.0))) @ frame
            out = 100.0 * start.size * float(np.linalg.norm(found.pulled))
            warnings = (f"Pulled '{top.name}' out by {out:.0f} cm.", *warnings)
        if made is not None:
            scene.collection.children.link(own)
        if mark_seat and piece is not None and found.seat is not None:
            sat_on = mark_of(found.seat, start.floor).resized(start.size)
            mark(piece, sat_on, metres_per_unit(scene), frame)
        character.dafnet.furniture = own
        extended = extend_range(scene, character, last)

    warnings = (*passage_warnings(found.met, start.first), *warnings)
    return Walk(start.first, last, extended, warnings)


def _free_to_move(start: Start, found: _Found) -> tuple[int, int]:
    """The frames between which a seat is pulled out: the last in which nobody is near it yet."""
    assert found.seat is not None and found.pulled is not None
    path = found.route.path.position[:, :2]
    places = (found.seat.position, found.seat.position - found.pulled)
    gaps = [np.linalg.norm(path - place, axis=1) for place in places]
    near = np.flatnonzero(np.min(gaps, axis=0) < _NEAR_SEAT)
    last = max(int(near[0]) - 1, 1)
    return start.first + max(0, last - round(_PULLS * start.fps)), start.first + last


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


def _route(start: Start, asked: _Request) -> Generator[float, None, _Found]:
    """The walk in metres of the canonical body to the seat that is wished for, or where none is, to
    the place.
    """
    here = yield from within(rest_at(start, asked.manner.gets_up), 0.0, 0.05)
    if asked.names:
        return (yield from within(_route_to_seat(start, here, asked), 0.05, 1.0))

    solids, floor, size, goal = start.scene.solids, start.floor, start.size, asked.place
    manner = asked.manner
    end = Stop((float(goal[0]), float(goal[1])), facing(goal - start.place[:2]), manner.seconds)
    way = walk_to.steps(solids, here, end, manner.speed, start.fps, floor, size)
    try:
        route = yield from within(way, 0.05, 0.6)
    except AlreadyThere as error:
        raise _there_already(start, error) from error

    met = met_along.steps(start.scene, route.path, start.fps, end=())
    passages = yield from within(met, 0.6, 0.95)
    doubt = yield from within(
        unit_doubt.steps(solids, route.path.position[:, :2], floor, size), 0.95, 1.0
    )
    return _Found(route, passages, (doubt,) if doubt else ())


def _there_already(start: Start, error: AlreadyThere) -> InputError:
    """What is said where a walk would end where it begins: which frame that is, since the character
    may be elsewhere in the one that is shown.
    """
    if not start.keyed:
        return error
    return InputError(
        f"The root's keys end there already, at frame {start.first}, and a walk goes on from them; "
        "press Redo Walk to make the last one anew, or choose another place."
    )


def _route_to_seat(start: Start, here: Stop, asked: _Request) -> Generator[float, None, _Found]:
    """The walk from ``here`` to the seat. ``InputError`` where something stands before it, or where
    a body would be.
    """
    name, manner = asked.names[0], asked.manner
    parts = tuple(solid for solid in start.scene.solids if solid.name in asked.names)
    if not parts:
        raise InputError(f"'{name}' is not in the character's furniture collection; move it there.")

    room = _room_of(start.scene.solids, start.floor, asked.names)
    whole, chosen = room.pieces()[name], [s for s in parts if s.name == name]
    near = _place_on(whole, asked.place)
    if near is None and len({solid.name for solid in parts}) > 1 and chosen:
        near = Piece(name, tuple(chosen)).box().mean(axis=0)[:2]
    seats, done = marked_places(asked.marked, start.place[:2], near), 0.15
    if not seats:
        place = start.place[:2]
        job = seats_of.steps(parts, place, start.floor, name, near, start.size, asked.tables)
        seats = yield from within(job, 0.0, 0.1)
    if near is None and not seats[0].back:
        top = yield from within(before_a_top(room, whole, seats[0]), 0.1, 0.12)
        if top is not None:
            job = seats_of.steps(parts, top, start.floor, name, near, start.size, asked.tables)
            seats = towards_top((yield from within(job, 0.12, 0.15)), top)

    if here.seated and np.linalg.norm(seats[0].position - here.position) < _THERE:
        sits = AlreadyThere(f"The character sits on '{name}' already; choose another seat.")
        raise _there_already(start, sits)

    pulled: np.ndarray | None = None
    for left in reversed(range(_PULLED)):
        goes = walk_to_seat.steps(
            room,
            whole,
            here,
            seats,
            seconds=manner.seconds,
            speed=manner.speed,
            fps=start.fps,
            size=start.size,
            sits_down=manner.sits_down,
        )
        try:
            route, spot = yield from within(goes, done, done + 0.2)
            break
        except Tucked as error:
            if not asked.out or not left:
                raise
            done = 0.35
            farther = -error.out * forward_of(seats[0].yaw)
            pulled = farther if pulled is None else pulled + farther
            solids = _pulled_out(room.solids, whole, farther)
            room = _room_of(solids, start.floor, asked.names)
            whole = room.pieces()[name]
            seats = [replace(seats[0], position=seats[0].position + farther)]

    scene = Scene(tuple(room.solids))
    sat_on = SatOn(spot.position, spot.height, frozenset(asked.names))
    met = met_along.steps(scene, route.path, start.fps, [sat_on])
    passages = yield from within(met, 0.6, 1.0)

    gap = np.linalg.norm(route.path.position[:, :2] - spot.position, axis=1)
    far = np.flatnonzero(gap > _SITTING_DOWN)
    sits_down_after = int(far[-1]) if len(far) else 0
    for each in passages:
        if each.stop - 1 > sits_down_after and each.name not in asked.names:
            raise InputError(
                f"'{each.name}' is in the way of sitting down on '{name}'; pull '{name}' out, or "
                "choose another seat."
            )

    return _Found(route, passages, pulled=pulled, seat=spot)


def _place_on(piece: Piece, cursor: np.ndarray) -> np.ndarray | None:
    """The cursor (2,), if it is on a piece seen from above."""
    low, high = piece.box()[:, :2]
    return cursor if ((cursor >= low) & (cursor <= high)).all() else None


def _room_of(solids: Sequence[Box | Mesh], floor: float, names: Sequence[str]) -> Room:
    """The room, in which all objects of these names are one piece, that of the first."""
    return Room(tuple(solids), parts=dict.fromkeys(names, names[0]), floor=floor)


def _pulled_out(solids: Sequence[Box | Mesh], piece: Piece, offset: np.ndarray) -> list[Box | Mesh]:
    """The solids with those of a piece moved by an offset (2,)."""
    shift = np.eye(4)
    shift[:2, 3] = offset
    own = {id(solid) for solid in piece.solids}
    return [
        replace(solid, matrix=shift @ solid.matrix)
        if isinstance(solid, Mesh) and id(solid) in own
        else solid
        for solid in solids
    ]
