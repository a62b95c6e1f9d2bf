"""Finds where to sit on a piece of furniture, and which way to face, by its mesh."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core.errors import InputError
from ..core.nearby import extent
from ..core.paths import facing
from ..core.progress import stepwise, within
from ..core.solids import Box, Mesh
from ..core.text import metres
from .surfaces import HeightField, height_field, parts_of_surfaces

__all__ = ["NoSeat", "SeatPlace", "on_a_seat", "rectangle_axes", "seat_of"]

_CELL = 0.03
"""Metres; of the cells in which furniture is looked at from above."""
_MAX_CELLS = 1_000_000
"""Larger furniture is looked at more coarsely."""

# What is a seat. Heights are metres over the floor, unless they are said to be over the seat.
_LOWEST = 0.22
"""Height of the lowest seat."""
_HIGHEST = 0.85
"""Height of the highest seat."""
_OVERHEAD = 1.5
"""What is higher is not part of a seat."""
_LEVEL_STEP = 0.02
"""Between the heights that are tried."""
_FLAT = 0.05
"""Over the seat: what rises by less belongs to it."""
_BACK = 0.15
"""Over the seat: what is higher is a back or an arm."""
_LEAST = 0.035
"""Square metres of the smallest seat."""
_ROOM = 0.21
"""Metres; side of the square that a seat has room for. Arms and the rims of backs have not."""
_NEARLY = 0.5
"""Of the roomiest level's area: what a lower level needs to be the seat, since cushions and backs
lie higher.
"""
_SMALLEST = 0.15
"""Metres across, of the smallest furniture."""
_LARGEST = 15.0
"""Metres across, of the largest furniture."""

# Which way to face.
_ONE_SIDED = 0.10
"""Metres between the middles of the seat and of what stands up around it, where that is a back."""
_SNAP = np.radians(30.0)
"""The direction is that of a side of the seat, if one differs by less."""
_SQUARE = 1.3
"""Length over width up to which a seat counts as square, so that any side may be its front."""
_DEEPEST = 1.1
"""Metres from a back to the front edge; what is deeper, such as a bed, is sat on at an edge."""
_LEGS = 0.3
"""Metres beyond an edge, and to each side, that legs need to hang there."""

# Where the pelvis rests.
_BEFORE_BACK = 0.20
"""Metres between the pelvis and the back."""
_FROM_EDGE = 0.22
"""Metres between the pelvis and the front edge, where there is no back."""
_ON_IT = 0.12
"""Metres of seat that the pelvis has before it, however shallow the seat is."""
_HALF_WIDTH = 0.28
"""Metres that a body needs to each side."""
_UNDER = 0.08
"""Metres around a root in which its seat is looked for."""


@dataclass(frozen=True)
class SeatPlace:
    """Where somebody sits: the pelvis rests at ``position`` (2,) and faces ``yaw`` (``core.root``).

    ``height``: of the seat's top over the world's zero, metres. ``back``: whether it has one.
    ``aside``: metres to each side within which one may sit as well. ``edge``: metres from the
    pelvis to the front edge.
    """

    position: np.ndarray
    yaw: float
    height: float
    back: bool
    aside: float
    edge: float


class _Spot(NamedTuple):
    """A place on a seat, for one who looks in some direction: ``right``, metres to the right of the
    origin; ``room``, metres to each side of the seat's middle within which one may sit; ``begins``
    and ``ends``, metres ahead of the origin, of the seat there.
    """

    right: float
    room: float
    begins: float
    ends: float


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
    """The first and last cell (N, 2) of each row of sorted cells; their hull is that of all."""
    starts = np.flatnonzero(np.diff(cells[:, 0], prepend=-1))
    return cells[np.concatenate([starts, np.append(starts[1:], len(cells)) - 1])]


def rectangle_axes(cells: np.ndarray) -> np.ndarray:
    """The two directions (2, 2) of the smallest rectangle around points (N, 2), the longer side
    first.
    """
    hull = _hull(cells)
    best, found = np.inf, np.eye(2)
    edges = np.roll(hull, -1, axis=0) - hull
    for angle in np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (np.pi / 2), 3)):
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        length, width = np.ptp(hull @ along), np.ptp(hull @ across)
        if length * width < best - 1e-9:
            best = length * width
            found = np.stack([along, across] if length >= width else [across, along])

    return found


def _shrunk(mask: np.ndarray, reach: int) -> np.ndarray:
    """The cells (X, Y) around which all cells are set, up to ``reach`` cells along both sides."""
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
    """Height over ``floor`` and cells (N, 2) of the level to sit on: the lowest one that has about
    as much room as any. None where there is none.

    This is where the height of a seat is decided. Backs, arms and cushions are higher than the seat
    between them, and rims have no room for a body.
    """
    over = field.top - floor
    reach = max(1, round(0.5 * _ROOM / field.cell))
    levels = np.arange(_LOWEST, _HIGHEST, _LEVEL_STEP)

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
    best = lowest + int(np.argmax(room[lowest : lowest + 1 + round(_FLAT / _LEVEL_STEP)]))
    level = float(np.median(over[masks[best]]))
    cells = np.argwhere(masks[best] & (np.abs(over - level) < _FLAT))
    return level, cells


def _nearest(ways: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The one of unit vectors ``ways`` (N, 2) that is most like ``wanted`` (2,)."""
    return ways[np.argmax(ways @ wanted)]


def _snapped(forward: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """The one of the ``ways`` (N, 2) that is about ``forward`` (2,), or else ``forward`` itself."""
    found = _nearest(ways, forward)
    return found if found @ forward > np.cos(_SNAP) else forward


def _spot(places: np.ndarray, forward: np.ndarray, near: np.ndarray | None) -> _Spot:
    """Where to sit on ``places`` (N, 2), facing ``forward`` (2,): in the middle or beside ``near``
    (2,); if a part of a sofa is as deep as a bed, on another part.
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
    for right in (wanted, *others[np.argsort(np.abs(others - wanted))]):
        first, last = np.searchsorted(width, (right - _ROOM, right + _ROOM))
        column = depth[first:last][np.abs(width[first:last] - right) < 0.5 * _ROOM]
        column = column if len(column) else depth
        spots.append(_Spot(float(right), room, float(column.min()), float(column.max())))

    return next((spot for spot in spots if spot.ends - depth.min() <= _DEEPEST), spots[0])


def _blocked(up: np.ndarray, forward: np.ndarray, spot: _Spot) -> bool:
    """Whether something stands up, at places ``up`` (N, 2), where legs would hang over an edge."""
    along = up @ forward - spot.ends
    across = up @ np.array([forward[1], -forward[0]]) - spot.right
    return bool(((along > -0.1) & (along < _LEGS) & (np.abs(across) < _LEGS)).any())


def _facing(
    field: HeightField,
    *,
    places: np.ndarray,
    level: float,
    floor: float,
    axes: np.ndarray,
    towards: np.ndarray,
    near: np.ndarray | None,
) -> tuple[np.ndarray, bool]:
    """The direction (2,) to face on ``places`` (N, 2), and whether there is a back to lean against.

    ``field`` holds the whole piece, whose seat is at ``level`` over ``floor``; ``axes`` (2, 2): the
    seat's longer and shorter side.
    """
    longer, shorter = axes
    middle = places.mean(0)
    upright = field.middles(np.argwhere(field.top - floor > level + _BACK))
    side = upright.mean(0) - middle if len(upright) else np.zeros(2)
    if np.linalg.norm(side) <= _ONE_SIDED:
        square = np.ptp(places @ longer) < _SQUARE * np.ptp(places @ shorter)
        ways = np.stack([longer, -longer, shorter, -shorter] if square else [shorter, -shorter])
        return _nearest(ways, towards - middle), False

    ways = np.stack([longer, -longer, shorter, -shorter])
    forward = _snapped(-side / np.linalg.norm(side), ways)
    if _spot(places, forward, near).ends - (places @ forward).min() <= _DEEPEST:
        return forward, True

    legs = field.middles(np.argwhere(field.top - floor > level + _FLAT))
    free = [way for way in ways if not _blocked(legs, way, _spot(places, way, near))]
    return _nearest(np.array(free or ways), towards - middle), False


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


class NoSeat(InputError):
    """There is nothing to sit on."""


@stepwise
def seat_of(
    solids: Sequence[Box | Mesh],
    towards: np.ndarray,
    floor: float = 0.0,
    name: str = "furniture",
    near: np.ndarray | None = None,
    size: float = 1.0,
) -> Generator[float, None, SeatPlace]:
    """Where to sit on one piece of furniture, made of ``solids``; world, metres, people of 1.75 m.

    In front of a back, facing away from it. Without a back, facing along the seat's shorter side,
    to where ``towards`` (2,) lies; on what is as deep as a bed, on an edge towards there, at which
    nothing stands up. On a wide seat in the middle, or beside ``near`` (2,) where given. Raises
    NoSeat where there is nothing to sit on, which is a level surface between 22 and 85 cm over
    ``floor``. ``size``: of the character, over 1.75 m, by which messages give lengths.
    """
    parts = yield from within(parts_of_surfaces.steps(solids, 0.6 * _CELL), 0.0, 0.5)
    field = yield from within(_field_of(parts, floor), 0.5, 0.6)
    found = (yield from within(_seat_level(field, floor), 0.6, 1.0)) if field else None
    if field is None or found is None:
        raise NoSeat(_why_not_a_seat(solids, name, size))

    level, cells = found
    places = field.middles(cells)
    yield 1.0
    axes = rectangle_axes(field.middles(_ends_of_rows(cells)))
    yield 1.0
    forward, back = _facing(
        field, places=places, level=level, floor=floor, axes=axes, towards=towards, near=near
    )
    yield 1.0

    spot = _spot(places, forward, near)
    middle = 0.5 * (spot.begins + spot.ends)
    if back:
        ahead = min(spot.begins + _BEFORE_BACK, max(middle, spot.ends - _ON_IT))
    else:
        ahead = max(middle, spot.ends - _FROM_EDGE)

    return SeatPlace(
        position=ahead * forward + spot.right * np.array([forward[1], -forward[0]]),
        yaw=facing(forward),
        height=floor + level,
        back=back,
        aside=spot.room,
        edge=spot.ends - ahead,
    )


def _field_of(
    parts: Sequence[np.ndarray], floor: float
) -> Generator[float, None, HeightField | None]:
    """The heights of furniture that has its surface points in ``parts`` (N, 3), without the floor
    and what is overhead; None where nothing else is left.
    """
    kept, corners = [], []
    for part in parts:
        part = part[(part[:, 2] < floor + _OVERHEAD) & (part[:, 2] > floor + 0.02)]
        if len(part):
            kept.append(part)
            corners += [part[:, :2].min(0), part[:, :2].max(0)]
        yield 0.0

    if not kept:
        return None

    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    cell = max(_CELL, float(np.sqrt((high - low).prod() / _MAX_CELLS)))
    field = height_field(np.zeros((0, 3)), low, high, cell)
    for k, part in enumerate(kept):
        field.add(part)
        yield k / len(kept)

    return field


def _why_not_a_seat(solids: Sequence[Box | Mesh], name: str, size: float) -> str:
    """What to say of a piece of furniture that nobody can sit on."""
    across = extent(solids)
    if not _SMALLEST < across < _LARGEST:
        return (
            f"'{name}' is {metres(across * size)} across: is its unit right? Scale it to the "
            "character's size."
        )
    return (
        f"'{name}' has no level surface between 22 and 85 cm over the floor to sit on; choose a "
        "seat."
    )
