"""Level tops that one works at, sitting or standing: desks, tables, counters.

Canonical metres, world.
"""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from ..core.errors import InputError
from ..core.paths import facing
from ..core.progress import stepwise
from ..core.root import forward_of
from .outlines import rectangle_axes
from .places import Place, Surface
from .room import Piece, Room, top_view
from .surfaces import height_field

__all__ = ["Top", "beside_top", "known_top", "surface_before", "top_of"]

_CELL = 0.03  # metres
_ELBOW_ROOM = 0.6  # metres between people at one top
_LOWEST_TOP = 0.60  # metres over the floor, of what is worked on
_HIGHEST_TOP = 1.18  # metres over the floor
_OVER_TOP = 0.2  # metres over a top, that are free
_LEAST_TOP = 0.08  # square metres
_FLAT = 0.025  # metres
_BEFORE_TOP = 0.22  # metres from a body that stands to the edge that it works at
_DEEPEST_TOP = 0.35  # metres that hands go in over an edge


@dataclass(frozen=True)
class Top:
    """A level top: its ``height`` over the world's zero and the middles of its ``cells`` (N, 2)."""

    height: float
    cells: np.ndarray


@stepwise
def top_of(piece: Piece, floor: float) -> Generator[float, None, Top]:
    """The level top with most room between 60 and 118 cm over the floor; raises InputError where a
    piece has none.
    """
    highest = floor + _HIGHEST_TOP
    _, points = yield from top_view.steps(piece.solids, _CELL, floor + 0.3, highest + _OVER_TOP)
    low = points[:, :2].min(axis=0, initial=np.inf)
    high = points[:, :2].max(axis=0, initial=-np.inf)
    best = np.zeros((0, 2))
    level = 0.0
    for height in np.arange(floor + _LOWEST_TOP, highest, 0.02) if len(points) else ():
        yield 0.5
        near = points[np.abs(points[:, 2] - height) < _FLAT]
        field = height_field(near, low, high, _CELL)
        over = points[:, 2] - height
        stands = points[(over > _FLAT) & (over < _OVER_TOP), :2]
        field.top[tuple(field.index(stands).T)] = -np.inf  # a face, or what stands on the top
        cells = np.argwhere(np.isfinite(field.top))
        if len(cells) > len(best):
            best = field.middles(cells)
            level = float(np.median(field.top[tuple(cells.T)]))

    if len(best) * _CELL**2 < _LEAST_TOP:
        raise InputError(
            f"'{piece.name}' has no level top between 60 and 118 cm over the floor to work on; "
            "choose a desk, a table or a counter."
        )
    return Top(level, best)


def known_top(room: Room, piece: Piece) -> Generator[float, None, Top]:
    """``top_of`` a piece of a room, looked for once on all of one shape. A job."""
    shape, place = piece.shape()
    key = ("top", shape)
    if key not in room.known.shapes:
        found = yield from top_of.steps(piece, room.floor)
        room.known.shapes[key] = Top(found.height, found.cells - place)
    top = room.known.shapes[key]
    return Top(top.height, top.cells + place)


def surface_before(top: Top, place: Place) -> Surface | None:
    """The part of a top that a body works on from where it is; None where none is before it."""
    ahead = forward_of(place.yaw)
    offset = top.cells - place.position
    away, across = offset @ ahead, offset @ np.array([ahead[1], -ahead[0]])
    before = away[(np.abs(across) < 0.2) & (away > 0.1) & (away < 1.0)]
    if len(before) * _CELL**2 < 0.02:
        return None
    edge = float(before.min()) - 0.5 * _CELL
    depth = min(_DEEPEST_TOP, float(before.max()) - edge - 0.05)
    if depth < 0.1:
        return None
    return Surface(np.array([*(place.position + edge * ahead), top.height]), 0.0, depth)


def beside_top(top: Top) -> list[Place]:
    """Where one stands to work at a top: all along its sides, a body's width apart."""
    longer, shorter = rectangle_axes(top.cells)
    found = []
    for out in (longer, -longer, shorter, -shorter):
        along = np.array([out[1], -out[0]])
        across, away = top.cells @ along, top.cells @ out
        room = max(0.0, 0.5 * float(np.ptp(across)) - 0.25)
        middle = 0.5 * float(across.min() + across.max())
        for aside in middle + np.linspace(-room, room, 1 + int(2.0 * room / _ELBOW_ROOM)):
            strip = away[np.abs(across - aside) < 0.15]
            if len(strip):
                spot = aside * along + (float(strip.max()) + _BEFORE_TOP) * out
                found.append(Place(spot, facing(-out)))
    return found
