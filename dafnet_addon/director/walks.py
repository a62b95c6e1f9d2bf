"""Ways over the floor between furniture, and root paths that follow them to a seat or a place to
stand.
"""

import heapq
from collections.abc import Sequence

import numpy as np

from ..core.errors import InputError
from ..core.nearby import extent
from ..core.paths import AFTER_SEAT, BEFORE_SEAT, Route, Stop, route
from ..core.root import forward_of
from ..core.series import MODEL_FPS
from ..core.solids import Box, Mesh
from .surfaces import HeightField, height_field, surface_points

__all__ = ["around", "way_round", "walk_to"]

_CELL = 0.08
_KNEE_LOW = 0.07  # metres over the floor; what lies lower is stepped over
_HEAD_HIGH = 1.85  # metres over the floor; what hangs higher is not met
_RADIUS = 0.30  # metres that the body's middle keeps from furniture
_AROUND = 2.0  # metres of floor beyond start and goal
_FARTHEST = 100.0  # metres between start and goal; so many cells are searched in seconds
_NEAREST = 0.3  # metres between start and goal, under which one is there already
_TINY = 1.0  # metres across: no room is
_AHEAD = 500  # cells within which a way is cut short
_NEIGHBOURS = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]


def _blocked(field: HeightField, radius: float) -> np.ndarray:
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
    return out


def _nearest_free(blocked: np.ndarray, cell: np.ndarray) -> tuple[int, int] | None:
    free = np.argwhere(~blocked)
    if not len(free):
        return None
    i, j = free[np.argmin(((free - cell) ** 2).sum(1))]
    return int(i), int(j)


def _search(
    blocked: np.ndarray, start: tuple[int, int], goal: tuple[int, int]
) -> list[tuple[int, int]] | None:
    """A* over eight neighbours; no corner is cut."""
    # One row of blocked cells around all, and plain lists over its cells: the same search over
    # pairs takes ten times as long.
    walls = np.pad(blocked, 1, constant_values=True)
    width = walls.shape[1]
    i, j = np.indices(walls.shape)
    left = np.hypot(goal[0] + 1 - i, goal[1] + 1 - j).ravel().tolist()
    closed = bytearray(walls.tobytes())
    wall = bytes(closed)
    first, last = ((cell[0] + 1) * width + cell[1] + 1 for cell in (start, goal))
    steps = [(i * width + j, i * width, j, float(np.hypot(i, j))) for i, j in _NEIGHBOURS]
    if not _connected(walls, first, last):
        return None
    cost: dict[int, float] = {first: 0.0}
    came: dict[int, int] = {}
    queue = [(0.0, first)]
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
        here = cost[at]
        for step, down, across, length in steps:
            to = at + step
            if wall[to] or (down and across and (wall[at + down] or wall[at + across])):
                continue
            total = here + length
            if total < cost.get(to, np.inf):
                cost[to], came[to] = total, at
                heapq.heappush(queue, (total + left[to], to))
    return None


def _connected(walls: np.ndarray, first: int, last: int) -> bool:
    """Whether there is a way at all: a wave over the free cells finds out in no time, where the
    search would try them all.
    """
    free = ~walls.ravel()
    front = np.array([first])
    while len(front) and free[last]:
        free[front] = False
        front = (front[:, None] + np.array([1, -1, walls.shape[1], -walls.shape[1]])).ravel()
        front = np.unique(front[free[front]])
    return not free[last]


def _clear(blocked: np.ndarray, a: np.ndarray, b: np.ndarray) -> bool:
    """Whether the straight line between two cells is free."""
    steps = max(2, int(2 * np.abs(b - a).max()) + 1)
    cells = np.round(a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a)).astype(int)
    return not blocked[cells[:, 0], cells[:, 1]].any()


def way_round(
    points: np.ndarray, start: np.ndarray, goal: np.ndarray, size: float = 1.0
) -> list[tuple[float, float]]:
    """Corners (x, y) of a short way from ``start`` (2,) to ``goal`` (2,) that keeps off what has
    ``points`` (N, 3), z over the floor; without the ends.

    Raises InputError where there is no way, or the goal is too far away. ``size``: of the
    character, over 1.75 m, for what is said of the scene.
    """
    solid = points[(points[:, 2] > _KNEE_LOW) & (points[:, 2] < _HEAD_HIGH)]
    both = np.stack([start, goal])
    if not np.abs(goal - start).max() <= _FARTHEST:
        raise InputError(
            f"The goal is {np.linalg.norm(goal - start) * size:,.0f} m away: is the scene's unit "
            "right? "
            f"Choose one within {_FARTHEST * size:.0f} m, or walk there in parts."
        )
    field = height_field(solid, *around(both), _CELL)
    blocked = _blocked(field, _RADIUS)
    ends = [_nearest_free(blocked, field.index(end)) for end in both]
    path = None if None in ends else _search(blocked, ends[0], ends[1])  # type: ignore[arg-type]
    if path is None:
        raise InputError(
            "There is no way between the furniture from the character to where it is to go; make "
            "room for it."
        )
    cells = np.array(path)
    corners, at = [], 0
    while at < len(cells) - 1:
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
    """The points that are no nearer than 25 cm to one another and to both ends: a path needs some
    length between corners.
    """
    kept: list[np.ndarray] = []
    for point in points:
        if (
            np.linalg.norm(point - (kept[-1] if kept else start)) > 0.25
            and np.linalg.norm(point - goal) > 0.25
        ):
            kept.append(point)
    return kept


def walk_to(
    solids: Sequence[Box | Mesh],
    start: Stop,
    goal: Stop,
    speed: float = 1.1,
    fps: float = MODEL_FPS,
    floor: float = 0.0,
    size: float = 1.0,
) -> Route:
    """The root path from rest at ``start`` to rest at ``goal`` that goes round the furniture;
    metres, people of 1.75 m.

    A seat is left and reached from its front. Raises InputError where there is no way, or start and
    goal are the same or too far apart. ``size``: see ``way_round``.
    """
    if np.linalg.norm(np.subtract(start.position, goal.position)) < _NEAREST:
        if solids and (across := extent(solids)) < _TINY:
            raise InputError(
                f"The scene is {across * size:.2g} m across: is its unit right? Scale it to the "
                "character's size."
            )
        raise InputError("The character is there already; choose another place to go to.")
    leaves, comes = _ahead(start, AFTER_SEAT), _ahead(goal, BEFORE_SEAT)
    points = surface_points(solids, 0.6 * _CELL, around([leaves, comes])) - np.array(
        [0.0, 0.0, floor]
    )
    return route(
        start, *way_round(points, leaves, comes, size), goal, speed=speed, fps=fps, floor=floor
    )


def around(places: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Two corners (2,) of the floor, between which ways from one of the places (2,) to the next are
    looked for.
    """
    return np.min(places, axis=0) - _AROUND, np.max(places, axis=0) + _AROUND


def _ahead(stop: Stop, metres: float) -> np.ndarray:
    """Where (2,) one is on the way to or from a stop: before a seat, else at the stop itself."""
    return np.array(stop.position) + (metres if stop.seated else 0.0) * forward_of(stop.yaw)
