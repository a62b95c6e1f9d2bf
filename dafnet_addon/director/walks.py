"""Ways over the floor between furniture, and root paths that follow them to a seat or a place to stand."""

import heapq
from collections.abc import Sequence

import numpy as np

from ..core.errors import InputError
from ..core.paths import Route, Stop, route
from ..core.solids import Box, Mesh
from .surfaces import HeightField, height_field, surface_points

__all__ = ["way_round", "walk_to"]

_CELL = 0.08
_KNEE_LOW, _HEAD_HIGH = 0.07, 1.85  # metres over the floor: what lies lower is stepped over, what hangs higher is not met
_RADIUS = 0.30  # metres that the body's middle keeps from furniture
_AROUND = 2.0  # metres of floor beyond start and goal
_BEFORE_SEAT = 0.55  # metres straight in front of a seat, as ``core.paths`` goes
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


def _search(blocked: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> list[tuple[int, int]] | None:
    """A* over eight neighbours; no corner is cut."""
    queue: list[tuple[float, tuple[int, int]]] = [(0.0, start)]
    cost = {start: 0.0}
    came: dict[tuple[int, int], tuple[int, int]] = {}
    done: set[tuple[int, int]] = set()
    while queue:
        _, at = heapq.heappop(queue)
        if at == goal:
            path = [at]
            while path[-1] in came:
                path.append(came[path[-1]])
            return path[::-1]
        if at in done:
            continue
        done.add(at)
        for i, j in _NEIGHBOURS:
            to = (at[0] + i, at[1] + j)
            if not (0 <= to[0] < blocked.shape[0] and 0 <= to[1] < blocked.shape[1]) or blocked[to]:
                continue
            if i and j and (blocked[at[0] + i, at[1]] or blocked[at[0], at[1] + j]):
                continue
            total = cost[at] + float(np.hypot(i, j))
            if total < cost.get(to, np.inf):
                cost[to], came[to] = total, at
                heapq.heappush(queue, (total + float(np.hypot(goal[0] - to[0], goal[1] - to[1])), to))
    return None


def _clear(blocked: np.ndarray, a: np.ndarray, b: np.ndarray) -> bool:
    """Whether the straight line between two cells is free."""
    steps = max(2, int(2 * np.abs(b - a).max()) + 1)
    cells = np.round(a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a)).astype(int)
    return not blocked[cells[:, 0], cells[:, 1]].any()


def way_round(points: np.ndarray, start: np.ndarray, goal: np.ndarray) -> list[tuple[float, float]]:
    """Corners (x, y) of a short way from ``start`` (2,) to ``goal`` (2,) that keeps off what has ``points`` (N, 3), z over the
    floor; without the ends.

    Raises InputError where there is no way.
    """
    solid = points[(points[:, 2] > _KNEE_LOW) & (points[:, 2] < _HEAD_HIGH)]
    both = np.stack([start, goal])
    field = height_field(solid, both.min(0) - _AROUND, both.max(0) + _AROUND, _CELL)
    blocked = _blocked(field, _RADIUS)
    ends = [_nearest_free(blocked, field.index(end)) for end in both]
    path = None if None in ends else _search(blocked, ends[0], ends[1])  # type: ignore[arg-type]
    if path is None:
        raise InputError("There is no way between the furniture from the character to where it is to go; make room for it.")
    cells = np.array(path)
    corners, at = [], 0
    while at < len(cells) - 1:
        ahead = next(k for k in range(len(cells) - 1, at, -1) if k == at + 1 or _clear(blocked, cells[at], cells[k]))
        corners.append(ahead)
        at = ahead
    middles = field.middles(cells[corners]) if corners else np.zeros((0, 2))
    return [(float(x), float(y)) for x, y in _apart(middles, start, goal)]


def _apart(points: np.ndarray, start: np.ndarray, goal: np.ndarray) -> list[np.ndarray]:
    """The points that are no nearer than 25 cm to one another and to both ends: a path needs some length between corners."""
    kept: list[np.ndarray] = []
    for point in points:
        if np.linalg.norm(point - (kept[-1] if kept else start)) > 0.25 and np.linalg.norm(point - goal) > 0.25:
            kept.append(point)
    return kept


def walk_to(
    solids: Sequence[Box | Mesh], start: Stop, goal: Stop, speed: float = 1.1, fps: float = 30.0, floor: float = 0.0
) -> Route:
    """The root path from rest at ``start`` to rest at ``goal`` that goes round the furniture; metres, people of 1.75 m.

    A seat is left and reached from its front. Raises InputError where there is no way, or start and goal are the same.
    """
    points = surface_points(solids, 0.6 * _CELL) - np.array([0.0, 0.0, floor])

    def front(stop: Stop) -> np.ndarray:
        forward = np.array([-np.sin(stop.yaw), np.cos(stop.yaw)])
        return np.array(stop.position) + (_BEFORE_SEAT if stop.seated else 0.0) * forward

    if np.linalg.norm(np.subtract(start.position, goal.position)) < 0.3:
        raise InputError("The character is there already; choose another place to go to.")
    via = way_round(points, front(start), front(goal))
    return route(start, *via, goal, speed=speed, fps=fps, floor=floor)
