"""Furniture seen from above: points on its surfaces, and the height of what is highest over each
cell of the floor.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.nearby import bounds
from ..core.rotations import rotate
from ..core.solids import Box, Mesh

__all__ = ["HeightField", "height_field", "surface_points"]

_MAX_POINTS = 4_000_000  # points; larger furniture is sampled more coarsely
_CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_FACES = np.array(
    [
        (0, 1, 3),
        (0, 3, 2),
        (4, 6, 7),
        (4, 7, 5),
        (0, 4, 5),
        (0, 5, 1),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
        (0, 6, 4),
        (1, 5, 7),
        (1, 7, 3),
    ]
)


def _corners(solid: Box | Mesh) -> np.ndarray:
    """World corners (F, 3, 3) of a solid's triangles, where it is at the first frame."""
    if isinstance(solid, Box):
        vertices, triangles, matrix = _CORNERS * solid.half_size, _FACES, solid.matrices()
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
    low: np.ndarray, high: np.ndarray, within: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Which boxes (N,) between corners (N, 3) reach over the floor between two corners (2,)."""
    return np.asarray(((high[:, :2] >= within[0]) & (low[:, :2] <= within[1])).all(axis=1))


def surface_points(
    solids: Sequence[Box | Mesh],
    spacing: float,
    within: tuple[np.ndarray, np.ndarray] | None = None,
) -> np.ndarray:
    """Points (N, 3) all over the surfaces, no two neighbours farther apart than about ``spacing``
    metres.

    ``within``: two corners (2,) of the floor; only of triangles that reach over what is between
    them, if they are given.
    """
    if within is not None:
        solids = [solid for solid in solids if isinstance(solid, Box) or len(solid.triangles)]
        boxes = [np.stack(bounds(solid)).reshape(2, -1, 3)[:, :1] for solid in solids]
        solids = [
            solid
            for solid, (low, high) in zip(solids, boxes, strict=True)
            if _reach_over(low, high, within).any()
        ]
    triangles = np.concatenate([np.zeros((0, 3, 3)), *(_corners(solid) for solid in solids)])
    if within is not None:
        triangles = triangles[_reach_over(triangles.min(axis=1), triangles.max(axis=1), within)]
    if not len(triangles):
        return np.zeros((0, 3))
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=-1).max(1)
    parts = np.maximum(1, np.ceil(longest / spacing)).astype(int)
    coarser = np.sqrt(max(1.0, float((parts.astype(float) ** 2 / 2).sum()) / _MAX_POINTS))
    parts = np.maximum(1, np.ceil(parts / coarser)).astype(int)
    found = []
    for n in np.unique(parts):
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
        inside = i + j <= n
        u, v = i[inside] / n, j[inside] / n
        weights = np.stack([1.0 - u - v, u, v], axis=-1)
        found.append(np.einsum("pk,fkc->fpc", weights, triangles[parts == n]).reshape(-1, 3))
    return np.concatenate(found)


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


def height_field(points: np.ndarray, low: np.ndarray, high: np.ndarray, cell: float) -> HeightField:
    """The height field of surface points (N, 3) between two corners (2,) of the floor."""
    size = np.maximum(1, np.ceil((high - low) / cell).astype(int) + 1)
    field = HeightField(np.asarray(low, float), cell, np.full(size, -np.inf))
    cells = field.index(points[:, :2])
    inside = ((cells >= 0) & (cells < size)).all(1)
    np.maximum.at(field.top, tuple(cells[inside].T), points[inside, 2])
    return field
