"""Where, and which way round, one sits on a piece of furniture, found on its mesh."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.errors import InputError
from ..core.nearby import extent
from ..core.paths import facing
from ..core.progress import stepwise, within
from ..core.solids import Box, Mesh
from ..core.text import metres
from .surfaces import HeightField, height_field, parts_of_surfaces

__all__ = ["SeatPlace", "on_a_seat", "seat_of"]

_CELL = 0.03
_MAX_CELLS = 1_000_000  # cells; larger furniture is looked at more coarsely
_LOWEST = 0.22  # metres over the floor, of seats
_HIGHEST = 0.85  # metres over the floor, of seats
_OVERHEAD = 1.5  # metres over the floor; what is higher is not part of a seat
_FLAT = 0.05  # metres over the seat, of what still is seat
_BACK = 0.15  # metres over the seat, of a back or an arm
_LEAST = 0.035  # square metres
# metres: side of the square that a seat has room for; arms and the rims of backs have not
_ROOM = 0.21
# of the roomiest level's area, that a lower level needs to be the seat: cushions and backs lie
# higher
_NEARLY = 0.5
# metres between the middles of seat and of what stands up around it, where that is a back
_ONE_SIDED = 0.10
_BEFORE_BACK = 0.20  # metres between the pelvis and the back
_FROM_EDGE = 0.22  # metres between the pelvis and the front edge, where there is no back
_ON_IT = 0.12  # metres of seat that the pelvis has before it, however shallow the seat is
_SNAP = np.radians(30.0)
_UNDER = 0.08  # metres around a root, in which its seat is looked for
_SMALLEST = 0.15  # metres across, of furniture
_LARGEST = 15.0  # metres across, of furniture
_HALF_WIDTH = 0.28  # metres that a body needs to each side
# metres from a back to the front edge: on what is deeper, as a bed, one sits on an edge
_DEEPEST = 1.1
_LEGS = 0.3  # metres beyond an edge, and to each side, that legs need to hang there


@dataclass(frozen=True)
class SeatPlace:
    """``position`` (2,) of the resting pelvis and ``yaw`` that it faces (``core.root``); ``height``
    of the seat's top over the world's zero, metres; whether there is a ``back``; ``aside``: metres
    to each side within which one may sit as well; ``edge``: metres from there to the front edge.
    """

    position: np.ndarray
    yaw: float
    height: float
    back: bool
    aside: float
    edge: float


def _hull(points: np.ndarray) -> np.ndarray:
    """Convex hull (N, 2) of points, counter-clockwise (Andrew's monotone chain)."""
    ordered = np.unique(points, axis=0).tolist()

    def half(chain: list[list[float]]) -> list[list[float]]:
        out: list[list[float]] = []
        for p in chain:
            while len(out) > 1 and (
                (out[-1][0] - out[-2][0]) * (p[1] - out[-2][1])
                - (out[-1][1] - out[-2][1]) * (p[0] - out[-2][0])
                <= 0
            ):
                out.pop()
            out.append(p)

        return out[:-1]

    return np.array(half(ordered) + half(ordered[::-1])) if len(ordered) > 2 else np.array(ordered)


def _ends_of_rows(cells: np.ndarray) -> np.ndarray:
    """The first and the last cell (N, 2) of each row, of cells in order: their hull is that of
    all.
    """
    starts = np.flatnonzero(np.diff(cells[:, 0], prepend=-1))
    return cells[np.concatenate([starts, np.append(starts[1:], len(cells)) - 1])]


def _axes(cells: np.ndarray) -> np.ndarray:
    """The two directions (2, 2) of the smallest rectangle around points (N, 2), the longer side
    first.
    """
    hull = _hull(cells)
    best, found = np.inf, np.eye(2)
    edges = np.roll(hull, -1, axis=0) - hull
    for angle in np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (np.pi / 2), 3)):
        u = np.array([np.cos(angle), np.sin(angle)])
        v = np.array([-u[1], u[0]])
        a, b = np.ptp(hull @ u), np.ptp(hull @ v)
        if a * b < best - 1e-9:
            best, found = a * b, np.stack([u, v] if a >= b else [v, u])

    return found


def _shrunk(mask: np.ndarray, reach: int) -> np.ndarray:
    """Cells (X, Y) of which all within ``reach`` cells, along both sides, are set."""
    size = 2 * reach + 1
    padded = np.pad(mask, reach)
    rows = np.lib.stride_tricks.sliding_window_view(padded, size, axis=0).all(-1)
    return np.lib.stride_tricks.sliding_window_view(rows, size, axis=1).all(-1)


def _roomy(mask: np.ndarray, reach: int) -> np.ndarray:
    """The cells (X, Y) of squares that fit into the mask; slits of one or two cells in it, as
    between slats, do not count as gaps.
    """
    closed = ~_shrunk(~np.pad(mask, 1), 1)[1:-1, 1:-1] if mask.any() else mask
    return ~_shrunk(~_shrunk(closed, reach), reach) & mask


def _seat_level(
    field: HeightField, floor: float
) -> Generator[float, None, tuple[float, np.ndarray] | None]:
    """Height and cells (N, 2) of the level that one sits on: the lowest one that has about as much
    room as any.

    Backs, arms and cushions are higher than the seat between them, and rims have no room for a
    body.
    """
    over = field.top - floor
    reach = max(1, round(0.5 * _ROOM / field.cell))
    levels = np.arange(_LOWEST, _HIGHEST, 0.02)
    masks = []
    for k, level in enumerate(levels):
        masks.append(_roomy(np.abs(over - level) < _FLAT, reach))
        yield k / len(levels)

    room = np.array([mask.sum() for mask in masks])
    if not room.any():
        masks = [np.abs(over - level) < _FLAT for level in levels]
        room = np.array([mask.sum() for mask in masks])
    if room.max(initial=0) * field.cell**2 < _LEAST:
        return None

    lowest = int(np.argmax(room >= _NEARLY * room.max()))
    best = lowest + int(np.argmax(room[lowest : lowest + 1 + round(_FLAT / 0.02)]))
    level = float(np.median(over[masks[best]]))
    cells = np.argwhere(masks[best] & (np.abs(over - level) < _FLAT))
    return level, cells


def _nearest(ways: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The one of unit vectors ``ways`` (N, 2) that is most like ``wanted`` (2,)."""
    return ways[np.argmax(ways @ wanted)]


def _snapped(forward: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """``forward`` (2,), or the one of the ``ways`` (N, 2) that is as good as it."""
    found = _nearest(ways, forward)
    return found if found @ forward > np.cos(_SNAP) else forward


def _spot(
    places: np.ndarray, forward: np.ndarray, near: np.ndarray | None
) -> tuple[float, float, float, float]:
    """Where one sits on ``places`` (N, 2) that looks ``forward``: how far to the right, with how
    much room to each side, and where along ``forward`` the seat begins and ends there.

    One sits in the middle or beside ``near``; where a part of a sofa is as deep as a bed, on
    another part.
    """
    sideways = np.array([forward[1], -forward[0]])
    depth, width = places @ forward, places @ sideways
    order = np.argsort(width)
    depth, width = depth[order], width[order]
    middle = 0.5 * float(width.min() + width.max())
    room = max(0.0, 0.5 * float(np.ptp(width)) - _HALF_WIDTH)
    low, high = middle - room, middle + room
    wanted = middle if near is None else float(np.clip(near @ sideways, low, high))
    others = np.linspace(low, high, 1 + round(2 * room / _CELL))
    spots = []
    for aside in (wanted, *others[np.argsort(np.abs(others - wanted))]):
        first, last = np.searchsorted(width, (aside - _ROOM, aside + _ROOM))
        column = depth[first:last][np.abs(width[first:last] - aside) < 0.5 * _ROOM]
        column = column if len(column) else depth
        spots.append((float(aside), room, float(column.min()), float(column.max())))

    return next((spot for spot in spots if spot[3] - depth.min() <= _DEEPEST), spots[0])


def _blocked(up: np.ndarray, forward: np.ndarray, spot: tuple[float, float, float, float]) -> bool:
    """Whether something stands up, at places ``up`` (N, 2), where legs would hang over an edge."""
    aside, _, _, high = spot
    along, across = up @ forward - high, up @ np.array([forward[1], -forward[0]]) - aside
    return bool(((along > -0.1) & (along < _LEGS) & (np.abs(across) < _LEGS)).any())


@stepwise
def on_a_seat(
    solids: Sequence[Box | Mesh], position: np.ndarray, floor: float = 0.0
) -> Generator[float, None, bool]:
    """Whether a root that rests at ``position`` (2,) has a seat under it: something between 22 and
    85 cm over ``floor``.
    """
    parts = yield from parts_of_surfaces.steps(
        solids, _CELL, (position - _UNDER, position + _UNDER)
    )
    for points in parts:
        height = points[np.linalg.norm(points[:, :2] - position, axis=-1) < _UNDER, 2] - floor
        if ((height > _LOWEST) & (height < _HIGHEST)).any():
            return True
        yield 1.0

    return False


@stepwise
def seat_of(
    solids: Sequence[Box | Mesh],
    towards: np.ndarray,
    floor: float = 0.0,
    name: str = "furniture",
    near: np.ndarray | None = None,
    size: float = 1.0,
) -> Generator[float, None, SeatPlace]:
    """Where one sits on one piece of furniture, made of ``solids``; world, metres, people of 1.75
    m.

    With a back on one side one sits before it and looks away from it; without, one looks along the
    seat's shorter side, to where ``towards`` (2,) lies. On what is as deep as a bed one sits on an
    edge towards there, at which nothing stands up. On a wide seat one sits in the middle, or beside
    ``near`` (2,) where given. Raises InputError where there is nothing to sit on: a level
    surface between 22 and 85 cm over ``floor``. ``size``: of the character, over 1.75 m, for what
    is said of the scene.
    """
    parts = yield from within(parts_of_surfaces.steps(solids, 0.6 * _CELL), 0.0, 0.5)
    kept, corners = [], []
    for part in parts:
        part = part[(part[:, 2] < floor + _OVERHEAD) & (part[:, 2] > floor + 0.02)]
        if len(part):
            kept.append(part)
            corners += [part[:, :2].min(0), part[:, :2].max(0)]
        yield 0.5

    found = None
    if kept:
        low, high = np.min(corners, axis=0), np.max(corners, axis=0)
        cell = max(_CELL, float(np.sqrt((high - low).prod() / _MAX_CELLS)))
        field = height_field(np.zeros((0, 3)), low, high, cell)
        for k, part in enumerate(kept):
            field.add(part)
            yield 0.5 + 0.1 * k / len(kept)

        found = yield from within(_seat_level(field, floor), 0.6, 1.0)

    if found is None:
        if not _SMALLEST < (across := extent(solids)) < _LARGEST:
            raise InputError(
                f"'{name}' is {metres(across * size)} across: is its unit right? Scale it to the "
                "character's size."
            )
        raise InputError(
            f"'{name}' has no level surface between 22 and 85 cm over the floor to sit on; choose "
            "a seat."
        )

    level, cells = found
    places = field.middles(cells)
    middle = places.mean(0)
    yield 1.0
    longer, shorter = _axes(field.middles(_ends_of_rows(cells)))
    yield 1.0
    up = field.middles(np.argwhere(field.top - floor > level + _BACK))
    side = up.mean(0) - middle if len(up) else np.zeros(2)
    back = bool(np.linalg.norm(side) > _ONE_SIDED)
    if back:
        forward = -side / np.linalg.norm(side)
        ways = np.stack([longer, -longer, shorter, -shorter])
        forward = _snapped(forward, ways)
        spot = _spot(places, forward, near)
        if spot[3] - (places @ forward).min() > _DEEPEST:
            back = False
            legs = field.middles(np.argwhere(field.top - floor > level + _FLAT))
            free = [way for way in ways if not _blocked(legs, way, _spot(places, way, near))]
            forward = _nearest(np.array(free or ways), towards - middle)
    else:
        square = np.ptp(places @ longer) < 1.3 * np.ptp(places @ shorter)
        ways = np.stack([longer, -longer, shorter, -shorter] if square else [shorter, -shorter])
        forward = _nearest(ways, towards - middle)

    yield 1.0
    aside, room, low, high = _spot(places, forward, near)
    if back:
        at = min(low + _BEFORE_BACK, max(0.5 * (low + high), high - _ON_IT))
    else:
        at = max(0.5 * (low + high), high - _FROM_EDGE)

    position = at * forward + aside * np.array([forward[1], -forward[0]])
    yaw = facing(forward)
    return SeatPlace(position, yaw, floor + level, back, room, high - at)
