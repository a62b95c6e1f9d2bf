"""From which side one comes to a seat, and leaves it: straight, or round the desk before it.

Canonical metres, world.
"""

from collections.abc import Generator, Sequence

import numpy as np

from ..core.errors import InputError
from ..core.paths import Stop, route
from ..core.progress import stepwise
from ..core.root import forward_of
from ..core.solids import Box, Mesh
from .places import has_room
from .room import Room
from .seats import SeatPlace
from .surfaces import boxes_of, surface_points

__all__ = ["pair", "way_in"]

_FRONT = 0.85  # metres before a seat, from which one comes straight
_SIDE = 0.70  # metres to the side of a seat, from which one comes round a desk before it
_ROUND_SEAT = 1.4  # metres around a seat in which anything may be in the way
_BODY = (0.50, 1.36)  # metres over the floor, from thighs to chest
_OVER_SEAT = 0.12  # metres over a seat's top that belong to it
_CLEAR = 0.18  # metres from the body's axis that need no other way to a seat
_BY_OTHERS = 0.52  # metres from others' roots
_SLIPS_BY = 0.02  # metres from it, at least


def pair(point: np.ndarray | Sequence[float]) -> tuple[float, float]:
    """A point (2 or more) as a stop takes it."""
    return float(point[0]), float(point[1])


@stepwise
def way_in(
    room: Room,
    name: str,
    own: Sequence[Box | Mesh],
    seat: SeatPlace,
    standing: Sequence[Box] = (),
) -> Generator[float, None, tuple[np.ndarray, ...]]:
    """Points (2,) by which one comes to a ``seat`` of the piece ``name``, made of its ``own``
    solids; none where one comes straight. Where it can be, not past those who are ``standing`` or
    sitting there. Raises InputError where all three ways are barred.
    """
    ahead = forward_of(seat.yaw)
    across = np.array([ahead[1], -ahead[0]])
    boxes = yield from boxes_of.steps(room.solids)
    around = seat.position - _ROUND_SEAT, seat.position + _ROUND_SEAT
    points: list[tuple[str, np.ndarray]] = []
    lowest = max(_BODY[0], seat.height - room.floor + _OVER_SEAT)
    for solid, box in zip(room.solids, boxes, strict=True):
        if any(solid is each for each in own) or np.isnan(box).any():
            continue
        if (box[1, :2] < around[0]).any() or (box[0, :2] > around[1]).any():
            continue
        found = surface_points([solid], 0.04, around)
        over = found[:, 2] - room.floor
        points.append((solid.name, found[(over > lowest) & (over < _BODY[1]), :2]))
        yield 0.5

    others = np.array([box.center[:2] for box in standing]).reshape(-1, 2)
    goal = Stop(pair(seat.position), seat.yaw, 0.0, seated=True)
    sides = [(seat.position + side * across,) for side in (_SIDE, -_SIDE)]
    options: list[tuple[np.ndarray, ...]] = [(), *sides]
    clear, free, blockers = [], [], []
    for via in options:
        begin = via[0] if via else seat.position + _FRONT * ahead
        start = Stop(pair(begin), seat.yaw, 0.0)
        way = route(start, *map(pair, via[1:]), goal).path.position[::2, :2]
        passes = _gap(way, others) >= _BY_OTHERS
        gaps = [(_gap(way, some), which) for which, some in points]
        gap, which = min(gaps, default=(np.inf, ""))
        if via:
            stands = yield from has_room(room, begin[None], 0.2)
            gap = gap if stands[0] else -1.0
        clear.append(gap)
        free.append(passes)
        blockers.append(which)
        if clear[0] >= _CLEAR and free[0]:
            return ()

    able = [k for k, gap in enumerate(clear) if gap >= _SLIPS_BY]
    if clear[0] >= _CLEAR and not any(free[k] for k in able):
        return ()
    best = max(range(len(clear)), key=lambda k: (clear[k] >= _SLIPS_BY and free[k], clear[k]))
    if clear[best] < _SLIPS_BY:
        raise InputError(
            f"'{blockers[0]}' stands where one comes to sit on '{name}'; pull '{name}' out, "
            "or choose another seat."
        )
    return options[best]


def _gap(way: np.ndarray, points: np.ndarray) -> float:
    """Metres between a way (N, 2) and points (M, 2)."""
    if not len(points):
        return np.inf
    x, y = points.T.copy()
    return float(np.sqrt(min(((x - at[0]) ** 2 + (y - at[1]) ** 2).min() for at in way)))
