"""The even parts of furniture, seen from above, that may be seats: how large they are, what stands
up beside them, and which of them are tables.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .outlines import connected, rectangle_axes
from .sitting_body import BACK_HIGH, HIPS, LEANS, RISES, SHORTEST, THIGH
from .surfaces import Columns

__all__ = ["CELL", "HIGHEST", "LOWEST", "SNAP", "Part", "even_parts"]

CELL = 0.03
"""Metres; of the cells in which furniture is looked at from above."""

# Heights are metres over the floor.
LOWEST = 0.22
"""Height of the lowest seat."""
HIGHEST = 0.85
"""Height of the highest seat."""
_STEP = 0.02
"""Between neighbouring cells of a part, at most: shells and hollows slope by 30 degrees."""
_LEAST = 0.035
"""Square metres of the smallest seat."""
_HOLE = 0.10
"""Square metres of the largest hole in a seat."""
_MOST_PARTS = 24
"""The largest parts are looked at; of a whole room, those that are nearest."""

# What is a table, a counter or a chest: higher than chairs, and longer than a bar stool's seat.
_TABLE_HIGH = 0.60
_TABLE_LONG = 0.60
_BED = (1.7, 0.75)
"""Length and width of what is a bed, however high it is."""
_ARMS = (0.15, 0.45)
"""Metres before a chair's back, where its arms are."""
_ARMS_APART = 0.75
"""Metres between a chair's arms, at most; a sofa's and a bed's are farther apart."""

_BESIDE = 0.08
"""Metres between the middles of a seat and of what stands up around it, where that is a back."""
_AROUND = 0.15
"""Metres around a part in which that is looked for."""
SNAP = np.cos(np.radians(30.0))
"""A direction is that of a side of the seat, if one differs by less."""


@dataclass(frozen=True)
class Part:
    """An even part of furniture: the ``places`` (N, 2) of its cells; which cells of ``columns`` it
    has (``mask``); ``heights`` (X, Y) of all even parts; its ``longer`` and ``shorter`` side (2,),
    the ``length`` and ``width`` of these; how much of their rectangle it ``fills``.
    """

    columns: Columns
    heights: np.ndarray
    mask: np.ndarray
    places: np.ndarray
    longer: np.ndarray
    shorter: np.ndarray
    length: float
    width: float
    fills: float

    @cached_property
    def middle(self) -> np.ndarray:
        return np.asarray(self.places.mean(axis=0))

    @cached_property
    def beside(self) -> tuple[np.ndarray, np.ndarray]:
        """What stands up beside it: places (N, 2), and in how many layers (N,) each does."""
        low, high = self.places.min(axis=0) - _AROUND, self.places.max(axis=0) + _AROUND
        over = Columns.between(self.height + RISES, self.height + BACK_HIGH)
        cells = np.argwhere((self.columns.layers & over) != 0)
        up = self.columns.field.middles(cells)
        near = ((up >= low) & (up <= high)).all(axis=1)
        layers = self.columns.layers[tuple(cells[near].T)] & over
        return up[near], np.array([int(bits).bit_count() for bits in layers])

    @cached_property
    def away(self) -> np.ndarray:
        """The direction (2,) away from what stands up beside it; nothing where that is all
        around.
        """
        up, tall = self.beside
        beside = (tall @ up) / tall.sum() - self.middle if len(up) else np.zeros(2)
        apart = float(np.linalg.norm(beside))
        return -beside / apart if apart > _BESIDE else np.zeros(2)

    @cached_property
    def height(self) -> float:
        return float(np.median(self.heights[self.mask]))

    @cached_property
    def lowest(self) -> float:
        return float(np.quantile(self.heights[self.mask], 0.05))

    @property
    def is_table(self) -> bool:
        is_bed = self.length > _BED[0] and self.width > _BED[1]
        if is_bed:
            under = Columns.between(0.15, self.height - RISES)
            is_bed = ((self.columns.layers[self.mask] & under) != 0).mean() > 0.5
        return self.height > _TABLE_HIGH and self.length > _TABLE_LONG and not is_bed

    @property
    def has_footrest(self) -> bool:
        """Whether it is a chair's seat, with its back and arms, and a footrest that goes on from
        it: legs cannot hang before the one, and nobody sits on the other.
        """
        deep = LEANS + THIGH < self.length < _BED[0]
        if not deep or abs(self.away @ self.longer) < SNAP:
            return False
        ahead = self.longer * np.sign(self.away @ self.longer)
        across = np.array([ahead[1], -ahead[0]])
        up = self.beside[0]
        along = up @ ahead - (self.places @ ahead).min()
        aside = up @ across - 0.5 * ((self.places @ across).min() + (self.places @ across).max())
        arms = aside[(along > _ARMS[0]) & (along < _ARMS[1])]
        left, right = arms[arms < -HIPS], arms[arms > HIPS]
        if not (len(left) and len(right)) or (along > LEANS + THIGH).any():
            return False
        return bool(right.min() - left.max() < _ARMS_APART)


def even_parts(seen: Columns, nearest: np.ndarray) -> list[Part]:
    """The even parts of furniture that have room for a body: the largest, of those that are nearest
    to a place (2,).
    """
    field = seen.field
    heights = _smoothed(field.top)
    heights = np.where((heights > LOWEST) & (heights < HIGHEST), heights, np.nan)
    numbers = connected(heights, _STEP)
    sizes = np.bincount(numbers[numbers >= 0])
    large = np.flatnonzero(sizes * field.cell**2 >= _LEAST)
    large = large[np.argsort(-sizes[large])]

    found = []
    for number in large:
        mask = _without_holes(numbers == number)
        cells = np.argwhere(mask)
        places = field.middles(cells)
        longer, shorter = rectangle_axes(field.middles(_ends_of_rows(cells)))
        length = float(np.ptp(places @ longer)) + field.cell
        width = float(np.ptp(places @ shorter)) + field.cell
        if length < 2.0 * HIPS or width < SHORTEST:
            continue
        fills = len(cells) * field.cell**2 / (length * width)
        hole = mask & (numbers != number)
        own = np.where(hole, np.median(heights[numbers == number]), heights)
        found.append(Part(seen, own, mask, places, longer, shorter, length, width, fills))

    if len(found) > _MOST_PARTS:
        found.sort(key=lambda part: float(np.linalg.norm(part.places - nearest, axis=1).min()))
    return found[:_MOST_PARTS]


def _smoothed(top: np.ndarray) -> np.ndarray:
    """Heights (X, Y) without slits between slats and cushions, tufts and single points."""
    padded = np.pad(top, 2, constant_values=-np.inf)
    around = np.lib.stride_tricks.sliding_window_view
    raised = around(padded, (3, 3)).max(axis=(-1, -2))
    closed = around(raised, (3, 3)).min(axis=(-1, -2))
    closed = np.pad(np.maximum(closed, top), 1, constant_values=-np.inf)
    nine = around(closed, (3, 3)).reshape(*top.shape, 9)
    return np.asarray(np.partition(nine, 4, axis=-1)[..., 4])


def _without_holes(mask: np.ndarray) -> np.ndarray:
    """A part (X, Y) with what it surrounds, where hips cover that: rings, frames with webbing."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    own = np.ix_(np.arange(rows[0], rows[-1] + 1), np.arange(columns[0], columns[-1] + 1))
    beside = np.pad(~mask[own], 1, constant_values=True)
    numbers = connected(np.where(beside, 0.0, np.nan), 0.0)
    sizes = np.bincount(numbers[beside])
    hole = beside & (numbers != numbers[0, 0]) & (sizes[numbers] * CELL**2 < _HOLE)
    filled = mask.copy()
    filled[own] |= hole[1:-1, 1:-1]
    return filled


def _ends_of_rows(cells: np.ndarray) -> np.ndarray:
    """The first and last cell (N, 2) of each row of sorted cells; their hull is that of all."""
    starts = np.flatnonzero(np.diff(cells[:, 0], prepend=-1))
    return cells[np.concatenate([starts, np.append(starts[1:], len(cells)) - 1])]
