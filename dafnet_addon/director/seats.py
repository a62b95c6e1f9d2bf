"""Finds where to sit on furniture, and which way to face, by its mesh.

A seat is where a body fits: an even part between knees' and hips' height carries its hips, the
thighs end at an edge or before it, legs hang there, the trunk has room, and, if it can be, a back
is within a lean's reach behind. Every even part of a piece is looked at from all of its sides.
"""

from bisect import bisect_left
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..core.errors import InputError
from ..core.nearby import extent
from ..core.paths import facing
from ..core.progress import stepwise, within
from ..core.root import forward_of
from ..core.series import runs
from ..core.softness import kind_by_name
from ..core.solids import Box, Mesh
from ..core.text import metres
from .outlines import connected, rectangle_axes
from .surfaces import Columns, columns, parts_of_surfaces

__all__ = ["MarkedSeat", "NoSeat", "SeatPlace", "mark_of", "on_a_seat", "seat_of", "seats_of"]

_CELL = 0.03
"""Metres; of the cells in which furniture is looked at from above."""
_MAX_CELLS = 1_000_000
"""Larger furniture is looked at more coarsely."""

# What is an even part. Heights are metres over the floor, unless they are said to be over the seat.
_LOWEST = 0.22
"""Height of the lowest seat."""
_HIGHEST = 0.85
"""Height of the highest seat."""
_TOPMOST = 0.95
"""What is higher is not looked down upon: it is over the seat, or stands behind it."""
_STEP = 0.02
"""Between neighbouring cells of a part, at most: shells and hollows slope by 30 degrees."""
_LEAST = 0.035
"""Square metres of the smallest seat."""
_HOLE = 0.10
"""Square metres of the largest hole in a seat."""
_MOST_PARTS = 24
"""The largest parts are looked at; of a whole room, those that are nearest."""
_SMALLEST = 0.15
"""Metres across, of the smallest furniture."""
_LARGEST = 15.0
"""Metres across, of the largest furniture."""

# What is a table, a counter or a chest: higher than chairs, and longer than a bar stool's seat.
_TABLE_HIGH = 0.60
_TABLE_LONG = 0.60
_BED = (1.7, 0.75)
"""Length and width of what is a bed, however high it is."""
_ARMS = (0.15, 0.45)
"""Metres before a chair's back, where its arms are."""
_ARMS_APART = 0.75
"""Metres between a chair's arms, at most; a sofa's and a bed's are farther apart."""
_TABLES = ("table", "desk")
"""Kinds by name, see ``core.softness``."""

# A body on it; metres to its front, its back and its sides.
_BEFORE_BACK = 0.22
"""Between the pelvis and the back that it leans against."""
_CLOSEST = 0.08
"""Between the pelvis and the back on the shallowest seat."""
_THIGH = 0.36
"""Between the pelvis and the edge, at most: shins hang before it."""
_LEANS = 0.62
"""Between the pelvis and a back, at most; one leans no further, but sits as at a bed's edge."""
_FROM_EDGE = 0.22
"""Between the pelvis and the front edge, where there is no back."""
_ON_IT = 0.12
"""Of seat before the pelvis, however shallow the seat is."""
_HIPS = 0.10
"""To each side; what carries them."""
_ELBOWS = 0.28
"""To each side, that a body needs between arms and from a wide seat's ends."""
_SHORTEST = 0.15
"""Of the shallowest seat from back to edge."""
_GAP = 0.35
"""Behind a seat, within which its back may stand."""
_RISES = 0.12
"""Over the seat: what is higher is a back or an arm."""
_BACK_HIGH = 0.60
"""Over the seat, up to which a back is one."""
_TALL_BACK = 6
"""Layers of a back that is one without doubt."""
_TRUNK = (0.15, 0.78)
"""Over the seat, where trunk and head are."""
_SHOULDERS = 0.15
"""To each side, that are free of arms and backs."""
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
_UNDER = 0.08
"""Around a root, in which its seat is looked for."""

# How good a seat is.
_AS_GOOD = 0.15
"""Seats whose goodness differs by less are chosen from by where one comes from."""
_OTHERS = 0.4
"""Seats that are worse by more than this are none."""
_LONG_EDGE = 0.5
"""How much better it is to sit along what is longer than wide, than across its end."""
_LONGER = 1.1
"""Length over width of that."""
_STRAIGHT = 0.86
"""Of its rectangle's area, that a part with straight sides has at least."""
_ROUND = (0.70, 1.2)
"""The same of what is round at least, whose length over width is at most that."""
_WIDE, _ROOMY = 0.6, 0.36
"""How much better it is to have so many metres for the pelvis' middle."""
_WIDER = 0.2
"""How much better it is to have a metre and a half of them."""
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
_BESIDE = 0.08
"""Metres between the middles of a seat and of what stands up around it, where that is a back."""
_AROUND = 0.15
"""Metres around a part in which that is looked for."""
_SEVERAL = 1.2
"""Metres of length, of seats for several: one sits square to their sides, at corners as well."""
_SNAP = np.cos(np.radians(30.0))
"""A direction is that of a side of the seat, if one differs by less."""
_SAME = 0.1
"""Metres from a place that is asked for, which make no difference."""
_NEAR = 0.3
"""Metres by which a better seat may be farther from a place that is asked for."""


class NoSeat(InputError):
    """There is nothing to sit on."""


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


@dataclass(frozen=True)
class MarkedSeat:
    """A seat as its maker marked it, in the words of glTF's OMI_seat: where the ``back`` and hips
    are at most, the hollow of the ``knee``, and the ``foot`` (3,); metres, world. ``angle``:
    between thighs and spine, radians.
    """

    back: np.ndarray
    foot: np.ndarray
    knee: np.ndarray
    angle: float = 0.5 * np.pi

    def place(self) -> SeatPlace | None:
        """Where somebody sits on it, thighs ending at the knee or before it; None where back and
        knee are one over the other.
        """
        ahead = (self.knee - self.back) * (1.0, 1.0, 0.0)
        deep = float(np.linalg.norm(ahead))
        if deep < _SHORTEST:
            return None
        pelvis = min(max(_BEFORE_BACK, deep - _THIGH), max(0.5 * deep, deep - _ON_IT))
        at = self.back + pelvis / deep * (self.knee - self.back)
        return SeatPlace(
            position=at[:2],
            yaw=facing(ahead[:2]),
            height=float(at[2]),
            back=True,
            aside=0.0,
            edge=deep - pelvis,
        )

    def resized(self, factor: float) -> "MarkedSeat":
        """The same ``factor`` times as large, about the world's origin."""
        return MarkedSeat(factor * self.back, factor * self.foot, factor * self.knee, self.angle)


def mark_of(place: SeatPlace, floor: float) -> MarkedSeat:
    """What is marked where a seat was found."""
    ahead = np.array([*forward_of(place.yaw), 0.0])
    at = np.array([*place.position, place.height])
    knee = at + place.edge * ahead
    return MarkedSeat(back=at - _BEFORE_BACK * ahead, foot=np.array([*knee[:2], floor]), knee=knee)


@dataclass(frozen=True)
class _Part:
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
        over = Columns.between(self.height + _RISES, self.height + _BACK_HIGH)
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
            under = Columns.between(0.15, self.height - _RISES)
            is_bed = ((self.columns.layers[self.mask] & under) != 0).mean() > 0.5
        return self.height > _TABLE_HIGH and self.length > _TABLE_LONG and not is_bed

    @property
    def has_footrest(self) -> bool:
        """Whether it is a chair's seat, with its back and arms, and a footrest that goes on from
        it: legs cannot hang before the one, and nobody sits on the other.
        """
        deep = _LEANS + _THIGH < self.length < _BED[0]
        if not deep or abs(self.away @ self.longer) < _SNAP:
            return False
        ahead = self.longer * np.sign(self.away @ self.longer)
        across = np.array([ahead[1], -ahead[0]])
        up = self.beside[0]
        along = up @ ahead - (self.places @ ahead).min()
        aside = up @ across - 0.5 * ((self.places @ across).min() + (self.places @ across).max())
        arms = aside[(along > _ARMS[0]) & (along < _ARMS[1])]
        left, right = arms[arms < -_HIPS], arms[arms > _HIPS]
        if not (len(left) and len(right)) or (along > _LEANS + _THIGH).any():
            return False
        return bool(right.min() - left.max() < _ARMS_APART)


@dataclass(frozen=True)
class _Fit:
    """How a body fits on one line across a seat: ``ahead`` and ``edge``: metres along the direction
    that it faces; ``height``; ``back``: within reach; ``goodness``.
    """

    ahead: float
    edge: float
    height: float
    back: bool
    goodness: float


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
    tables: bool = False,
) -> Generator[float, None, SeatPlace]:
    """The first of ``seats_of``."""
    found = yield from seats_of.steps(solids, towards, floor, name, near, size, tables)
    return found[0]


@stepwise
def seats_of(
    solids: Sequence[Box | Mesh],
    towards: np.ndarray,
    floor: float = 0.0,
    name: str = "furniture",
    near: np.ndarray | None = None,
    size: float = 1.0,
    tables: bool = False,
) -> Generator[float, None, list[SeatPlace]]:
    """Where to sit on furniture made of ``solids``, the best place first; world, metres, people of
    1.75 m.

    Before a back, facing away from it, where there is one. Without a back, facing across the seat,
    on the side where ``towards`` (2,) lies; so on beds, at a long edge. Of places that are as good,
    the nearest to there, each in the middle of where one may sit; or by ``near`` (2,) where it is
    given. Raises NoSeat where there is nothing to sit on, which is an even part between 22 and
    85 cm over ``floor`` that a body fits on, or where there are only ``tables`` and these do not
    count, or armchairs with their footrest before them. ``size``: of the character, over 1.75 m, by
    which messages give lengths.
    """
    own = solids
    if not tables:
        own = [each for each in solids if kind_by_name(each.name) not in _TABLES]
        if not own or kind_by_name(name) in _TABLES:
            raise NoSeat(_a_table(name))

    points = yield from within(parts_of_surfaces.steps(own, 0.6 * _CELL), 0.0, 0.5)
    job = columns.steps(points, floor, _CELL, _TOPMOST, _MAX_CELLS)
    seen = yield from within(job, 0.5, 0.6)
    parts = _even_parts(seen, towards if near is None else near) if seen is not None else []
    yield 0.7

    found: list[tuple[float, SeatPlace]] = []
    only_tables = footrests = False
    for k, part in enumerate(parts):
        if part.has_footrest:
            footrests = True
            continue
        is_table = part.is_table
        for way in _ways(part, towards):
            fits = [(good, each) for good, each in _fits(part, way, near, floor)]
            if is_table and not tables:
                only_tables |= any(not each.back for _, each in fits)
                fits = [(good, each) for good, each in fits if each.back]
            found += fits
            yield 0.7 + 0.3 * k / len(parts)

    if not found and footrests:
        raise NoSeat(
            f"The footrest of '{name}' is where one comes to sit; take it away, or choose another "
            "seat."
        )
    if not found:
        raise NoSeat(_a_table(name) if only_tables else _why_not_a_seat(solids, name, size))
    return _ordered(found, towards, near)


def _smoothed(top: np.ndarray) -> np.ndarray:
    """Heights (X, Y) without slits between slats and cushions, tufts and single points."""
    padded = np.pad(top, 2, constant_values=-np.inf)
    around = np.lib.stride_tricks.sliding_window_view
    raised = around(padded, (3, 3)).max(axis=(-1, -2))
    closed = around(raised, (3, 3)).min(axis=(-1, -2))
    closed = np.pad(np.maximum(closed, top), 1, constant_values=-np.inf)
    nine = around(closed, (3, 3)).reshape(*top.shape, 9)
    return np.asarray(np.partition(nine, 4, axis=-1)[..., 4])


def _even_parts(seen: Columns, nearest: np.ndarray) -> list[_Part]:
    """The even parts of furniture that have room for a body: the largest, of those that are nearest
    to a place (2,).
    """
    field = seen.field
    heights = _smoothed(field.top)
    heights = np.where((heights > _LOWEST) & (heights < _HIGHEST), heights, np.nan)
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
        if length < 2.0 * _HIPS or width < _SHORTEST:
            continue
        fills = len(cells) * field.cell**2 / (length * width)
        hole = mask & (numbers != number)
        own = np.where(hole, np.median(heights[numbers == number]), heights)
        found.append(_Part(seen, own, mask, places, longer, shorter, length, width, fills))

    if len(found) > _MOST_PARTS:
        found.sort(key=lambda part: float(np.linalg.norm(part.places - nearest, axis=1).min()))
    return found[:_MOST_PARTS]


def _without_holes(mask: np.ndarray) -> np.ndarray:
    """A part (X, Y) with what it surrounds, where hips cover that: rings, frames with webbing."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    own = np.ix_(np.arange(rows[0], rows[-1] + 1), np.arange(columns[0], columns[-1] + 1))
    beside = np.pad(~mask[own], 1, constant_values=True)
    numbers = connected(np.where(beside, 0.0, np.nan), 0.0)
    sizes = np.bincount(numbers[beside])
    hole = beside & (numbers != numbers[0, 0]) & (sizes[numbers] * _CELL**2 < _HOLE)
    filled = mask.copy()
    filled[own] |= hole[1:-1, 1:-1]
    return filled


def _ends_of_rows(cells: np.ndarray) -> np.ndarray:
    """The first and last cell (N, 2) of each row of sorted cells; their hull is that of all."""
    starts = np.flatnonzero(np.diff(cells[:, 0], prepend=-1))
    return cells[np.concatenate([starts, np.append(starts[1:], len(cells)) - 1])]


def _ways(part: _Part, towards: np.ndarray) -> list[np.ndarray]:
    """Directions (2,) in which one may face on a part: those of its sides, and away from what
    stands up beside it; to ``towards`` on what is round.
    """
    sides = [part.longer, -part.longer, part.shorter, -part.shorter]
    straight = part.fills > _STRAIGHT
    if part.away.any():
        beside_a_side = straight and max(part.away @ side for side in sides) > _SNAP
        if beside_a_side or part.length > _SEVERAL:
            return sides
        is_round = part.fills > _ROUND[0] and part.length < _ROUND[1] * part.width
        return [*_crossed(part.away), *([] if is_round and not straight else sides)]
    if straight or not (towards - part.middle).any():
        return sides
    to = towards - part.middle
    return _crossed(to / np.linalg.norm(to))


def _crossed(way: np.ndarray) -> list[np.ndarray]:
    """A direction (2,) and the three that are square to it."""
    across = np.array([way[1], -way[0]])
    return [way, -way, across, -across]


def _fits(
    part: _Part, way: np.ndarray, near: np.ndarray | None, floor: float
) -> list[tuple[float, SeatPlace]]:
    """How good it is to sit on a part, facing a ``way`` (2,), and where: a place for each stretch
    of it, in its middle or by ``near`` (2,).
    """
    line = _Lines(part, way)
    fits = [line.fit(k) for k in range(len(line.aside))]
    stretches, last = [], None
    for k, fit in enumerate(fits):
        if fit is None:
            last = None
        elif last is None or abs(fit.ahead - last.ahead) > 0.15 or fit.back != last.back:
            stretches.append([k])
            last = fit
        else:
            stretches[-1].append(k)
            last = fit

    found = []
    across = np.array([way[1], -way[0]])
    for stretch in stretches:
        first, end = line.aside[stretch[0]], line.aside[stretch[-1]]
        middle = 0.5 * (first + end)
        # What ends by an arm is kept clear of it already.
        by_arms = [line.carries(stretch[0] - 1), line.carries(stretch[-1] + 1)]
        kept = _SHOULDERS + part.columns.field.cell if all(by_arms) else 0.4 * _HIPS
        room = max(0.0, 0.5 * (end - first) - (_ELBOWS - kept))
        if near is not None:
            at = float(np.clip(near @ across, middle - room, middle + room))
        elif room < 0.1:
            at = float(np.clip(line.middle, first, end))
        else:
            at = middle
        fit = fits[stretch[int(np.argmin(np.abs(line.aside[stretch] - at)))]]
        assert fit is not None
        good = float(np.median([fits[k].goodness for k in stretch]))  # type: ignore[union-attr]
        good += _WIDE * min(1.0, (end - first) / _ROOMY) + _WIDER * min(1.0, (end - first) / 1.5)
        place = SeatPlace(
            position=fit.ahead * way + at * across,
            yaw=facing(way),
            height=floor + fit.height,
            back=fit.back,
            aside=room,
            edge=fit.edge - fit.ahead,
        )
        found.append((good, place))
    return found


class _Lines:
    """A part seen along the direction that a body faces: columns along lines that lie side by side,
    ``aside`` (S,) metres to the right of the origin.
    """

    def __init__(self, part: _Part, way: np.ndarray) -> None:
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
        return bool(self._carried(self._columns(k, _HIPS)).any())

    def _carried(self, hips: slice) -> np.ndarray:
        """The rows in which enough of the seat is under ``hips``."""
        within = self._counts[:, hips.stop] - self._counts[:, hips.start]
        return np.asarray(within / (hips.stop - hips.start) >= 0.6)

    def fit(self, k: int) -> _Fit | None:
        """How a body fits on line ``k``; None where it does not."""
        hips = self._columns(k, _HIPS)
        carried = self._carried(hips)
        best: _Fit | None = None
        for first, last in runs(carried, gap=2):
            if (last - first) * self._cell < _SHORTEST:
                continue
            found = self._on(k, first, last, hips)
            if found is not None and (best is None or found.goodness > best.goodness):
                best = found
        return best

    def _on(self, k: int, first: int, last: int, hips: slice) -> _Fit | None:
        """How a body fits on the rows from ``first`` to ``last`` (exclusive)."""
        begins, ends = self.along[first] - 0.5 * self._cell, self.along[last - 1] + 0.5 * self._cell
        level = _median(self._heights[first:last, hips])
        middle = 0.5 * (begins + ends)
        trunk = self._columns(k, 0.12)

        over = Columns.between(level + _RISES, level + _BACK_HIGH)
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
            thigh = _THIGH + self._rise_before(ends, hips)
            ahead = max(back + _BEFORE_BACK, ends - thigh)
            ahead = min(ahead, max(middle, ends - _ON_IT))
            if ahead - back < _CLOSEST:
                return None
            if ahead - back > _LEANS:
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
            self._rows(ahead - 0.05, ahead + 0.05), self._columns(k, _SHOULDERS)
        ]
        if (shoulders & Columns.between(height + 0.25, height + _BACK_HIGH)).any():
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
        return _Fit(float(ahead), float(ends), height, back is not None, good)

    def _rise_before(self, ends: float, hips: slice) -> float:
        """Metres by which a hollow seat rises to its edge, over which the knees then lie."""
        front = self._heights[self._rows(ends - 0.09, ends), hips]
        hollow = self._heights[self._rows(ends - _THIGH - 0.09, ends - _THIGH), hips]
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


def _ordered(
    found: Sequence[tuple[float, SeatPlace]], towards: np.ndarray, near: np.ndarray | None
) -> list[SeatPlace]:
    """The places, the best first, without those that are far worse."""

    def away(place: SeatPlace) -> tuple[float, float]:
        before = place.position + 0.5 * forward_of(place.yaw)
        to = float(np.linalg.norm(before - towards))
        lap = place.position + 0.1 * forward_of(place.yaw)
        by = 0.0 if near is None else float(np.linalg.norm(lap - near))
        return round(by / _SAME), to

    if near is not None:
        nearest = min(away(place)[0] for _, place in found)
        found = [each for each in found if away(each[1])[0] < nearest + _NEAR / _SAME]
    best = max(good for good, _ in found)
    rest = [each for each in found if each[0] > best - _OTHERS]
    rest.sort(key=lambda each: (each[0] < best - _AS_GOOD, away(each[1])))
    return [place for _, place in rest]


def _a_table(name: str) -> str:
    return f"'{name}' is a table; choose a seat, or ask for a table to be sat on."


def _why_not_a_seat(solids: Sequence[Box | Mesh], name: str, size: float) -> str:
    """What to say of a piece of furniture that nobody can sit on."""
    across = extent(solids)
    if not _SMALLEST < across < _LARGEST:
        return (
            f"'{name}' is {metres(across * size)} across: is its unit right? Scale it to the "
            "character's size."
        )
    return (
        f"'{name}' has no level surface between {100 * _LOWEST * size:.0f} and "
        f"{100 * _HIGHEST * size:.0f} cm over the floor to sit on; choose a seat."
    )
