"""Real pieces of furniture as the training holds them: distance grids in bytes, and the places
where one sits on them.

Every piece is kept at a few heights (``FACTORS``), since a grid that is stretched further no longer
holds distances; between two of them it is stretched by at most ``STRETCH``, which is off by at most
4 mm at the sensor's reach and by nothing on the surface. A placed shape is a row: which shape, x
and y (metres), yaw (radians, counter-clockwise), stretch of its height.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...core.distance import build_grid
from ...core.errors import InputError
from ...core.grid import BAND, DistanceGrid
from ...core.root import RootPath
from ...core.rotations import rotate, yaw_matrix
from ...core.sensor import RADIUS, REACH, SPHERES, occupancy_of_distance
from ...core.solids import BOX_CORNERS, BOX_TRIANGLES, Mesh
from ...director.seats import seat_of
from .library import Piece

__all__ = [
    "ABSENT_SHAPE",
    "DEEPEST",
    "FACTORS",
    "FARTHEST",
    "NO_SHAPES",
    "PELVIS_OVER",
    "SHAPES",
    "STRETCH",
    "Seat",
    "Shape",
    "ShapeBank",
    "bank_of",
    "shapes_of",
    "surface_under",
]

PELVIS_OVER = {
    "table": 0.14,
    "bench": 0.14,
    "stool": 0.14,
    "toilet": 0.11,
    "desk": 0.14,
    "chair": 0.11,
    "armchair": 0.07,
    "sofa": 0.03,
    "bed": 0.03,
}
"""Metres by which a seated pelvis joint is over the undeformed surface of a kind of furniture: how
far one sinks in belongs to the piece. Medians over captured sitting on real furniture; half of the
pieces of a kind lie within 2 cm.
"""

FACTORS = (0.8, 0.88, 0.97, 1.07, 1.18)
"""Heights at which each piece that one sits on is kept, over its true height."""
STRETCH = 0.05
"""How far a grid's height may be stretched or pressed together, beside 1."""
SHAPES = 6
"""Placed shapes that a training window holds at most."""
NO_SHAPES = np.zeros((0, 5))
ABSENT_SHAPE = np.array([-1.0, 0.0, 0.0, 0.0, 1.0])
"""A row of no shape: fills up the rows of a window."""
DEEPEST, FARTHEST = -0.05, 0.15
"""Metres between which distances are kept, in bytes; beyond them they are these."""

_SEAT_NUMBERS = 8
_STEP = (FARTHEST - DEEPEST) / 255.0
_FLOOR = np.array([0.0, 0.0, 1.0, 0.0])
_SIDES_TO_COME_FROM = np.array([(0.0, -3.0), (3.0, 0.0), (0.0, 3.0), (-3.0, 0.0)])
_NARROWEST = 0.3  # metres across: a table fan is not a table
_SAME_WAY = np.cos(np.radians(20.0))
# what carries the hips: half sizes of a patch, how near a surface is under it, and how much of it
_PATCH, _UNDER_IT, _CARRIED = (0.1, 0.08), 0.03, 0.5
_ASTRAY = np.cos(np.radians(60.0))
_FRAMES_AT_ONCE = 16


@dataclass(frozen=True)
class Seat:
    """Where one sits on a shape, in its own frame: ``position`` (2,) under the pelvis, ``yaw`` that
    one faces, ``height`` of the surface, ``pelvis`` height of the joint, ``aside`` metres to each
    side where another may sit as well, ``edge`` metres from there to the front edge.
    """

    position: np.ndarray
    yaw: float
    height: float
    pelvis: float
    aside: float
    edge: float


@dataclass(frozen=True)
class Shape:
    """A piece at ``factor`` of its height. ``values`` (nx, ny, nz) uint8: distances from
    ``DEEPEST`` to ``FARTHEST`` at nodes ``spacing`` metres apart from ``origin`` (3,) on. ``seats``
    hold one for each side from which one may come; none where nobody sits.
    """

    name: str
    kind: str
    maker: str
    factor: float
    origin: np.ndarray
    spacing: float
    values: np.ndarray
    seats: tuple[Seat, ...]

    @property
    def grid(self) -> DistanceGrid:
        """The distances as the core knows them."""
        values = (DEEPEST + _STEP * self.values).astype(np.float32)
        return DistanceGrid(self.origin, self.spacing, values, FARTHEST)


@dataclass(frozen=True)
class ShapeBank:
    """All shapes that windows name by their number."""

    shapes: tuple[Shape, ...]

    def __len__(self) -> int:
        return len(self.shapes)

    def distances(self, placed: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Signed distance (N,) of world ``points`` (N, 3) to the nearest of the placed shapes (S,
        5), at most ``FARTHEST``.
        """
        out = np.full(len(points), FARTHEST, np.float32)
        for number, x, y, yaw, stretch in placed:
            shape = self.shapes[int(number)]
            local = rotate(yaw_matrix(np.array(-yaw)), points - (x, y, 0.0)) / (1.0, 1.0, stretch)
            low = shape.origin
            near = (
                (local > low) & (local < low + shape.spacing * (np.array(shape.values.shape) - 1))
            ).all(-1)
            if near.any():
                out[near] = np.minimum(out[near], _sampled(shape, local[near]))

        return out

    def occupancy(self, placed: np.ndarray, path: RootPath) -> np.ndarray:
        """Occupancy (T, 2640) float32 of placed shapes (S, 5) along a root path on the floor z = 0;
        as ``core.occupancy``.
        """
        out = np.zeros((len(path), len(SPHERES)), np.float32)
        for row in placed:
            shape = self.shapes[int(row[0])]
            size = shape.spacing * (np.array(shape.values.shape) - 1)
            reach = (
                REACH
                + RADIUS
                + np.linalg.norm(np.maximum(np.abs(shape.origin), np.abs(shape.origin + size))[:2])
            )
            frames = np.flatnonzero(
                np.linalg.norm(path.position[:, :2] - row[1:3], axis=-1) < reach
            )
            for start in range(0, len(frames), _FRAMES_AT_ONCE):
                some = frames[start : start + _FRAMES_AT_ONCE]
                spheres = rotate(yaw_matrix(path.yaw[some])[:, None], SPHERES) + path.position[
                    some, None
                ] * (1, 1, 0)
                found = occupancy_of_distance(self.distances(row[None], spheres.reshape(-1, 3)))
                out[some] = np.maximum(out[some], found.reshape(len(some), -1))

        return out

    def meshes(self, placed: np.ndarray, name: str = "") -> list[Mesh]:
        """Placed shapes (S, 5) as solids of the core, with their grids; their triangles are those
        of the box around them.
        """
        solids = []
        for number, x, y, yaw, stretch in placed:
            shape = self.shapes[int(number)]
            matrix = np.eye(4)
            matrix[:3, :3], matrix[:2, 3] = yaw_matrix(np.array(yaw)), (x, y)
            grid = shape.grid if stretch == 1.0 else _stretched(shape, float(stretch))
            size = grid.spacing * (np.array(grid.values.shape) - 1)
            corners = grid.origin + size * (BOX_CORNERS + 1.0) / 2.0
            solids.append(Mesh(corners, BOX_TRIANGLES, matrix, name or shape.name, grid))

        return solids

    def write(self, file: Path) -> None:
        """Write the bank, whole or not at all."""
        seats = [
            [i, *seat.position, seat.yaw, seat.height, seat.pelvis, seat.aside, seat.edge]
            for i, shape in enumerate(self.shapes)
            for seat in shape.seats
        ]
        part = file.with_suffix(".part.npz")
        np.savez_compressed(
            part,
            texts=np.array([[s.name, s.kind, s.maker] for s in self.shapes]),
            between=np.array([DEEPEST, FARTHEST]),
            places=np.array([[s.factor, *s.origin, s.spacing] for s in self.shapes]),
            seats=np.array(seats).reshape(-1, _SEAT_NUMBERS),
            sizes=np.array([s.values.shape for s in self.shapes]),
            values=np.concatenate([s.values.ravel() for s in self.shapes]),
        )
        part.replace(file)

    @staticmethod
    def read(file: Path) -> "ShapeBank":
        """What ``write`` wrote. Raises InputError where an earlier version did."""
        with np.load(file) as z:
            texts, places, seats, sizes, values = (
                z[name] for name in ("texts", "places", "seats", "sizes", "values")
            )
            between = z["between"] if "between" in z else np.zeros(2)

        if seats.shape[1] != _SEAT_NUMBERS or not np.array_equal(between, (DEEPEST, FARTHEST)):
            raise InputError(
                f"The furniture in '{file}' was made by an earlier version; make the dataset anew "
                "with 'dafnet prepare'."
            )

        shapes, at = [], 0
        for number, (text, place, size) in enumerate(zip(texts, places, sizes, strict=True)):
            count = int(np.prod(size))
            shapes.append(
                Shape(
                    name=str(text[0]),
                    kind=str(text[1]),
                    maker=str(text[2]),
                    factor=float(place[0]),
                    origin=place[1:4],
                    spacing=float(place[4]),
                    values=values[at : at + count].reshape(size),
                    seats=tuple(
                        Seat(row[1:3], *(float(v) for v in row[3:]))
                        for row in seats[seats[:, 0] == number]
                    ),
                )
            )
            at += count

        return ShapeBank(tuple(shapes))


def _sampled(shape: Shape, local: np.ndarray) -> np.ndarray:
    """Trilinear distances (N,) at points (N, 3) of the shape's own frame, all within its grid."""
    at = ((local - shape.origin) / shape.spacing).astype(np.float32)
    cell = np.minimum(at.astype(np.int32), np.array(shape.values.shape, np.int32) - 2)
    fx, fy, fz = (at - cell).T
    _, ny, nz = shape.values.shape
    node = (cell[:, 0] * ny + cell[:, 1]) * nz + cell[:, 2]
    values = shape.values.reshape(-1)

    def along_z(n: np.ndarray) -> np.ndarray:
        below = values[n].astype(np.float32)
        return below + fz * (values[n + 1] - below)

    near, far = along_z(node), along_z(node + ny * nz)
    near += fy * (along_z(node + nz) - near)
    far += fy * (along_z(node + (ny + 1) * nz) - far)
    return np.float32(DEEPEST) + np.float32(_STEP) * (near + fx * (far - near))


def _stretched(shape: Shape, stretch: float) -> DistanceGrid:
    """The grid of a shape whose height is stretched, on nodes of its own."""
    grid = shape.grid
    heights = grid.origin[2] * stretch + grid.spacing * np.arange(
        int(np.ceil((grid.values.shape[2] - 1) * stretch)) + 1
    )
    at = np.clip(
        (heights / stretch - grid.origin[2]) / grid.spacing, 0.0, grid.values.shape[2] - 1.001
    )
    below = at.astype(int)
    share = (at - below).astype(np.float32)
    values = grid.values[..., below] * (1 - share) + grid.values[..., below + 1] * share
    values[..., [0, -1]] = FARTHEST
    return DistanceGrid(
        grid.origin * (1.0, 1.0, stretch), grid.spacing, values.astype(np.float32), FARTHEST
    )


def _seats(piece: Piece, grid: DistanceGrid) -> list[Seat]:
    """Where one sits on a piece that has these distances, from each side that one may come from."""
    found: list[Seat] = []
    across = np.ptp(piece.vertices[:, :2], axis=0).min()
    if piece.kind not in PELVIS_OVER or across < _NARROWEST:
        return found

    mesh = Mesh(piece.vertices, piece.triangles, name=piece.title)
    for side in _SIDES_TO_COME_FROM:
        try:
            place = seat_of([mesh], side, 0.0, piece.title, tables=True)
        except InputError:
            return []

        # A piece's front faces −y: a back that is elsewhere is none.
        misjudged = place.back and np.cos(place.yaw - np.pi) < _ASTRAY
        known = any(np.cos(place.yaw - seat.yaw) > _SAME_WAY for seat in found)
        height = surface_under(grid, place.position, place.yaw, place.height)
        if not misjudged and not known and height is not None:
            found.append(
                Seat(
                    position=place.position,
                    yaw=place.yaw,
                    height=height,
                    pelvis=height + PELVIS_OVER[piece.kind],
                    aside=place.aside,
                    edge=place.edge,
                )
            )

    return found


def surface_under(
    grid: DistanceGrid, position: np.ndarray, yaw: float, level: float
) -> float | None:
    """Height of what carries the hips of one that sits at ``position`` (2,) on about this level:
    None where it is too little, as a rim or a frame without its cloth.
    """
    half_width, half_depth = _PATCH
    patch = np.stack(
        np.meshgrid(
            np.linspace(-half_width, half_width, 9), np.linspace(-half_depth, half_depth, 7)
        ),
        axis=-1,
    ).reshape(-1, 2)
    c, s = np.cos(yaw), np.sin(yaw)
    spots = position + patch @ np.array([[c, s], [-s, c]])
    heights = level + np.arange(0.06, -0.061, -0.01)
    points = np.concatenate(
        [
            np.repeat(spots, len(heights), axis=0),
            np.tile(heights, len(spots))[:, None],
        ],
        axis=1,
    )
    gap = grid.sample(points).reshape(len(spots), len(heights))
    near = gap < _UNDER_IT
    if near.any(-1).mean() < _CARRIED:
        return None

    # The first height from above that touches, less how far it still is.
    first = near.argmax(-1)
    touched = heights[first] - gap[np.arange(len(spots)), first]
    return float(np.median(touched[near.any(-1)]))


def shapes_of(piece: Piece, factors: Sequence[float] = FACTORS) -> list[Shape]:
    """A piece at ``factors`` of its true height; where nobody sits, only at the true one."""
    seats = _seats(piece, build_grid(piece.vertices, piece.triangles, _FLOOR))
    found = []
    for factor in factors if seats else (1.0,):
        vertices = piece.vertices * (1.0, 1.0, factor)
        grid = build_grid(vertices, piece.triangles, _FLOOR)
        values = np.clip(np.rint((grid.values - DEEPEST) / _STEP), 0, 255).astype(np.uint8)
        found.append(
            Shape(
                name=piece.name,
                kind=piece.kind,
                maker=piece.maker,
                factor=float(factor),
                origin=grid.origin,
                spacing=grid.spacing,
                values=values,
                seats=tuple(
                    replace(
                        seat,
                        height=seat.height * factor,
                        pelvis=seat.height * factor + PELVIS_OVER[piece.kind],
                    )
                    for seat in seats
                ),
            )
        )

    return found


def bank_of(pieces: Iterable[Piece], factors: Sequence[float] = FACTORS) -> ShapeBank:
    """The shapes of all these pieces. Building them takes about a second each."""
    return ShapeBank(tuple(shape for piece in pieces for shape in shapes_of(piece, factors)))


assert RADIUS < FARTHEST <= BAND
