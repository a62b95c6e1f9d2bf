"""Ways around furniture, and root paths that follow them to a seat or to a place to stand."""

import heapq
from collections.abc import Generator, Sequence
from itertools import pairwise

import numpy as np

from ..core.errors import InputError
from ..core.paths import AFTER_SEAT, Route, Stop, route
from ..core.progress import stepwise, within
from ..core.root import forward_of
from ..core.series import MODEL_FPS
from ..core.solids import Box, Mesh
from ..core.text import metres
from ..core.units import FURNITURE, likely_unit
from .room import HEAD_HIGH, KNEE_LOW
from .surfaces import HeightField, boxes_of, height_field, parts_of_surfaces

__all__ = ["AlreadyThere", "NoWay", "around", "unit_doubt", "walk_to", "way_round", "ways"]

_CELL = 0.08
"""Metres; of the cells that ways are searched over."""
_RADIUS = 0.30
"""Metres that the body's middle keeps from furniture."""
_AROUND = 2.0
"""Metres of floor beyond start and goal in which ways are looked for."""
_FARTHEST = 100.0
"""Metres between start and goal; so many cells are searched in seconds."""
_NEAREST = 0.3
"""Metres between start and goal, under which one is there already."""
_APART = 0.25
"""Metres between the corners of a way, at least: a path needs some length to turn."""

# What tells that a scene's unit is wrong.
_TINY = 1.0
"""Metres across: rooms are larger."""
_SMALLEST = 0.15
"""Metres, of the longest side of furniture."""
_TALLEST = 15.0
"""Metres over the floor, of furniture."""
_LOW = 0.05
"""Height over length, of what is long and low: ground, rugs, skirting."""
_BESIDE = 10.0
"""Metres from a way within which furniture tells the scene's unit."""

# How much is done between two steps of the job.
_SAMPLED = 0.3
"""Progress of a search once the furniture's points are made."""
_CELLS_AT_ONCE = 5_000
_WAVES_AT_ONCE = 200
_ROWS_AT_ONCE = 100

_AHEAD = 500
"""Cells within which a way is cut short."""
_NEIGHBOURS = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]


def _blocked(field: HeightField, radius: float) -> Generator[float, None, np.ndarray]:
    """Cells within ``radius`` of one that has something in it."""
    full = np.isfinite(field.top)
    reach = int(np.floor(radius / field.cell))
    out = full.copy()
    padded = np.pad(full, reach)
    nx, ny = full.shape
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            if (i * i + j * j) * field.cell**2 <= radius**2:
                out |= padded[reach + i : reach + i + nx, reach + j : reach + j + ny]
        yield (reach + i) / (2 * reach + 1)

    return out


def _nearest_free(blocked: np.ndarray, cell: np.ndarray) -> tuple[int, int] | None:
    free = np.argwhere(~blocked)
    if not len(free):
        return None
    i, j = free[np.argmin(((free - cell) ** 2).sum(1))]
    return int(i), int(j)


def _search(
    blocked: np.ndarray, start: tuple[int, int], goal: tuple[int, int]
) -> Generator[float, None, list[tuple[int, int]] | None]:
    """A* over eight neighbours; no corner is cut."""
    # One row of blocked cells around all, and plain lists over its cells: the same search over
    # pairs takes ten times as long.
    walls = np.pad(blocked, 1, constant_values=True)
    width = walls.shape[1]
    first, last = ((cell[0] + 1) * width + cell[1] + 1 for cell in (start, goal))
    if not (yield from _connected(walls, first, last)):
        return None

    left: list[float] = []
    down, across = goal[0] + 1 - np.arange(len(walls)), goal[1] + 1 - np.arange(width)
    for k in range(0, len(walls), _ROWS_AT_ONCE):
        left += np.hypot(down[k : k + _ROWS_AT_ONCE, None], across).ravel().tolist()
        yield 0.0

    closed = bytearray(walls.tobytes())
    wall = bytes(closed)
    steps = [(i * width + j, i * width, j, float(np.hypot(i, j))) for i, j in _NEIGHBOURS]
    cost: dict[int, float] = {first: 0.0}
    came: dict[int, int] = {}
    queue = [(0.0, first)]
    tried, nearest = 0, left[first]
    while queue:
        _, at = heapq.heappop(queue)
        if at == last:
            path = [at]
            while path[-1] in came:
                path.append(came[path[-1]])
            return [(cell // width - 1, cell % width - 1) for cell in path[::-1]]

        if closed[at]:
            continue

        closed[at] = 1
        tried += 1
        if tried % _CELLS_AT_ONCE == 0:
            nearest = min(nearest, left[at])
            yield 1.0 - nearest / left[first]

        here = cost[at]
        for step, down_by, across_by, length in steps:
            to = at + step
            if wall[to] or (down_by and across_by and (wall[at + down_by] or wall[at + across_by])):
                continue

            total = here + length
            if total < cost.get(to, np.inf):
                cost[to], came[to] = total, at
                heapq.heappush(queue, (total + left[to], to))

    return None


def _connected(walls: np.ndarray, first: int, last: int) -> Generator[float, None, bool]:
    """Whether there is a way at all: a wave over the free cells finds out at once, while the search
    would try them all.
    """
    free = ~walls.ravel()
    front, waves = np.array([first]), 0
    while len(front) and free[last]:
        free[front] = False
        front = (front[:, None] + np.array([1, -1, walls.shape[1], -walls.shape[1]])).ravel()
        front = np.unique(front[free[front]])
        waves += 1
        if waves % _WAVES_AT_ONCE == 0:
            yield 0.0

    return not free[last]


def _clear(blocked: np.ndarray, a: np.ndarray, b: np.ndarray) -> bool:
    """Whether the straight line between two cells is free."""
    steps = max(2, int(2 * np.abs(b - a).max()) + 1)
    cells = np.round(a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a)).astype(int)
    return not blocked[cells[:, 0], cells[:, 1]].any()


@stepwise
def way_round(
    points: np.ndarray,
    start: np.ndarray,
    goal: np.ndarray,
    size: float = 1.0,
    beyond: float = _AROUND,
) -> Generator[float, None, list[tuple[float, float]]]:
    """Corners (x, y) of a short way from ``start`` (2,) to ``goal`` (2,), without these, around
    furniture with surface ``points`` (N, 3), z over the floor.

    Raises InputError where there is no way, or the goal is too far away. ``size``: of the
    character, over 1.75 m, by which messages give lengths. ``beyond``: metres beyond start and goal
    in which the way is looked for.
    """
    return (yield from _way([points], start, goal, 0.0, size, beyond))


@stepwise
def ways(
    solids: Sequence[Box | Mesh],
    places: Sequence[np.ndarray],
    *,
    floor: float = 0.0,
    size: float = 1.0,
    spacing: float = 0.6 * _CELL,
) -> Generator[float, None, list[list[tuple[float, float]]]]:
    """``way_round`` the furniture from each of the ``places`` (2,) to the next.

    ``spacing``: metres between points on the furniture. Raises InputError as ``way_round`` does, or
    asks for the scene's unit where there is no way in a scene that is plainly of another one.
    """
    points = yield from within(
        parts_of_surfaces.steps(solids, spacing, around(places)), 0.0, _SAMPLED
    )
    found, one = [], (1.0 - _SAMPLED) / max(1, len(places) - 1)
    for k, (start, goal) in enumerate(pairwise(places)):
        leg = _way(points, start, goal, floor, size)
        done = _SAMPLED + k * one
        try:
            found.append((yield from within(leg, done, done + one)))
        except NoWay as error:
            if doubt := unit_doubt(solids, places, floor, size):
                raise InputError(doubt) from error
            raise

    return found


class AlreadyThere(InputError):
    """The goal is where one starts."""


class NoWay(InputError):
    """Furniture stands all round the start or the goal."""


def _way(
    parts: Sequence[np.ndarray],
    start: np.ndarray,
    goal: np.ndarray,
    floor: float,
    size: float,
    beyond: float = _AROUND,
) -> Generator[float, None, list[tuple[float, float]]]:
    """``way_round`` points in ``parts``, whose z is over the world's zero."""
    both = np.stack([start, goal])
    if not np.abs(goal - start).max() <= _FARTHEST:
        raise InputError(
            f"The goal is {np.linalg.norm(goal - start) * size:,.0f} m away: is the scene's unit "
            f"right? Choose one within {_FARTHEST * size:.0f} m, or walk there in parts."
        )

    field = height_field(np.zeros((0, 3)), *around(both, beyond), _CELL)
    for k, part in enumerate(parts):
        over = part - np.array([0.0, 0.0, floor])
        field.add(over[(over[:, 2] > KNEE_LOW) & (over[:, 2] < HEAD_HIGH)])
        yield 0.2 * k / len(parts)

    blocked = yield from within(_blocked(field, _RADIUS), 0.2, 0.2)

    ends = []
    for end in both:
        ends.append(_nearest_free(blocked, field.index(end)))
        yield 0.2

    path = (
        None if None in ends else (yield from within(_search(blocked, *ends), 0.2, 0.9))  # type: ignore[arg-type]
    )
    if path is None:
        raise NoWay(
            "There is no way between the furniture from the character to where it is to go; make "
            "room for it."
        )

    cells = np.array(path)
    corners, at = [], 0
    while at < len(cells) - 1:
        yield 0.9 + 0.1 * at / len(cells)
        farthest = min(len(cells) - 1, at + _AHEAD)
        ahead = next(
            k
            for k in range(farthest, at, -1)
            if k == at + 1 or _clear(blocked, cells[at], cells[k])
        )
        corners.append(ahead)
        at = ahead

    middles = field.middles(cells[corners]) if corners else np.zeros((0, 2))
    return [(float(x), float(y)) for x, y in _apart(middles, start, goal)]


def _apart(points: np.ndarray, start: np.ndarray, goal: np.ndarray) -> list[np.ndarray]:
    """The points that are at least ``_APART`` from one another and from both ends."""
    kept: list[np.ndarray] = []
    for point in points:
        if (
            np.linalg.norm(point - (kept[-1] if kept else start)) > _APART
            and np.linalg.norm(point - goal) > _APART
        ):
            kept.append(point)
    return kept


@stepwise
def walk_to(
    solids: Sequence[Box | Mesh],
    start: Stop,
    goal: Stop,
    speed: float = 1.1,
    fps: float = MODEL_FPS,
    floor: float = 0.0,
    size: float = 1.0,
) -> Generator[float, None, Route]:
    """The root path from rest at ``start`` to rest at ``goal`` that goes round the furniture;
    metres, people of 1.75 m.

    A seat is left and reached from its front. Raises InputError where there is no way, or start and
    goal are the same or too far apart. ``size``: see ``way_round``.
    """
    if np.linalg.norm(np.subtract(start.position, goal.position)) < _NEAREST:
        if doubt := unit_doubt(solids, [np.array(start.position)], floor, size):
            raise InputError(doubt)
        raise AlreadyThere("The character is there already; choose another place to go to.")
    leaves = _ahead(start, min(AFTER_SEAT, start.before))
    comes = _ahead(goal, goal.before)
    (corners,) = yield from ways.steps(solids, [leaves, comes], floor=floor, size=size)
    return route(start, *corners, goal, speed=speed, fps=fps, floor=floor)


@stepwise
def unit_doubt(
    solids: Sequence[Box | Mesh],
    places: Sequence[np.ndarray] | np.ndarray,
    floor: float = 0.0,
    size: float = 1.0,
) -> Generator[float, None, str | None]:
    """A sentence that asks whether the scene's unit is right, where the furniture is plainly far
    too large or too small for a character that goes to the ``places`` (2,); None where it may be
    right.

    It is too large if everything that stands within 10 m of the places, or else everything there
    is, is taller than 15 m: a bench between towers is right, and so is an empty hall. What is long
    and low (ground, rugs, skirting) does not count. It is too small if no solid is 15 cm long and
    all of them lie within a metre.
    """
    boxes = yield from boxes_of.steps(solids)
    boxes = boxes[(boxes[:, 1] > boxes[:, 0]).any(axis=1)]  # what has no size is in no unit
    if not len(boxes):
        return None

    extent = float((boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)).max())
    longest = (boxes[:, 1] - boxes[:, 0]).max(axis=1)
    rises = boxes[:, 1, 2] - floor
    stands = (boxes[:, 0, 2] < floor + HEAD_HIGH) & (rises > np.maximum(KNEE_LOW, _LOW * longest))
    low, high = np.min(places, axis=0) - _BESIDE, np.max(places, axis=0) + _BESIDE
    near = stands & ((boxes[:, 1, :2] >= low) & (boxes[:, 0, :2] <= high)).all(axis=1)
    judged = rises[near if near.any() else stands]
    too_small = extent < _TINY and longest.max() < _SMALLEST
    if not too_small and not (len(judged) and judged.min() > _TALLEST):
        return None

    return f"The scene is {metres(extent * size)} across: is its unit right? {_remedy(judged)}"


def _remedy(rises: np.ndarray) -> str:
    """What to do about a scene of another unit, whose furniture rises so many metres (N,)."""
    lowest = float(rises.min()) if len(rises) else 0.0
    if lowest < FURNITURE[0]:
        return "It looks 100 times too small; multiply its Unit Scale, or all of it, by 100."
    if (unit := likely_unit(lowest, FURNITURE)) is None:
        return "Scale it to the character's size."
    name, size = unit
    return f"It looks modelled in {name}; multiply its Unit Scale, or all of it, by {size:g}."


def around(
    places: Sequence[np.ndarray] | np.ndarray, beyond: float = _AROUND
) -> tuple[np.ndarray, np.ndarray]:
    """Two corners (2,) of the floor, between which ways from one of the places (2,) to the next are
    looked for.
    """
    return np.min(places, axis=0) - beyond, np.max(places, axis=0) + beyond


def _ahead(stop: Stop, metres: float) -> np.ndarray:
    """Where (2,) one is on the way to or from a stop: before a seat, else at the stop itself."""
    return np.array(stop.position) + (metres if stop.seated else 0.0) * forward_of(stop.yaw)
