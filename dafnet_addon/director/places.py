"""Where one sits and stands: as many as fit on a seat, beside anything, where there is room; and
how far hands reach from there.

Canonical metres, world. Several places are given in no order; whoever asks chooses.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.paths import facing
from ..core.progress import stepwise, within
from ..core.root import forward_of
from ..core.rotations import normalised
from ..core.skeleton import OFFSETS, SEAT_TO_PELVIS, STANDING_PELVIS, joint
from .room import HEAD_HIGH, KNEE_LOW, Piece, Room, top_view
from .seats import MarkedSeat, SeatPlace, seat_of

__all__ = [
    "REACH",
    "Place",
    "Surface",
    "before_a_top",
    "beside",
    "has_room",
    "known_seats",
    "marked_places",
    "seated_pelvis",
    "seats_on",
    "shoulder",
    "standing_pelvis",
    "towards_top",
]

_ELBOW_ROOM = 0.6  # metres between people on one seat or at one top
_AT_TOP = 0.8  # metres between a pelvis and the table, desk or bar that one sits at
_LOOKS_TO_TOP = 0.7  # cosine of the angle by which one looks past it, at most
_TOPS = (0.15, 0.45)  # metres over a seat, where these are
_SPACING = 0.05  # metres between points of what stands in the way
_ARM = float(np.linalg.norm(OFFSETS[[joint("left_elbow"), joint("left_wrist")]], axis=1).sum())
_LEAN = 0.19  # metres that a trunk helps a hand

REACH = _ARM + _LEAN
"""Metres from a shoulder within which a wrist comes, the trunk helping."""


@dataclass(frozen=True)
class Place:
    """Where a body stands: ``position`` (2,) of its root, and ``yaw``."""

    position: np.ndarray
    yaw: float


@dataclass(frozen=True)
class Surface:
    """What hands work on before a body: ``origin`` (3,), on a top's edge or on a board; ``low`` and
    ``high``: how far from there they may go, away from the body on a top, up on a board; metres.
    """

    origin: np.ndarray
    low: float
    high: float


def shoulder(place: Place, pelvis: float, side: float) -> np.ndarray:
    """(3,): the left (−1) or right (1) shoulder of a body that is at a place, its pelvis at a
    height.
    """
    rest = _SHOULDER * (side, 1.0, 1.0)
    ahead = forward_of(place.yaw)
    across = np.array([ahead[1], -ahead[0]])
    return np.array([*(place.position + rest[0] * across + rest[1] * ahead), pelvis + rest[2]])


def _shoulder_over_pelvis() -> np.ndarray:
    names = ("spine1", "spine2", "spine3", "right_collar", "right_shoulder")
    return np.asarray(OFFSETS[[joint(name) for name in names]].sum(axis=0))


_SHOULDER = _shoulder_over_pelvis()


def has_room(
    room: Room, spots: np.ndarray, radius: float, besides: str | None = None
) -> Generator[float, None, np.ndarray]:
    """Whether (N,) a body that stands at ``spots`` (N, 2) keeps ``radius`` metres from all pieces,
    but for the one that is named (``besides``). A job.
    """
    free = np.ones(len(spots), bool)
    if not len(spots):
        return free
    low, high = spots.min(axis=0) - radius, spots.max(axis=0) + radius
    for name, points in (yield from room.footprints((low, high))).items():
        if name == besides or not len(points):
            continue
        near = points[((points > low) & (points < high)).all(axis=1)]
        x, y = near.T.copy()
        for i in np.flatnonzero(free) if len(near) else ():
            gap = (x - spots[i, 0]) ** 2 + (y - spots[i, 1]) ** 2
            free[i] = not (gap < radius**2).any()
        yield 0.9
    return free


def marked_places(
    marked: Sequence[MarkedSeat], towards: np.ndarray, near: np.ndarray | None
) -> list[SeatPlace]:
    """Where one sits on marked seats, the nearest first: to ``near`` (2,), or to where one comes
    from.
    """
    places = [place for seat in marked if (place := seat.place()) is not None]
    at = towards if near is None else near
    return sorted(places, key=lambda place: float(np.linalg.norm(place.position - at)))


def known_seats(
    room: Room,
    piece: Piece,
    towards: np.ndarray,
    near: np.ndarray | None,
    size: float,
    tables: bool = False,
) -> Generator[float, None, list[SeatPlace]]:
    """The seats that a piece of a room says itself, else ``seats_on`` it; these are looked for once
    on all of one shape that have a back, which tells the facing. A job.
    """
    marked = marked_places(room.marked.get(piece.name, ()), towards, near)
    if marked:
        return marked if near is None else marked[:1]
    shape, place = piece.shape()
    key = ("seats", shape)
    if near is not None or key not in room.known.shapes:
        found = yield from seats_on.steps(piece, towards, room.floor, near, size, tables)
        if near is None and all(seat.back for seat in found):
            room.known.shapes[key] = [_moved(seat, -place) for seat in found]
        return found
    return [_moved(seat, place) for seat in room.known.shapes[key]]


def _moved(seat: SeatPlace, by: np.ndarray) -> SeatPlace:
    return replace(seat, position=seat.position + by)


def before_a_top(
    room: Room, piece: Piece, seat: SeatPlace
) -> Generator[float, None, np.ndarray | None]:
    """Where (2,) the table, the desk or the bar is that a seat without a back stands at, and that
    one therefore faces; None where there is none. A job.
    """
    low, high = (seat.height + over for over in _TOPS)
    best, nearest = None, _AT_TOP
    around = seat.position - _AT_TOP, seat.position + _AT_TOP
    for name, points in (yield from room.surfaces(around)).items():
        if name == piece.name:
            continue
        at = points[(points[:, 2] > low) & (points[:, 2] < high), :2]
        gaps = np.linalg.norm(at - seat.position, axis=1)
        if len(gaps) and gaps.min() < nearest:
            nearest = float(gaps.min())
            best = at[gaps < nearest + 0.05].mean(axis=0).astype(float)
    return best


def towards_top(seats: Sequence[SeatPlace], top: np.ndarray) -> list[SeatPlace]:
    """Of the seats, those from which one looks to a top (2,) that one sits down at; all, where
    there are none of these.
    """
    kept = [
        seat
        for seat in seats
        if forward_of(seat.yaw) @ normalised(top - seat.position) > _LOOKS_TO_TOP
    ]
    return kept or [*seats]


@stepwise
def seats_on(
    piece: Piece,
    towards: np.ndarray,
    floor: float,
    near: np.ndarray | None = None,
    size: float = 1.0,
    tables: bool = False,
) -> Generator[float, None, list[SeatPlace]]:
    """Where people sit on a piece, as many as fit, or the one place ``near`` (2,); see
    ``seats.seat_of``.
    """
    job = seat_of.steps(piece.solids, towards, floor, piece.name, near, size, tables)
    found = yield from within(job, 0.0, 0.5)
    count = 1 + int(2.0 * found.aside / _ELBOW_ROOM)
    if near is not None or count == 1:
        return [found]

    ahead = forward_of(found.yaw)
    across = np.array([ahead[1], -ahead[0]])
    middle = found.position
    places = []
    for k, aside in enumerate(np.linspace(-found.aside, found.aside, count)):
        spot = middle + aside * across
        job = seat_of.steps(piece.solids, towards, floor, piece.name, spot, size, tables)
        places.append((yield from within(job, 0.5 + 0.5 * k / count, 0.5 + 0.5 * (k + 1) / count)))
    return places


@stepwise
def beside(
    thing: Piece | np.ndarray, floor: float, ring: Sequence[float]
) -> Generator[float, None, list[Place]]:
    """Where one stands before a piece or a point (3,), so many metres away (``ring``, from and
    to), facing it.
    """
    if isinstance(thing, Piece):
        field, _ = yield from top_view.steps(
            thing.solids, _SPACING, floor + KNEE_LOW, floor + HEAD_HIGH
        )
        points = field.middles(np.argwhere(np.isfinite(field.top)))
        points = points if len(points) else thing.box().mean(axis=0)[None, :2]
    else:
        points = np.asarray(thing, float)[None, :2]
    yield 0.5

    low, high = points.min(axis=0) - ring[1], points.max(axis=0) + ring[1]
    step = max(0.12, float((high - low).max()) / 40)
    axes = [np.arange(a, b + step, step) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    found = []
    for spot in grid:
        offset = points - spot
        away = np.sqrt((offset**2).sum(axis=1))
        nearest = int(np.argmin(away))
        if ring[0] <= away[nearest] <= ring[1]:
            found.append(Place(spot, facing(normalised(offset[nearest]))))
    return found


def seated_pelvis(seat: SeatPlace) -> float:
    """Height of a pelvis that rests on a seat, over the world's zero."""
    return seat.height + SEAT_TO_PELVIS


def standing_pelvis(floor: float) -> float:
    return floor + STANDING_PELVIS
