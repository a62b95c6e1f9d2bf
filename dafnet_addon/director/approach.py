"""How one comes to a seat, and leaves it: whether a body fits there among what stands around it,
and from which side: straight, or round the desk before it.

Canonical metres, world.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.errors import InputError
from ..core.paths import BEFORE_SEAT, SITS_DOWN, Route, Stop, route
from ..core.progress import stepwise, within
from ..core.root import RootPath, forward_of
from ..core.series import MODEL_FPS
from ..core.softness import kind_by_name
from ..core.solids import Box, Mesh
from .places import has_room
from .room import Piece, Room
from .seats import SeatPlace
from .surfaces import surface_points
from .walks import ways

__all__ = ["Tucked", "WayIn", "fits", "pair", "walk_to_seat", "way_in"]

_ROUND_SEAT = 1.6
"""Metres around a seat in which anything may be in the way."""
_SPACING = 0.04
"""Metres between points of what may be."""

# The body on its seat: metres ahead of the pelvis, to each side, and over the seat, which it needs.
_TRUNK = ((-0.10, 0.13), 0.17, (0.10, 0.80))
_THIGHS = ((0.00, 0.40), 0.13, (0.02, 0.11))
_OWN_PARTS = 0.60
"""Metres from the pelvis, within which its seat's back and arms are."""
_TOUCHES = 0.02
"""Metres by which it gives way."""
_SHIN = 0.08
"""Metres that shins need before the knees."""
_KNEES = 0.36
"""Metres from the pelvis to the hollows of the knees."""
_SHIN_LOW = 0.15
"""Metres over the floor; what is lower, feet rest on."""

# On the way to it.
_STANDS = (0.12, 1.36)
"""Metres over the floor, in which one who walks meets furniture."""
_HANGS = 1.0
"""Metres over the floor; what has nothing that is lower hangs."""
_SITS_DOWN = 0.55
"""Metres from a seat within which legs may be under a table."""
_BY_OTHERS = 0.52
"""Metres from others' roots."""
_BESIDE_ARMS = 0.10
"""Metres to each side of the axis, that a seat's own arms leave free."""
_LAP_HIGH = 0.15
"""Metres over the seat, that are met there."""
_SLIM = 0.13
"""Metres to each side of the body's axis which are free, at least."""
_CLEAR = 0.18
"""Metres to each side with which no other way is looked for."""
_FRONT = 0.85
"""Metres before a seat, from which one comes straight."""
_SIDE = 0.70
"""Metres to the side of a seat, from which one comes round a desk before it."""
_LANE = (0.60, 0.48)
"""Metres before a seat, of lanes along which one comes between it and what stands before it."""
_BEFORE = (BEFORE_SEAT, 0.40, 0.28, 0.20)
"""Metres before a seat, to which one comes from the side."""
_OWN = 0.30
"""Metres from the pelvis within which the parts of a seat are, unlike its neighbours."""
_ROOM_AHEAD = 0.34
"""Metres before the pelvis, that are free once a seat is pulled out."""
_FARTHEST_OUT = 0.8
"""Metres by which a seat is pulled out, at most."""
_NUDGE = 0.05
"""Metres by which it is pulled out farther until one can come to it."""
_TRIED = 4
"""Places on a seat that are tried, one after another."""


def pair(point: np.ndarray | Sequence[float]) -> tuple[float, float]:
    """A point (2 or more) as a stop takes it."""
    return float(point[0]), float(point[1])


class Tucked(InputError):
    """Something stands where a body would be on its seat; ``out``: metres by which the seat has to
    be pulled out, away from where it faces.
    """

    def __init__(self, message: str, out: float) -> None:
        super().__init__(message)
        self.out = out


@dataclass(frozen=True)
class WayIn:
    """How one comes to a seat: by points ``via`` (2,), none where one comes straight; to ``before``
    metres in front of it.
    """

    via: tuple[np.ndarray, ...] = ()
    before: float = BEFORE_SEAT


@dataclass(frozen=True)
class _Around:
    """Surface points (N, 3) of what stands around a seat, by name, and of its ``own`` arms and
    back; z over the floor.
    """

    names: tuple[str, ...]
    points: tuple[np.ndarray, ...]
    own: np.ndarray

    def within(
        self, seat: SeatPlace, ahead: tuple[float, float], half: float, high: tuple[float, float]
    ) -> list[tuple[str, float]]:
        """The names of what is in a box before a seat, and how many metres ahead its nearest point
        is.
        """
        forward = forward_of(seat.yaw)
        across = np.array([forward[1], -forward[0]])
        found = []
        for name, points in zip(self.names, self.points, strict=True):
            offset = points[:, :2] - seat.position
            along, aside = offset @ forward, np.abs(offset @ across)
            inside = (along > ahead[0]) & (along < ahead[1] - _TOUCHES) & (aside < half)
            inside &= (points[:, 2] > high[0]) & (points[:, 2] < high[1])
            if inside.sum() > 1:
                found.append((name, float(along[inside].min())))
        return found

    def hangs(self, name: str, seat: SeatPlace) -> bool:
        """Whether all that something has around a seat is higher than who sits there."""
        points = self.points[self.names.index(name)]
        near = np.linalg.norm(points[:, :2] - seat.position, axis=1) < _FRONT
        return bool(near.any()) and float(points[near, 2].min()) > _HANGS


def _around(
    room: Room, name: str, own: Sequence[Box | Mesh], seat: SeatPlace
) -> Generator[float, None, _Around]:
    """What stands around a seat of the piece ``name``, besides the parts of it, which are among the
    ``own`` solids of that.
    """
    low, high = seat.position - _ROUND_SEAT, seat.position + _ROUND_SEAT
    names, found = [], []
    surfaces = dict((yield from room.surfaces((low, high))))
    whole = surfaces.pop(name, np.zeros((0, 3)))
    surfaces[name] = whole[_beyond(whole, seat)]
    top, arms = seat.height - room.floor, whole - (0.0, 0.0, room.floor)
    arms = arms[(arms[:, 2] > top + _LAP_HIGH) & (arms[:, 2] < top + _TRUNK[2][1])]
    for solid in own if len(own) > 1 else ():
        if not _carries(solid, seat):
            surfaces[solid.name] = surface_points([solid], _SPACING, (low, high))
    for each, points in surfaces.items():
        near = ((points[:, :2] > low) & (points[:, :2] < high)).all(axis=1)
        near &= (points[:, 2] > room.floor + _STANDS[0]) & (points[:, 2] < room.floor + 2.0)
        if near.any():
            names.append(each)
            found.append(points[near] - (0.0, 0.0, room.floor))
        yield 1.0
    return _Around(tuple(names), tuple(found), arms)


def _beyond(points: np.ndarray, seat: SeatPlace) -> np.ndarray:
    """Which surface points (N, 3) of a piece are not of the seat itself, but of what else it has:
    before the edge and higher than the seat, or farther from it than its own parts.
    """
    offset = points[:, :2] - seat.position
    before = (offset @ forward_of(seat.yaw) > seat.edge + 0.05) & (
        points[:, 2] > seat.height + 0.02
    )
    return np.asarray(before | (np.linalg.norm(offset, axis=1) > _OWN_PARTS))


def _carries(solid: Box | Mesh, seat: SeatPlace) -> bool:
    """Whether a solid of a piece belongs to the seat itself, and not to another seat or a table of
    the same piece.
    """
    low, high = Piece(solid.name, (solid,)).box()[:, :2]
    gap = np.maximum(np.maximum(low - seat.position, seat.position - high), 0.0)
    return float(np.linalg.norm(gap)) < _OWN and kind_by_name(solid.name) not in ("table", "desk")


def _barred(around: _Around, seat: SeatPlace, floor: float) -> list[tuple[float, str]]:
    """By how many metres what is where a body would be on a seat is too near, and its name."""
    top = seat.height - floor
    knees = max(_KNEES, seat.edge)
    boxes = (
        (_TRUNK[0], _TRUNK[1], (top + _TRUNK[2][0], top + _TRUNK[2][1])),
        (_THIGHS[0], _THIGHS[1], (top + _THIGHS[2][0], top + _THIGHS[2][1])),
        ((knees, knees + _SHIN), _THIGHS[1], (_SHIN_LOW, top)),
    )
    return [
        (max(ahead[1], _ROOM_AHEAD) - nearest, each)
        for ahead, half, high in boxes
        for each, nearest in around.within(seat, ahead, half, high)
    ]


def _pulled(seat: SeatPlace, out: float) -> SeatPlace:
    """A seat that is pulled out by so many metres."""
    return replace(seat, position=seat.position - out * forward_of(seat.yaw))


def _fits(around: _Around, seat: SeatPlace, name: str, floor: float) -> None:
    """Raises Tucked where a body on a seat of the piece ``name`` would be in something else."""
    barred = _barred(around, seat, floor)
    if not barred:
        return
    out, what = max(barred)
    lap = seat.height - floor + _LAP_HIGH, _STANDS[1]
    before = around.within(seat, (_TRUNK[0][0], _ROOM_AHEAD), _TRUNK[1], lap)
    out = max([out, *(_ROOM_AHEAD - nearest for _, nearest in before)]) + _TOUCHES
    if out > _FARTHEST_OUT or _barred(around, _pulled(seat, out), floor):
        raise InputError(
            f"'{what}' leaves no room for a body on '{name}'; choose another seat, or move it."
        )
    raise _tucked(what, name, out)


def _no_place(name: str) -> InputError:
    return InputError(
        f"Parts of '{name}' itself are in the way of sitting there; choose another place on it "
        "with the 3D cursor, or another seat."
    )


def _tucked(what: str, name: str, out: float) -> InputError:
    if what == name:
        return _no_place(name)
    return Tucked(
        f"'{what}' stands where one would sit on '{name}'; pull '{name}' out by "
        f"{100.0 * out:.0f} cm, or choose another seat.",
        out,
    )


@stepwise
def fits(
    room: Room, name: str, own: Sequence[Box | Mesh], seat: SeatPlace
) -> Generator[float, None, None]:
    """Raises Tucked where a body has no room on a ``seat`` of the piece ``name``, made of its
    ``own`` solids, and InputError where it never has.
    """
    around = yield from _around(room, name, own, seat)
    _fits(around, seat, name, room.floor)


@stepwise
def way_in(
    room: Room,
    name: str,
    own: Sequence[Box | Mesh],
    seat: SeatPlace,
    standing: Sequence[Box] = (),
) -> Generator[float, None, WayIn]:
    """How one comes to a ``seat`` of the piece ``name``, made of its ``own`` solids; where it can
    be, not past those who are ``standing`` or sitting there. Raises Tucked where there is no room
    for a body, and InputError where all ways are barred.
    """
    around = yield from within(_around(room, name, own, seat), 0.0, 0.4)
    _fits(around, seat, name, room.floor)
    others = np.array([box.center[:2] for box in standing]).reshape(-1, 2)
    return (yield from within(_ways_in(room, name, seat, around, others), 0.4, 1.0))


def _open_ways(room: Room, seat: SeatPlace) -> Generator[float, None, list[WayIn]]:
    """The ways to a seat that there may be: straight, then those from its sides, where one stands
    free.
    """
    ahead = forward_of(seat.yaw)
    across = np.array([ahead[1], -ahead[0]])
    beside = [
        WayIn((seat.position + front * ahead + side * across,), before)
        for front, befores in ((0.0, _BEFORE), *((lane, (lane,)) for lane in _LANE))
        for before in befores
        for side in (_SIDE, -_SIDE)
    ]
    spots = np.array([way.via[0] for way in beside])
    stands = yield from within(has_room(room, spots, 0.2), 0.0, 0.0)
    return [WayIn(), *(way for way, free in zip(beside, stands, strict=True) if free)]


def _coming(seat: SeatPlace, way: WayIn) -> RootPath:
    """The last of a way to a seat."""
    goal = Stop(pair(seat.position), seat.yaw, 0.0, seated=True, before=way.before)
    begin = way.via[0] if way.via else seat.position + _FRONT * forward_of(seat.yaw)
    return route(Stop(pair(begin), seat.yaw, 0.0), goal).path


def _ways_in(
    room: Room, name: str, seat: SeatPlace, around: _Around, others: np.ndarray
) -> Generator[float, None, WayIn]:
    options = yield from _open_ways(room, seat)
    best, widest, by_nobody, blocker = None, 0.0, False, ""
    for option in options:
        path = _coming(seat, option)
        gap, what = _gap(around, path, seat, room.floor)
        yield 0.5
        if option.via and _over_arms(around, path, seat):
            continue
        alone = all(
            float(np.linalg.norm(path.position[:, :2] - other, axis=1).min()) >= _BY_OTHERS
            for other in others
        )
        if gap >= _CLEAR and alone and not option.via:
            return option
        clear = min(gap, _CLEAR)
        if gap >= _SLIM and (alone, clear) > (by_nobody, widest):
            best, widest, by_nobody = option, clear, alone
        blocker = blocker or what

    if best is None:
        raise (yield from within(_barred_ways(room, name, seat, around, blocker), 0.9, 1.0))
    return best


def _barred_ways(
    room: Room, name: str, seat: SeatPlace, around: _Around, blocker: str
) -> Generator[float, None, InputError]:
    """What is said where no way to a seat is free: by how much it has to be pulled out for one, if
    that helps.
    """
    if blocker == name:
        return _no_place(name)
    ahead, lap = forward_of(seat.yaw), seat.height - room.floor + _LAP_HIGH
    before = around.within(seat, (0.0, _ROOM_AHEAD), _TRUNK[1], (lap, _STANDS[1]))
    least = [_ROOM_AHEAD - nearest + _TOUCHES for _, nearest in before]
    for out in (*least, *np.arange(_NUDGE, _FARTHEST_OUT, _NUDGE)):
        moved = _pulled(seat, float(out))
        then = replace(around, own=around.own - (*(float(out) * ahead), 0.0))
        for way in (yield from _open_ways(room, moved)):
            path = _coming(moved, way)
            free = _gap(then, path, moved, room.floor)[0] >= _SLIM
            if free and not _barred(then, moved, room.floor) and not _over_arms(then, path, moved):
                return _tucked(blocker, name, float(out))

    if around.hangs(blocker, seat):
        return InputError(
            f"'{blocker}' is too low to stand under where one comes to sit on '{name}'; choose "
            "another seat."
        )
    return InputError(
        f"'{blocker}' stands where one comes to sit on '{name}'; choose another seat."
    )


def _gap(around: _Around, path: RootPath, seat: SeatPlace, floor: float) -> tuple[float, str]:
    """The least metres between a body's axis and what stands around, along a path to a seat, of
    those that matter, and what that is.
    """
    places = path.position[::2, :2]
    sitting = np.linalg.norm(places - seat.position, axis=1) < _SITS_DOWN
    lap = seat.height - floor + _LAP_HIGH
    ways = [
        (some, low, some.min(axis=0) - _CLEAR, some.max(axis=0) + _CLEAR)
        for some, low in ((places[~sitting], _STANDS[0]), (places[sitting], lap))
        if len(some)
    ]
    least, what = _CLEAR, ""
    for name, points in zip(around.names, around.points, strict=True):
        for some, low, first, last in ways:
            met = (points[:, 2] > low) & (points[:, 2] < max(_STANDS[1], low + 0.5))
            met &= ((points[:, :2] > first) & (points[:, :2] < last)).all(axis=1)
            beside = points[met, :2]
            if not len(beside):
                continue
            gap = min(float(((beside - at) ** 2).sum(axis=1).min()) for at in some) ** 0.5
            if gap < least:
                least, what = gap, name
    return least, what


def _over_arms(around: _Around, path: RootPath, seat: SeatPlace) -> bool:
    """Whether a way to a seat leads over its own arms or back."""
    if not len(around.own):
        return False
    away = np.linalg.norm(path.position[:, :2] - seat.position, axis=1)
    coming = path.position[(away > 0.15) & (away < _ROUND_SEAT), :2][::2]
    return any(
        float(((around.own[:, :2] - at) ** 2).sum(axis=1).min()) < _BESIDE_ARMS**2 for at in coming
    )


@stepwise
def walk_to_seat(
    room: Room,
    piece: Piece,
    start: Stop,
    seats: Sequence[SeatPlace],
    seconds: float = 3.0,
    speed: float = 1.1,
    fps: float = MODEL_FPS,
    size: float = 1.0,
    sits_down: float = SITS_DOWN,
) -> Generator[float, None, tuple[Route, SeatPlace]]:
    """The root path from rest at ``start`` to rest on the first of the ``seats`` of a piece that a
    body fits on and that one can come to, round the furniture; and which it is.

    Raises what bars the first of them. ``size``: see ``walks.way_round``; ``sits_down``: see
    ``core.paths.Stop``.
    """
    refused: InputError | None = None
    tried = seats[:_TRIED]
    for done, seat in enumerate(tried):
        goal = Stop(pair(seat.position), seat.yaw, seconds, seated=True, sits_down=sits_down)
        job = _walked(room, piece, start, seat, goal, speed, fps, size)
        try:
            return (yield from within(job, done / len(tried), (done + 1) / len(tried))), seat
        except InputError as error:
            refused = refused or error
    assert refused is not None
    raise refused


def _walked(
    room: Room,
    piece: Piece,
    start: Stop,
    seat: SeatPlace,
    goal: Stop,
    speed: float,
    fps: float,
    size: float,
) -> Generator[float, None, Route]:
    found = yield from within(way_in.steps(room, piece.name, piece.solids, seat), 0.0, 0.3)
    goal = replace(goal, before=found.before)
    out = np.array(start.position) + 0.45 * start.seated * forward_of(start.yaw)
    comes = found.via[0] if found.via else seat.position + found.before * forward_of(seat.yaw)
    job = ways.steps(room.solids, [out, comes], floor=room.floor, size=size)
    (corners,) = yield from within(job, 0.3, 1.0)
    via = [*corners, *(pair(point) for point in found.via)]
    return route(start, *_apart(via, start, goal), goal, speed=speed, fps=fps, floor=room.floor)


def _apart(
    via: Sequence[tuple[float, float]], start: Stop, goal: Stop
) -> list[tuple[float, float]]:
    """The points of a way that are not too close to one another or to its ends to bend there."""
    ends = [np.array(start.position), np.array(goal.position)]
    ends.append(ends[1] + goal.before * forward_of(goal.yaw))
    ends.append(ends[0] + 0.45 * start.seated * forward_of(start.yaw))
    kept: list[np.ndarray] = []
    for each in map(np.array, via):
        if all(np.linalg.norm(each - other) > 0.12 for other in (*kept[-1:], *ends)):
            kept.append(each)
    return [pair(each) for each in kept]
