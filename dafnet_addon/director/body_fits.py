"""How a body fits on an even part of furniture, facing one way: line by line across it, where its
hips are carried, its thighs end, its legs hang and its trunk has room, and how near a back is.
"""

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np

from ..core.series import runs
from .even_parts import Part
from .sitting_body import (
    BACK_HIGH,
    BEFORE_BACK,
    HIPS,
    LEANS,
    ON_IT,
    RISES,
    SHORTEST,
    SHOULDERS,
    THIGH,
)
from .surfaces import Columns

__all__ = ["Fit", "Lines"]

# Metres to the body's front, back and sides, or over the seat.
_CLOSEST = 0.08
"""Between the pelvis and the back on the shallowest seat."""
_FROM_EDGE = 0.22
"""Between the pelvis and the front edge, where there is no back."""
_GAP = 0.35
"""Behind a seat, within which its back may stand."""
_TALL_BACK = 6
"""Layers of a back that is one without doubt."""
_TRUNK = (0.15, 0.78)
"""Over the seat, where trunk and head are."""
_LAP = 0.30
"""Before the pelvis, over which nothing may hang."""
_LEVEL = 0.06
"""From one hip to the other, that a seat may slope."""
_RIM = 0.07
"""Beyond the edge, where an arm or a rim stands that is in the way of legs; a table's edge is
farther.
"""
_LEGS = (0.06, 0.22)
"""Beyond the edge, where shins hang."""
_HANGS = 0.16
"""Under the seat, that shins need there at least: before a pillow there is none of it."""
_STANDS = (0.46, 0.60)
"""Before the pelvis, where one stands who is about to sit down."""
_BODY = Columns.between(0.2, 1.4)
"""The layers over the floor, in which he stands."""

# How good a seat is.
_LONG_EDGE = 0.5
"""How much better it is to sit along what is longer than wide, than across its end."""
_LONGER = 1.1
"""Length over width of that."""
_AWAY = 0.5
"""How much better it is to face away from all that stands up beside a seat."""
_ASKEW = 2.0
"""How much worse it is to lean against a back that runs away by its whole width."""
_TOO_HIGH, _UPHILL = 3.0, 2.0
"""How much worse a metre over or under the most comfortable heights is, and one over the lowest
place of the same part.
"""
_COMFORTABLE = 0.45
"""Height of the most comfortable seat."""


@dataclass(frozen=True)
class Fit:
    """How a body fits on one line across a seat: ``ahead`` and ``edge``: metres along the direction
    that it faces; ``height``; ``back``: within reach; ``goodness``.
    """

    ahead: float
    edge: float
    height: float
    back: bool
    goodness: float


class Lines:
    """A part seen along the direction that a body faces: columns along lines that lie side by side,
    ``aside`` (S,) metres to the right of the origin.
    """

    def __init__(self, part: Part, way: np.ndarray) -> None:
        field = part.columns.field
        self._part, self._cell = part, field.cell
        across = np.array([way[1], -way[0]])
        along, aside = part.places @ way, part.places @ across
        self._wide = round(0.15 / field.cell)
        self.along = np.arange(along.min() - 0.42, along.max() + 0.66, field.cell)
        self._rows_at = self.along.tolist()
        margin = self._wide * field.cell
        wide = np.arange(aside.min() - margin, aside.max() + margin + 1e-6, field.cell)
        self.aside = wide[self._wide : len(wide) - self._wide]
        points = self.along[:, None, None] * way + wide[:, None] * across
        _, self._layers = part.columns.at(points)
        cells = field.index(points)
        inside = ((cells >= 0) & (cells < part.mask.shape)).all(axis=-1)
        at = tuple(np.moveaxis(np.where(inside[..., None], cells, 0), -1, 0))
        self._mask = part.mask[at] & inside
        self._heights = np.where(self._mask, part.heights[at], np.nan)
        self._counts = np.pad(np.cumsum(self._mask, axis=1), ((0, 0), (1, 0)))
        long = part.length > _LONGER * part.width
        self.middle = 0.5 * float(aside.min() + aside.max())
        self._away = _AWAY * float(part.away @ way)
        self._bonus = _LONG_EDGE if long and abs(way @ part.shorter) > 0.9 else 0.0

    def _rows(self, low: float, high: float) -> slice:
        """Between two distances along the direction."""
        return slice(bisect_left(self._rows_at, low), bisect_left(self._rows_at, high))

    def _columns(self, k: int, half: float) -> slice:
        reach = min(self._wide, round(half / self._cell))
        return slice(k + self._wide - reach, k + self._wide + reach + 1)

    def carries(self, k: int) -> bool:
        """Whether a line has enough of the seat under hips."""
        if not 0 <= k < len(self.aside):
            return False
        return bool(self._carried(self._columns(k, HIPS)).any())

    def _carried(self, hips: slice) -> np.ndarray:
        """The rows in which enough of the seat is under ``hips``."""
        within = self._counts[:, hips.stop] - self._counts[:, hips.start]
        return np.asarray(within / (hips.stop - hips.start) >= 0.6)

    def fit(self, k: int) -> Fit | None:
        """How a body fits on line ``k``; None where it does not."""
        hips = self._columns(k, HIPS)
        carried = self._carried(hips)
        best: Fit | None = None
        for first, last in runs(carried, gap=2):
            if (last - first) * self._cell < SHORTEST:
                continue
            found = self._on(k, first, last, hips)
            if found is not None and (best is None or found.goodness > best.goodness):
                best = found
        return best

    def _on(self, k: int, first: int, last: int, hips: slice) -> Fit | None:
        """How a body fits on the rows from ``first`` to ``last`` (exclusive)."""
        begins, ends = self.along[first] - 0.5 * self._cell, self.along[last - 1] + 0.5 * self._cell
        level = _median(self._heights[first:last, hips])
        middle = 0.5 * (begins + ends)
        trunk = self._columns(k, 0.12)

        over = Columns.between(level + RISES, level + BACK_HIGH)
        behind = self._rows(begins - _GAP, ends - 0.15)
        rising = self._layers[behind, self._columns(k, 0.10)] & over
        third = rising.shape[1] // 3
        nearest, askew = _back((rising[:, :third], rising[:, third:-third], rising[:, -third:]))
        back = None
        tall_back = facing_away = 0.0
        if nearest >= 0:
            back = self.along[behind][nearest] + 0.5 * self._cell
            tall = np.bitwise_or.reduce(rising[max(0, nearest - 8) : nearest + 1], axis=None)
            tall_back = min(1.0, int(tall).bit_count() / _TALL_BACK)
            tall_back -= _ASKEW * max(0.0, askew * self._cell / 0.2 - 0.2)
            facing_away = self._away
            thigh = THIGH + self._rise_before(ends, hips)
            ahead = max(back + BEFORE_BACK, ends - thigh)
            ahead = min(ahead, max(middle, ends - ON_IT))
            if ahead - back < _CLOSEST:
                return None
            if ahead - back > LEANS:
                back = None
        if back is None:
            ahead, tall_back, facing_away = max(middle, ends - _FROM_EDGE), 0.0, 0.0

        patch = self._rows(ahead - 0.08, ahead + 0.08)
        if _share(self._mask[patch, hips]) < 0.7:
            return None
        height = _median(self._heights[patch, hips])
        slope = self._heights[patch, hips.stop - 1] - self._heights[patch, hips.start]
        if np.isfinite(slope).any() and abs(_median(slope)) > _LEVEL:
            return None

        lap = self._layers[self._rows(ahead - 0.08, ahead + _LAP), hips]
        if (lap & Columns.between(height + _TRUNK[0], height + _TRUNK[1])).any():
            return None

        shoulders = self._layers[
            self._rows(ahead - 0.05, ahead + 0.05), self._columns(k, SHOULDERS)
        ]
        if (shoulders & Columns.between(height + 0.25, height + BACK_HIGH)).any():
            return None

        rim = self._layers[self._rows(ends, ends + _RIM), trunk]
        risen = (rim & Columns.between(height + 0.09, height + 0.25)) != 0
        if (risen.mean(axis=1) > 0.3).any():
            return None
        legs = self._layers[self._rows(ends + _LEGS[0], ends + _LEGS[1]), trunk]
        hang = _share(legs & Columns.between(height - _HANGS, height + 0.11)) < 0.2
        stands = self._layers[self._rows(ahead + _STANDS[0], ahead + _STANDS[1]), trunk]
        stand = _share(stands & _BODY) < 0.1
        good = tall_back + 1.0 * hang + 0.5 * stand
        good -= _TOO_HIGH * max(0.0, abs(height - _COMFORTABLE) - 0.1)
        good -= _UPHILL * max(0.0, height - self._part.lowest)
        good += self._bonus if back is None else facing_away
        return Fit(float(ahead), float(ends), height, back is not None, good)

    def _rise_before(self, ends: float, hips: slice) -> float:
        """Metres by which a hollow seat rises to its edge, over which the knees then lie."""
        front = self._heights[self._rows(ends - 0.09, ends), hips]
        hollow = self._heights[self._rows(ends - THIGH - 0.09, ends - THIGH), hips]
        if not (np.isfinite(front).any() and np.isfinite(hollow).any()):
            return 0.0
        return float(np.clip(_median(front) - _median(hollow), 0.0, 0.1))


def _share(values: np.ndarray) -> float:
    """Of the values, those that are not 0; NaN where there are no values."""
    return float(np.count_nonzero(values) / values.size) if values.size else float("nan")


def _median(values: np.ndarray) -> float:
    """Of the heights that are known; NaN where none is."""
    known = np.sort(values[np.isfinite(values)], axis=None)
    if not len(known):
        return float("nan")
    return float(0.5 * (known[(len(known) - 1) // 2] + known[len(known) // 2]))


def _back(thirds: tuple[np.ndarray, np.ndarray, np.ndarray]) -> tuple[int, int]:
    """The row (-1 where there is none) up to which a back reaches that stands up in the ``thirds``
    (R, C) of a trunk's width: behind its middle, or behind both its sides; and by how many rows its
    sides differ.
    """
    left, middle, right = (
        int(np.flatnonzero(third.any(axis=1))[-1]) if third.any() else -1 for third in thirds
    )
    both = min(left, right)
    return max(middle, both), abs(left - right) if both >= 0 else 0
