"""Upright faces that one writes on, standing before them: boards and walls.

Canonical metres, world.
"""

from collections.abc import Generator, Sequence

import numpy as np

from ..core.errors import InputError
from ..core.paths import facing
from ..core.progress import stepwise
from ..core.series import runs
from .places import Place, Surface
from .room import Piece, axes_from_above, top_view
from .surfaces import height_field

__all__ = ["before_boards"]

_BOARD_CELL = 0.04  # metres
_BOARD_BAND = (1.15, 1.50)  # metres over the floor, that a board has to cover
_BOARD_ROOM = 0.55  # metres that have to be free before it
_BEFORE_BOARD = 0.45  # metres from a body to the board that it writes on
_WRITTEN = (1.05, 1.65)  # metres over the floor, between which one writes
_TALL = 0.44  # metres of a board that are written on
_INSIDE = 0.26  # metres from a board's end to who writes on it; lines are that wide to a side


@stepwise
def before_boards(
    piece: Piece, floor: float, near: np.ndarray | None = None
) -> Generator[float, None, list[tuple[Place, Surface]]]:
    """Where one stands to write on an upright face of a piece, as many as there is room for; near a
    place (2,) where one is given.

    Raises InputError where nothing upright is as high as one writes.
    """
    low, high = floor + _BOARD_BAND[0], floor + _BOARD_BAND[1]
    _, points = yield from top_view.steps(
        piece.solids, _BOARD_CELL, floor + _WRITTEN[0] - 0.2, floor + _WRITTEN[1] + 0.2
    )
    band = points[(points[:, 2] > low) & (points[:, 2] < high)]
    found: list[tuple[Place, Surface]] = []
    axes = np.zeros((0, 2))
    if len(band):
        corners = band[:, :2].min(axis=0), band[:, :2].max(axis=0)
        axes = axes_from_above(height_field(band, *corners, _BOARD_CELL))
    for ahead in (*axes, *-axes):
        yield 0.5
        found += _faces(points, band, ahead, floor, near)

    if not found:
        raise InputError(
            f"'{piece.name}' has no upright face between {_BOARD_BAND[0]:.2f} and "
            f"{_BOARD_BAND[1]:.2f} m over the floor to write on; choose a board or a wall."
        )
    return found


def _faces(
    points: np.ndarray, band: np.ndarray, ahead: np.ndarray, floor: float, near: np.ndarray | None
) -> list[tuple[Place, Surface]]:
    """Those that one writes on who looks ``ahead`` (2,)."""
    across = np.array([ahead[1], -ahead[0]])
    away, aside = band[:, :2] @ ahead, band[:, :2] @ across
    origin = np.array([away.min(), aside.min()])
    cells = ((np.stack([away, aside], axis=1) - origin) / _BOARD_CELL).astype(int)
    heights = ((band[:, 2] - floor - _BOARD_BAND[0]) / 0.05).astype(int)
    covered = np.zeros((*(cells.max(axis=0) + 1), heights.max() + 1), bool)
    covered[cells[:, 0], cells[:, 1], heights] = True
    wall = covered.sum(axis=2) >= 0.7 * (_BOARD_BAND[1] - _BOARD_BAND[0]) / 0.05

    # A face has nothing of the piece before it; what is behind it within a cell is its thickness.
    before = round(_BOARD_ROOM / _BOARD_CELL)
    padded = np.pad(covered.any(axis=2), ((before, 0), (0, 0)))
    clear = ~np.lib.stride_tricks.sliding_window_view(padded, before, axis=0).any(axis=2)[:-1]
    face = wall & clear
    thick = face | np.roll(face, 1, axis=0) & (np.arange(len(face)) > 0)[:, None]
    found = []
    for row in range(len(face)):
        for start, stop in runs(thick[row], at_least=0.4 / _BOARD_CELL, gap=1):
            if not face[row, start:stop].any():
                continue
            first, last = (
                origin[1] + _BOARD_CELL * start + _INSIDE,
                origin[1] + _BOARD_CELL * stop - _INSIDE,
            )
            places = np.linspace(first, last, 1 + int(max(0.0, last - first) / 0.7))
            if near is not None:
                places = np.clip([near @ across], first, max(first, last))
            for place in places if last > first else [0.5 * (first + last)]:
                depth = origin[0] + _BOARD_CELL * row
                made = _face(points, ahead, across, (float(depth), float(place)), floor)
                if made:
                    found.append(made)

    return _apart(found)


def _face(
    points: np.ndarray,
    ahead: np.ndarray,
    across: np.ndarray,
    at: tuple[float, float],
    floor: float,
) -> tuple[Place, Surface] | None:
    """One place before a face that is so far ahead and to the right of the origin."""
    away, aside = points[:, :2] @ ahead, points[:, :2] @ across
    own = (np.abs(aside - at[1]) < 0.25) & (np.abs(away - at[0]) < 2.0 * _BOARD_CELL)
    if not own.any():
        return None
    surface, heights = float(away[own].min()), points[own, 2] - floor
    low = max(_WRITTEN[0], float(heights.min()) + 0.05)
    high = min(_WRITTEN[1], float(heights.max()) - 0.05)
    middle = np.clip(1.38, low, high)
    low, high = max(low, middle - _TALL / 2), min(high, middle + _TALL / 2)
    if high - low < 0.1:
        return None

    spot = surface * ahead + at[1] * across
    origin = np.array([*spot, floor + middle])
    place = Place(spot - _BEFORE_BOARD * ahead, facing(ahead))
    return place, Surface(origin, float(low - middle), float(high - middle))


def _apart(found: Sequence[tuple[Place, Surface]]) -> list[tuple[Place, Surface]]:
    """Places that differ: a face that is not straight along the cells is found in several rows."""
    kept: list[tuple[Place, Surface]] = []
    for each in found:
        if all(np.linalg.norm(each[0].position - other[0].position) > 0.3 for other in kept):
            kept.append(each)
    return kept
