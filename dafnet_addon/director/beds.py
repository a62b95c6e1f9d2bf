"""Where one lies on a bed or sofa, and on which edge of it one sits down first.

Canonical metres, world.
"""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from ..core.errors import InputError
from ..core.paths import facing
from ..core.progress import stepwise, within
from ..core.root import forward_of
from ..core.softness import guessed
from .room import Piece, axes_from_above, top_view
from .seats import SeatPlace, seat_of
from .surfaces import height_field

__all__ = ["Bed", "bed_of"]

_CELL = 0.03  # metres
_HEAD_ROOM = 0.82  # metres from a lying pelvis to the head's end of a bed
_FEET_ROOM = 0.80  # metres from it to the other end, at least
_INTO_BED = 0.30  # metres that a pelvis moves in from the edge where it sat
_UPPER = 0.7  # metres over a bed, above which things hang over it
_UPRIGHT = 0.90  # metres over a bed, that one who sits on its edge needs
_NARROW = 0.55  # metres from it to the edge, at most


@dataclass(frozen=True)
class Bed:
    """Where one lies: ``seat``: the edge where one sits down first; ``yaw`` of a body whose feet
    point there; the resting pelvis' ``position`` (2,); heights of the ``top`` and of what is under
    the head (``pillow``), over the world's zero; ``softness``: see ``core.softness``.
    """

    seat: SeatPlace
    yaw: float
    position: np.ndarray
    top: float
    pillow: float
    softness: float


@stepwise
def bed_of(
    piece: Piece, towards: np.ndarray, floor: float, size: float = 1.0
) -> Generator[float, None, list[Bed]]:
    """Where one lies on a piece, from each long side that one can sit down on; raises InputError
    where nobody can.
    """
    sides = []
    field, points = yield from top_view.steps(piece.solids, _CELL, floor + 0.1, floor + 1.5)
    if not len(points):
        raise InputError(f"'{piece.name}' has nothing to lie on; choose a bed or a sofa.")
    longer, shorter = axes_from_above(field)
    for k, out in enumerate((shorter, -shorter)):
        middle = 0.5 * points[:, :2].min(0) + 0.5 * points[:, :2].max(0)
        job = seat_of.steps(piece.solids, middle + 9.0 * out, floor, piece.name, None, size)
        seat = yield from within(job, 0.2 + 0.4 * k, 0.6 + 0.4 * k)
        if forward_of(seat.yaw) @ out > 0.9:
            sides.append(seat)

    found, low = [], False
    for seat in sides:
        over = points[np.linalg.norm(points[:, :2] - seat.position, axis=1) < 0.25, 2] - seat.height
        if ((over > _UPPER) & (over < _UPRIGHT)).any():
            low = True
            continue
        # what is over the bed, such as an upper bunk, is not part of it
        under = points[points[:, 2] < seat.height + _UPPER]
        field = height_field(under, points[:, :2].min(0), points[:, :2].max(0), field.cell)
        level = np.argwhere(np.abs(field.top - seat.height) < 0.08)
        softness = max(
            guessed(solid, seat.height - floor) if solid.softness is None else solid.softness
            for solid in piece.solids
        )
        bed = _lain(field.middles(level), under, seat, longer, softness)
        if bed:
            found.append(bed)
    if not found and low:
        raise InputError(
            f"What hangs over '{piece.name}' is too low to sit upright; choose another bed."
        )
    if not found:
        raise InputError(
            f"'{piece.name}' is too short to lie on, or nobody can sit down on its long side; "
            "choose a bed or a sofa."
        )
    return sorted(found, key=lambda bed: float(np.linalg.norm(bed.seat.position - towards)))


def _lain(
    cells: np.ndarray, points: np.ndarray, seat: SeatPlace, longer: np.ndarray, softness: float
) -> Bed | None:
    """Lying on level cells (N, 2), along ``longer`` (2,), whose long side has a ``seat``."""
    out = forward_of(seat.yaw)
    along, across = cells @ longer, cells @ out
    strip = along[np.abs(across - seat.position @ out) < 0.3]
    first, last = float(strip.min()), float(strip.max())
    if last - first < _HEAD_ROOM + _FEET_ROOM - 0.15:
        return None

    # The head goes to the end where more stands up: a headboard, pillows, an arm.
    ends = [points[np.abs(points[:, :2] @ longer - end) < 0.35, 2] for end in (first, last)]
    higher = [float(np.percentile(end, 95)) if len(end) else -np.inf for end in ends]
    to_feet = longer if higher[0] >= higher[1] else -longer
    head_end = first if higher[0] >= higher[1] else -last
    room = 0.5 * ((last - first) - _HEAD_ROOM - _FEET_ROOM)
    pelvis = head_end + _HEAD_ROOM + min(0.0, room)

    edge = float(seat.position @ out) + seat.edge
    width = edge - float(across.min())
    into = min(_INTO_BED + seat.edge, _NARROW, 0.5 * width)
    sits = pelvis * to_feet + float(seat.position @ out) * out
    position = pelvis * to_feet + (edge - into) * out
    head = position - 0.62 * to_feet
    near = np.linalg.norm(points[:, :2] - head, axis=1) < 0.12
    pillow = points[near, 2]
    pillow = pillow[pillow < seat.height + 0.25]
    under = float(np.percentile(pillow, 90)) if len(pillow) else seat.height
    seat = SeatPlace(sits, seat.yaw, seat.height, seat.back, 0.0, seat.edge)
    return Bed(seat, facing(to_feet), position, seat.height, max(under, seat.height), softness)
