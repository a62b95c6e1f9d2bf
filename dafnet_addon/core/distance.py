"""Signed distance grids of triangle meshes, made once and then sampled for every frame.

A grid lives in the mesh's *rigid space*: scale, shear and mirroring are in its vertices, in metres,
and only the rigid motion (``rigid_split``) stays outside, so furniture may move without being
measured again. Distances are truncated beyond ``BAND``; the sensor needs 14 cm, the collision
metric 10. All of it is NumPy, so that a scene looks the same inside Blender and outside; that is
faster than asking a BVH tree for each node, and agrees with one (see the tests).

Real furniture is rarely a clean solid. What is inside is therefore voted on by rays along the three
axes, for each loose part of its own, so that overlapping parts unite; a part that the votes call
open (a single-sided board, a sheet) is a thin shell, whose distance has no sign.
"""

import hashlib
from collections import OrderedDict
from collections.abc import Generator, Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from .grid import BAND, DistanceGrid
from .progress import stepwise, within
from .solids import Box, Mesh, Scene

__all__ = [
    "FLOOR",
    "rigid_frames",
    "rigid_split",
    "build_grid",
    "grid_of",
    "prepared",
    "scaled",
]

FLOOR = 0.05
"""What lies within this height of the root's plane is floor (metres)."""

_FINEST = 0.02  # metres between nodes, where that makes no more of them than the two limits
_COARSE = 0.06  # metres between nodes, above which the user is told that furniture is hardly seen
_VAST = 200.0  # metres across, above which the unit is doubted
_MAX_NODES = 6_000_000  # of a grid
_MAX_BAND_NODES = 2_000_000  # of a grid, within ``BAND`` of a surface
_MAX_SEEDS = 2_000_000  # points strewn over the triangles of a grid
_ROOM = (1.4, 1.9)  # metres: shortest and longest side of what could hold a standing person
_FLAT = np.cos(np.radians(15.0))  # angle to the floor, under which a triangle may be part of it

# How much is measured between two reports of progress: Esc is heard soon, and memory is spared.
_CHUNK = 8192  # pairs of node and triangle
_SEEDS = 1 << 15  # pairs offered
_STREWN = 1 << 17  # points strewn

_CACHED_BYTES = 1 << 29  # of grids kept in memory


def rigid_split(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split affine matrices (…, 4, 4) into rigid frames (…, 4, 4) and linear parts (…, 3, 3):
    matrix = rigid @ linear.

    Polar decomposition; a mirrored matrix is mirrored along x first, so that the linear part of a
    moving object of constant scale is the same in every frame.
    """
    m = np.asarray(matrix, float)
    mirror = np.where(np.linalg.det(m[..., :3, :3]) < 0, -1.0, 1.0)[..., None]
    flip = np.concatenate([mirror, np.ones_like(mirror), np.ones_like(mirror)], axis=-1)
    u, _, vt = np.linalg.svd(m[..., :3, :3] * flip[..., None, :])
    # only a flattened object, whose last singular value is 0
    u[..., :, 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
    rigid = m.copy()
    rigid[..., :3, :3] = u @ vt
    return rigid, np.swapaxes(rigid[..., :3, :3], -1, -2) @ m[..., :3, :3]


def rigid_frames(solid: Box | Mesh) -> np.ndarray:
    """The frames (4, 4) or (T, 4, 4) in which a solid's distances are measured."""
    if isinstance(solid, Box):
        return solid.matrices()
    matrix = np.asarray(solid.matrix, float)
    return _rigid_frame(matrix.tobytes()) if matrix.ndim == 2 else rigid_split(matrix)[0]


@lru_cache(maxsize=4096)
def _rigid_frame(matrix: bytes) -> np.ndarray:
    """The rigid frame (4, 4) of what stands still, which is asked for at every frame that is played
    live; not to be written to.
    """
    frame = rigid_split(np.frombuffer(matrix).reshape(4, 4))[0]
    frame.flags.writeable = False
    return frame


def _welded(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices at one place become one; collapsed and doubled triangles, which would spoil the
    parity, go.
    """
    low = vertices.min(axis=0)
    step = max(1e-5, float(np.ptp(vertices, axis=0).max()) / (1 << 20))
    x, y, z = np.rint((vertices - low) / step).astype(np.int64).T
    _, first, new = np.unique((x << 42) | (y << 21) | z, return_index=True, return_inverse=True)
    triangles = new.reshape(-1)[triangles]
    key = np.sort(triangles, axis=1)
    real = (key[:, 0] < key[:, 1]) & (key[:, 1] < key[:, 2])
    triangles, key = triangles[real], key[real]
    order = np.lexsort(key.T)
    fresh = np.ones(len(order), bool)
    fresh[1:] = (np.diff(key[order], axis=0) != 0).any(axis=1)
    return vertices[first], triangles[order[fresh]]


def _parts(triangles: np.ndarray, vertices: int) -> np.ndarray:
    """Number of the loose part (F,) that each triangle belongs to, counted from 0."""
    label = np.arange(vertices)
    while True:
        roots = label[triangles]
        low = roots.min(axis=1)
        if (roots == low[:, None]).all():
            return np.unique(low, return_inverse=True)[1].reshape(-1)

        np.minimum.at(label, roots.reshape(-1), np.repeat(low, 3))
        while (label[label] != label).any():
            label = label[label]


def _ragged(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For rows that hold ``counts`` items: the row of each item and its place in the row."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)


def _triangle_table(corners: np.ndarray) -> np.ndarray:
    """(F, 16): first corner, two edges, unit normal, and the edges' products, for
    ``_triangle_distance``.
    """
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ab, ac)
    area = np.linalg.norm(normal, axis=1)
    aa, bb, cross = (ab * ab).sum(1), (ac * ac).sum(1), (ab * ac).sum(1)
    inverse = np.where(area > 1e-12, 1.0 / np.maximum(area, 1e-12) ** 2, 0.0)
    return np.column_stack(
        [a, ab, ac, normal / np.maximum(area, 1e-12)[:, None], aa, bb, cross, inverse]
    )


def _triangle_distance(points: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Distance (N,) of each point (N, 3) to its own triangle, rows (N, 16) of the table."""
    x = points - rows[:, :3]
    u, v, height, xx = (
        np.einsum("ij,ij->i", x, y) for y in (rows[:, 3:6], rows[:, 6:9], rows[:, 9:12], x)
    )
    aa, bb, cross, inverse = rows[:, 12:].T.copy()
    s, t = (bb * u - cross * v) * inverse, (aa * v - cross * u) * inverse
    on_face = (s >= 0) & (t >= 0) & (s + t <= 1) & (inverse > 0)
    cc, w = aa + bb - 2 * cross, v - u + aa - cross
    edge = xx - 2 * u + aa
    for length, along, base in ((aa, u, xx), (bb, v, xx), (cc, w, edge.copy())):
        share = np.clip(along / np.maximum(length, 1e-18), 0.0, 1.0)
        np.minimum(edge, base + share * (share * length - 2 * along), out=edge)

    return np.sqrt(np.maximum(np.where(on_face, height * height, edge), 0.0))


def _unsigned(
    corners: np.ndarray, origin: np.ndarray, spacing: float, shape: tuple[int, int, int]
) -> Generator[float, None, np.ndarray]:
    """Distance (nx, ny, nz) float32 to the nearest of the triangles (F, 3, 3), truncated at
    ``BAND``; yields progress.

    Points strewn over each triangle name it to the nodes around them; then every node names its
    nearest triangle to its six neighbours, until none finds a nearer one. Every distance is an
    exact one to a triangle; that it is the nearest is missed at few nodes, by millimetres, where
    triangles are smaller than the spacing.
    """
    _, size_y, size_z = shape
    table = _triangle_table(corners)
    distance = np.full(int(np.prod(shape)), BAND, np.float32)
    nearest = np.full(len(distance), -1, np.int32)

    def offer(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """Measure pairs of node and triangle; returns the nodes that now know a nearer triangle."""
        found = np.empty(len(nodes), np.float32)
        for begin in range(0, len(nodes), _CHUNK):
            chunk = slice(begin, begin + _CHUNK)
            row, z = np.divmod(nodes[chunk], size_z)
            x, y = np.divmod(row, size_y)
            points = origin + spacing * np.stack([x, y, z], axis=1)
            found[chunk] = _triangle_distance(points, table[triangles[chunk]])

        better = found < distance[nodes]
        nodes, triangles, found = nodes[better], triangles[better], found[better]
        np.minimum.at(distance, nodes, found)
        wins = found == distance[nodes]
        nearest[nodes[wins]] = triangles[wins]

        changed = np.zeros(len(distance), bool)
        changed[nodes] = True
        return np.flatnonzero(changed)

    pairs = []
    for triangle, points in _strewn(corners, spacing):
        x, y, z = np.floor((points - origin) / spacing).astype(np.int64).T
        node = (x * size_y + y) * size_z + z
        pairs.append(np.unique(triangle * len(distance) + node))
        yield 0.0

    # Each point names its triangle to the eight nodes of its cell.
    triangle, node = np.divmod(np.unique(np.concatenate(pairs)), len(distance))
    cell = np.array([(x * size_y + y) * size_z + z for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    for begin in range(0, len(node), _SEEDS // 8):
        chunk = slice(begin, begin + _SEEDS // 8)
        offer((node[chunk, None] + cell).reshape(-1), np.repeat(triangle[chunk], 8))
        yield 0.5 * begin / len(node)

    # Then each node that knows a nearer one names it to its six neighbours.
    neighbours = np.array([size_y * size_z, -size_y * size_z, size_z, -size_z, 1, -1])
    active = np.flatnonzero(nearest >= 0)
    while len(active):
        changed = []
        for begin in range(0, len(active), _SEEDS // 6):
            wave = active[begin : begin + _SEEDS // 6]
            nodes, named = (wave[:, None] + neighbours).reshape(-1), np.repeat(nearest[wave], 6)
            unknown = nearest[nodes] != named
            changed.append(offer(nodes[unknown], named[unknown]))
            yield 0.5
        active = np.unique(np.concatenate(changed))

    return distance.reshape(shape)


def _strewn(corners: np.ndarray, spacing: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Points (N, 3) all over triangles (F, 3, 3), no farther apart than ``spacing``, and which
    triangle (N,) each lies on; ``_STREWN`` at a time.
    """
    # Rows run from the corner opposite the shortest side, so that slivers need few points.
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    turn = (np.argmin(sides, axis=1)[:, None] + np.array([2, 0, 1])) % 3
    apex, left, right = np.moveaxis(np.take_along_axis(corners, turn[..., None], axis=1), 1, 0)

    rows, columns = _rows_and_columns(corners, spacing)
    stops = np.cumsum(rows * columns)
    for begin in range(0, int(stops[-1]), _STREWN):
        item = np.arange(begin, min(begin + _STREWN, stops[-1]))
        triangle = np.searchsorted(stops, item, side="right")
        row, column = np.divmod(item - (stops - rows * columns)[triangle], columns[triangle])

        down = (row / np.maximum(rows - 1, 1)[triangle])[:, None]
        across = (column / np.maximum(columns - 1, 1)[triangle])[:, None]
        base = left[triangle] * (1 - across) + across * right[triangle]
        yield triangle, apex[triangle] * (1 - down) + down * base


def _rows_and_columns(corners: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Of the points (F,), (F,) that are strewn over each triangle, along its longest and its
    shortest side.
    """
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    rows, columns = np.ceil(sides.max(axis=1) / spacing), np.ceil(sides.min(axis=1) / spacing)
    return rows.astype(np.int64) + 1, columns.astype(np.int64) + 1


def _inside(
    corners: np.ndarray,
    parts: np.ndarray,
    origin: np.ndarray,
    spacing: float,
    shape: tuple[int, int, int],
) -> Generator[float, None, np.ndarray]:
    """Nodes (nx, ny, nz) that at least two of the three axes' grid lines find inside a loose part,
    by parity of crossings; yields progress.

    A line that crosses a part an odd number of times says nothing about it. Edges belong to one of
    their two triangles (half-open intervals), so a closed part is crossed an even number of times
    by every line.
    """
    votes = np.zeros(shape, np.int8)
    local = (corners - origin) / spacing
    for axis in range(3):
        across, along = (axis + 1) % 3, (axis + 2) % 3
        size = shape[across], shape[along], shape[axis]
        triangle, row, column, depth = _crossings(local[:, :, [across, along, axis]])
        line = row * size[1] + column
        inside = _between_crossings(line, depth, parts[triangle], size)
        votes += np.moveaxis(inside, (0, 1, 2), (axis, across, along))
        yield 0.5 + axis / 6

    return votes >= 2


def _crossings(
    points: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where grid lines along the last axis cross triangles (F, 3, 3), in units of the grid: the
    triangle, the line's row and column, and the depth on it, (N,) each.
    """
    first = np.ceil(points[:, :, 0].min(axis=1)).astype(int)
    triangle, step = _ragged(np.ceil(points[:, :, 0].max(axis=1)).astype(int) - first)
    row = step + first[triangle]

    # (column, depth) at the two edges of the triangle that cross the row
    ends = np.empty((len(triangle), 2, 2))
    entered = np.zeros(len(triangle), int)
    for begin, end in ((0, 1), (1, 2), (2, 0)):
        lower, upper = points[triangle, begin], points[triangle, end]
        # the same order, and so the same crossing, for both neighbours
        swap = (lower[:, 0] > upper[:, 0])[:, None]
        lower, upper = np.where(swap, upper, lower), np.where(swap, lower, upper)
        crossed = np.flatnonzero((lower[:, 0] <= row) & (row < upper[:, 0]))
        lower, upper = lower[crossed], upper[crossed]
        share = (row[crossed] - lower[:, 0]) / (upper[:, 0] - lower[:, 0])
        ends[crossed, entered[crossed]] = lower[:, 1:] + share[:, None] * (upper - lower)[:, 1:]
        entered[crossed] += 1

    ends = np.take_along_axis(ends, np.argsort(ends[:, :, :1], axis=1), axis=1)

    first = np.ceil(ends[:, 0, 0]).astype(int)
    span, step = _ragged(np.ceil(ends[:, 1, 0]).astype(int) - first)
    column = step + first[span]
    start, stop = ends[span, 0], ends[span, 1]
    depth = start[:, 1] + (column - start[:, 0]) / (stop[:, 0] - start[:, 0]) * (
        stop[:, 1] - start[:, 1]
    )
    return triangle[span], row[span], column, depth


def _between_crossings(
    line: np.ndarray, depth: np.ndarray, part: np.ndarray, size: tuple[int, int, int]
) -> np.ndarray:
    """Nodes (depth, row, column) between the first and second, third and fourth, … crossing of a
    grid line with a part, where these are even in number; ``size``: rows, columns, depths.
    """
    order = np.lexsort((depth, part, line))
    line, part, depth = line[order], part[order], depth[order]
    group = (
        np.concatenate([[0], np.cumsum((np.diff(line) != 0) | (np.diff(part) != 0))])
        if len(line)
        else line
    )
    count = np.bincount(group)
    place = np.arange(len(group)) - (np.cumsum(count) - count)[group]
    even = count[group] % 2 == 0

    rows, columns, depths = size
    changes = np.zeros((depths + 1) * rows * columns, np.int16)
    node = np.ceil(depth).astype(int) * (rows * columns) + line
    np.add.at(changes, node[even], np.where(place[even] % 2 == 0, 1, -1).astype(np.int16))
    changes = changes.reshape(-1, rows, columns)[:-1]
    return np.asarray(np.cumsum(changes, axis=0, dtype=np.int16) > 0)


def _furniture(
    corners: np.ndarray, part: np.ndarray, floor: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Which triangles (F,) are not floor, and which of them belong to rooms and buildings, as
    ``build_grid`` tells.
    """
    parts = int(part.max()) + 1
    low, high = np.full((parts, 3), np.inf), np.full((parts, 3), -np.inf)
    np.minimum.at(low, part, corners.min(axis=1))
    np.maximum.at(high, part, corners.max(axis=1))
    extent = np.sort(high - low, axis=1)
    room = (extent[:, 0] >= _ROOM[0]) & (extent[:, 2] >= _ROOM[1])
    if floor is None:
        return np.ones(len(corners), bool), room[part]

    height = corners @ floor[:3] + floor[3]
    bottom, top = np.full(parts, np.inf), np.full(parts, -np.inf)
    np.minimum.at(bottom, part, height.min(axis=1))
    np.maximum.at(top, part, height.max(axis=1))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    level = np.abs(normal @ floor[:3]) > _FLAT * np.linalg.norm(normal, axis=1)
    ground = level & (np.abs(height) <= FLOOR).all(axis=1)
    room |= (bottom < -FLOOR) & (np.bincount(part, ground, parts) > 0)
    underfoot = level & (height <= FLOOR).all(axis=1) & room[part]
    return (top > FLOOR)[part] & ~underfoot, room[part]


@stepwise
def build_grid(
    vertices: np.ndarray, triangles: np.ndarray, floor: np.ndarray | None = None
) -> Generator[float, None, DistanceGrid]:
    """Distance grid of a mesh, ``vertices`` (V, 3) in its rigid space, metres; ``triangles`` (F,
    3).

    ``floor`` (4,): upward unit normal and offset of the root's plane, so that a point's height over
    it is ``point @ floor[:3] + floor[3]``; without it nothing is taken for floor. Nodes are 2 cm
    apart, wider for a mesh that would need too many: from 53 square metres of surface or 48 cubic
    metres of box on; 4 cm for a furnished room.

    Ignored: loose parts that rise less than 5 cm over the floor (floors, slabs, rugs), and the
    floor of rooms and buildings. A part that could hold a standing person (1.4 m in each direction,
    1.9 m in one), or that reaches under the floor and also carries it, is a room or a building: its
    surfaces are thin shells, because the character walks where rays would find the inside of a
    solid.
    """
    triangles = np.asarray(triangles, np.int64).reshape(-1, 3)
    empty = DistanceGrid(np.zeros(3), _FINEST, np.full((2, 2, 2), BAND, np.float32))
    if not len(triangles):
        return empty

    vertices, triangles = _welded(np.asarray(vertices, float), triangles)
    if not len(triangles):
        return empty

    yield 0.0
    part, corners = _parts(triangles, len(vertices)), vertices[triangles]
    kept, room = _furniture(corners, part, floor)
    solid, corners, part = ~room[kept], corners[kept], part[kept]
    if not len(corners):
        return empty

    first, last = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    size = last - first + 2 * (BAND + _FINEST)
    area = (
        0.5
        * np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        ).sum()
    )
    spacing = max(
        _FINEST,
        (2 * BAND * area / _MAX_BAND_NODES) ** (1 / 3),
        (3 * area / _MAX_BAND_NODES) ** (1 / 2),
        (size.prod() / _MAX_NODES) ** (1 / 3),
    )
    while _too_many(corners, last - first, spacing):
        spacing *= 1.25

    origin = first - (BAND + spacing)
    nx, ny, nz = (np.ceil((last + BAND + spacing - origin) / spacing).astype(int) + 1).tolist()
    values = yield from _unsigned(corners, origin, spacing, (nx, ny, nz))
    inside = yield from _inside(corners[solid], part[solid], origin, spacing, (nx, ny, nz))
    return DistanceGrid(origin, float(spacing), np.where(inside, -values, values))


def _too_many(corners: np.ndarray, size: np.ndarray, spacing: float) -> bool:
    """Whether a grid over ``size`` (3,) had too many nodes, or its triangles too many points: of
    huge sheets and needles.
    """
    rows, columns = _rows_and_columns(corners, spacing)
    nodes = (np.ceil((size + 2 * (BAND + spacing)) / spacing) + 1).prod()
    return bool(nodes > 2 * _MAX_NODES or (rows * columns).sum() - 4 * len(corners) > _MAX_SEEDS)


_cache: OrderedDict[bytes, DistanceGrid] = OrderedDict()


def _floor_plane(rigid: np.ndarray, floor: float) -> np.ndarray | None:
    """Root's plane (4,) in the rigid space; None for an object that does not stay at one height
    over it, or upright.
    """
    frames = rigid.reshape(-1, 4, 4)
    planes = np.concatenate([frames[:, 2, :3], frames[:, 2, 3:] - floor], axis=1)
    if np.abs(planes - planes[0]).max() > 0.01:
        return None
    return planes[0]


@stepwise
def grid_of(mesh: Mesh, floor: float) -> Generator[float, None, DistanceGrid]:
    """The mesh's distance grid: its own, one made before for the same geometry, or a new one.

    ``floor``: height of the root's plane in the world (metres). The scale of the first frame
    counts. Grids are kept in memory by geometry, scale and floor, the last half gigabyte of them.
    """
    if mesh.grid is not None:
        return mesh.grid

    rigid, linear = rigid_split(mesh.matrix)
    vertices = np.asarray(mesh.vertices, float) @ linear.reshape(-1, 3, 3)[0].T
    plane = _floor_plane(rigid, floor)
    if plane is not None and len(vertices) and (vertices @ plane[:3] + plane[3]).min() > FLOOR:
        plane = None  # nothing of it can be floor: one grid for a row of books, whatever the shelf

    key = hashlib.blake2b(np.rint(vertices * 1e5).astype(np.int64).tobytes(), digest_size=16)
    key.update(np.asarray(mesh.triangles, np.int64).tobytes())
    key.update(b"" if plane is None else np.rint(plane * 1e4).astype(np.int64).tobytes())
    name = key.digest()
    if name not in _cache:
        _cache[name] = yield from build_grid.steps(vertices, np.asarray(mesh.triangles), plane)

    _cache.move_to_end(name)
    while len(_cache) > 1 and sum(grid.values.nbytes for grid in _cache.values()) > _CACHED_BYTES:
        _cache.popitem(last=False)

    return _cache[name]


@stepwise
def prepared(
    scene: Scene,
    floor: float,
    size: float = 1.0,
) -> Generator[float, None, tuple[Scene, tuple[str, ...]]]:
    """The scene with every mesh's grid filled, and warnings for the user, one sentence each; yields
    progress.

    ``size``: that of the character for which the scene was ``scaled``.
    """
    solids: list[Box | Mesh] = []
    warnings = []
    for solid in scene.solids:
        if isinstance(solid, Mesh):
            done, one = len(solids) / len(scene.solids), 1 / len(scene.solids)
            grid = yield from within(grid_of.steps(solid, floor), done, done + one)
            solid = replace(solid, grid=grid)
            across = max(grid.values.shape) * grid.spacing
            linear = rigid_split(solid.matrix)[1].reshape(-1, 3, 3)
            if np.abs(linear - linear[0]).max() > 0.01 * max(np.abs(linear[0]).max(), 1e-6):
                warnings.append(
                    f"The scale of '{solid.name}' is animated; its size on the first frame is used."
                )
            if grid.spacing > _COARSE and across > _VAST:
                warnings.append(
                    f"'{solid.name}' is {across * size:,.0f} m across, so it is hardly seen: is "
                    "its unit right?"
                )
            elif grid.spacing > _COARSE:
                warnings.append(
                    f"'{solid.name}' is so large that it is seen only every "
                    f"{100 * size * grid.spacing:.0f} cm; "
                    "separate the furniture from it, or split it into parts."
                )
        solids.append(solid)

    return Scene(tuple(solids)), tuple(warnings)


def scaled(scene: Scene, factor: float) -> Scene:
    """The scene ``factor`` times as large, about the world's origin; grids that are there are
    kept.
    """
    solids: list[Box | Mesh] = []
    for solid in scene.solids:
        if isinstance(solid, Box):
            center, half_size = (
                np.asarray(solid.center) * factor,
                np.asarray(solid.half_size) * factor,
            )
            solids.append(replace(solid, center=center, half_size=half_size))
        else:
            matrix = np.diag([factor, factor, factor, 1.0]) @ np.asarray(solid.matrix, float)
            grid = None if solid.grid is None else solid.grid.scaled(factor)
            solids.append(replace(solid, matrix=matrix, grid=grid))

    return Scene(tuple(solids))
