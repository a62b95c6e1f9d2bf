"""Furniture seen from above: points on its surfaces, and the height of what is highest over each
cell of the floor.
"""

from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..core.nearby import bounds
from ..core.progress import run_to_end, stepwise, within
from ..core.rotations import rotate
from ..core.solids import BOX_CORNERS, BOX_TRIANGLES, Box, Mesh

__all__ = [
    "Columns",
    "HeightField",
    "boxes_of",
    "columns",
    "height_field",
    "parts_of_surfaces",
    "surface_points",
]

_MAX_POINTS = 4_000_000
"""Larger furniture is sampled more coarsely."""
_AT_ONCE = 100_000
"""Points that are made between two steps of a job."""
_KEPT = 40
"""Parts of a triangle's sides, up to which its points' weights are kept: 3 MB of them."""
_SOLIDS_AT_ONCE = 100
"""Solids that are looked at between two steps of a job."""


def _corners(solid: Box | Mesh) -> np.ndarray:
    """World corners (F, 3, 3) of a solid's triangles, where it is at the first frame."""
    if isinstance(solid, Box):
        vertices, triangles, matrix = BOX_CORNERS * solid.half_size, BOX_TRIANGLES, solid.matrices()
    else:
        vertices, triangles, matrix = (
            np.asarray(solid.vertices, float),
            np.asarray(solid.triangles),
            np.asarray(solid.matrix),
        )

    matrix = matrix[0] if matrix.ndim == 3 else matrix
    world = rotate(matrix[:3, :3], vertices) + matrix[:3, 3]
    return np.asarray(world[triangles])


def _reach_over(
    low: np.ndarray, high: np.ndarray, between: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Which boxes (N,) between corners (N, 3) reach over the floor between two corners (2,)."""
    return np.asarray(((high[:, :2] >= between[0]) & (low[:, :2] <= between[1])).all(axis=1))


@stepwise
def boxes_of(solids: Sequence[Box | Mesh]) -> Generator[float, None, np.ndarray]:
    """The lowest and the highest corner (N, 2, 3) of the upright box around each solid in the first
    frame; NaN around one without triangles.
    """
    boxes = np.full((len(solids), 2, 3), np.nan)
    for k, solid in enumerate(solids):
        if isinstance(solid, Box) or len(solid.triangles):
            boxes[k] = np.stack(bounds(solid)).reshape(2, -1, 3)[:, 0]
        if k % _SOLIDS_AT_ONCE == 0:
            yield k / len(solids)
    return boxes


def surface_points(
    solids: Sequence[Box | Mesh],
    spacing: float,
    between: tuple[np.ndarray, np.ndarray] | None = None,
) -> np.ndarray:
    """Points (N, 3) all over the surfaces, no two neighbours farther apart than about ``spacing``
    metres.

    ``between``: two corners (2,) of the floor; only of triangles that reach over what is between
    them, if they are given.
    """
    return np.concatenate(
        [np.zeros((0, 3)), *run_to_end(parts_of_surfaces.steps(solids, spacing, between))]
    )


@stepwise
def parts_of_surfaces(
    solids: Sequence[Box | Mesh],
    spacing: float,
    between: tuple[np.ndarray, np.ndarray] | None = None,
) -> Generator[float, None, list[np.ndarray]]:
    """``surface_points`` in parts (N, 3) of at most about a hundred thousand."""
    if between is not None:
        boxes = yield from within(boxes_of.steps(solids), 0.0, 0.2)
        near = _reach_over(boxes[:, 0], boxes[:, 1], between)
        solids = [solid for solid, reaches in zip(solids, near, strict=True) if reaches]

    corners = [np.zeros((0, 3, 3))]
    for k, solid in enumerate(solids):
        corners.append(_corners(solid))
        if k % _SOLIDS_AT_ONCE == 0:
            yield 0.2 + 0.2 * k / len(solids)

    triangles = np.concatenate(corners)
    if between is not None:
        a, b, c = triangles[:, 0, :2], triangles[:, 1, :2], triangles[:, 2, :2]
        low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        triangles = triangles[_reach_over(low, high, between)]
    if not len(triangles):
        return []

    x, y, z = np.moveaxis((triangles - triangles[:, [2, 0, 1]]) ** 2, -1, 0)
    longest = np.sqrt((x + y + z).max(axis=1))
    cuts = np.maximum(1, np.ceil(longest / spacing)).astype(int)
    coarser = np.sqrt(max(1.0, float((cuts.astype(float) ** 2 / 2).sum()) / _MAX_POINTS))
    cuts = np.maximum(1, np.ceil(cuts / coarser)).astype(int)

    found, done = [], 0
    for cut in np.unique(cuts):
        alike = triangles[cuts == cut]
        at_once = max(1, _AT_ONCE // ((cut + 1) * (cut + 2) // 2))
        for first in range(0, len(alike), at_once):
            some = alike[first : first + at_once]
            if cut == 1:
                found.append(some[:, [0, 2, 1]].reshape(-1, 3))
                yield 0.4 + 0.6 * done / len(triangles)
            for weights in _weights(int(cut)) if cut > 1 else ():
                found.append((weights @ some).reshape(-1, 3))
                yield 0.4 + 0.6 * done / len(triangles)

            done += len(some)

    return found


def _weights(cut: int) -> Iterable[np.ndarray]:
    """``_all_weights``, those that come again and again kept."""
    return _kept_weights(cut) if cut <= _KEPT else _all_weights(cut)


@cache
def _kept_weights(cut: int) -> tuple[np.ndarray, ...]:
    return tuple(_all_weights(cut))


def _all_weights(cut: int) -> Iterator[np.ndarray]:
    """Barycentric weights (P, 3) of points all over a triangle whose sides are cut into so many
    parts, at most about a hundred thousand at a time.
    """
    rows = max(1, _AT_ONCE // (cut + 1))
    for first in range(0, cut + 1, rows):
        i, j = np.meshgrid(
            np.arange(first, min(first + rows, cut + 1)), np.arange(cut + 1), indexing="ij"
        )
        inside = i + j <= cut
        second, third = i[inside] / cut, j[inside] / cut
        yield np.stack([1.0 - second - third, second, third], axis=-1)


@dataclass(frozen=True)
class HeightField:
    """``top`` (X, Y): the highest point of each cell, −inf where there is none; ``origin`` (2,):
    the first cell's middle; ``cell``: metres.
    """

    origin: np.ndarray
    cell: float
    top: np.ndarray

    def index(self, points: np.ndarray) -> np.ndarray:
        """Cells (…, 2) of points (…, 2), which may lie outside the field."""
        return np.round((points - self.origin) / self.cell).astype(int)

    def middles(self, cells: np.ndarray) -> np.ndarray:
        """Points (…, 2) in the middle of cells (…, 2)."""
        return np.asarray(self.origin + self.cell * cells)

    def add(self, points: np.ndarray) -> None:
        """Raise the cells to the points (N, 3) over them."""
        x, y = self.cells_of(points)
        inside = (x >= 0) & (y >= 0) & (x < self.top.shape[0]) & (y < self.top.shape[1])
        np.maximum.at(self.top, (x[inside], y[inside]), points[inside, 2])

    def cells_of(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``index`` of points (N, 2 or 3), by columns, which takes half the time."""
        x, y = (
            np.round((points[:, axis] - self.origin[axis]) / self.cell).astype(int)
            for axis in range(2)
        )
        return x, y


def height_field(points: np.ndarray, low: np.ndarray, high: np.ndarray, cell: float) -> HeightField:
    """The height field of surface points (N, 3) between two corners (2,) of the floor."""
    size = np.maximum(1, np.ceil((high - low) / cell).astype(int) + 1)
    field = HeightField(np.asarray(low, float), cell, np.full(size, -np.inf))
    field.add(points)
    return field


_LAYER = 0.03
"""Metres of height of one layer of columns."""


@dataclass(frozen=True)
class Columns:
    """What stands over each cell of the floor: ``field`` of what is highest up to some height, and
    ``layers`` (X, Y) uint64, in which bit k says whether anything is from k to k + 1 layers of 3 cm
    over the floor.
    """

    field: HeightField
    layers: np.ndarray

    @staticmethod
    def between(low: float, high: float) -> np.uint64:
        """The bits of the layers from ``low`` to ``high`` metres over the floor."""
        first = min(max(round(float(low) / _LAYER), 0), 64)
        last = min(max(round(float(high) / _LAYER), 0), 64)
        return np.uint64((1 << max(last, first)) - (1 << first))

    def at(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The heights and the layers (…) of the cells in which points (…, 2) lie; nothing outside
        the field.
        """
        cells = self.field.index(points)
        inside = ((cells >= 0) & (cells < self.layers.shape)).all(axis=-1)
        at = tuple(np.moveaxis(np.where(inside[..., None], cells, 0), -1, 0))
        return (
            np.where(inside, self.field.top[at], -np.inf),
            np.where(inside, self.layers[at], np.uint64(0)),
        )


@stepwise
def columns(
    parts: Sequence[np.ndarray], floor: float, cell: float, highest: float, most: int
) -> Generator[float, None, Columns | None]:
    """The columns of surface points in ``parts`` (N, 3), without the floor; heights are over
    ``floor``, and ``highest`` is that of the field. None where nothing is left. ``cell``: metres,
    more where there would be more than ``most`` cells.
    """
    kept: list[np.ndarray] = []
    for part in parts:
        over = part[:, 2] - floor
        standing = (over > 0.02) & (over < 64 * _LAYER)
        if standing.any():
            kept.append(np.stack([part[standing, 0], part[standing, 1], over[standing]]))
        yield 0.0

    if not kept:
        return None

    low = np.min([part[:2].min(axis=1) for part in kept], axis=0)
    high = np.max([part[:2].max(axis=1) for part in kept], axis=0)
    cell = max(cell, float(np.sqrt((high - low).prod() / most)))
    field = height_field(np.zeros((0, 3)), low, high, cell)
    layers = np.zeros(field.top.shape, np.uint64)
    for k, part in enumerate(kept):
        field.add(part[:, part[2] < highest].T)
        bits = np.left_shift(np.uint64(1), (part[2] / _LAYER).astype(np.uint64))
        np.bitwise_or.at(layers, field.cells_of(part.T), bits)
        yield k / len(kept)

    return Columns(field, layers)
