"""What the sensor's spheres see of the furniture along a root path, and the distance of any points
to it.

Paper, section 4.1: a sphere's occupancy is 0 where nothing is within it, 1 where its centre is
inside a solid, and in between it falls with the distance from its centre to the solid.
"""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from .checks import in_frames
from .distance import FLOOR, grid_of, rigid_frames
from .grid import BAND
from .progress import stepwise
from .root import RootPath
from .rotations import rotate, transpose
from .sensor import HEIGHT, RADIUS, REACH, SPHERES, occupancy_of_distance
from .solids import Box, Scene, box_distance

__all__ = ["occupancy", "distance", "tops_under"]

_FRAMES_AT_ONCE = 32
_SKIN = 1e-6  # metres, for rounding
# Tops are looked for between these heights over the floor, in such steps, metres.
_LOWEST = 0.15
_HIGHEST = 0.925
_APART = 0.025
_NEAR = 0.03

# What carries the hips: spots to the right and forward of the root, metres.
_SPOTS = np.array([(x, y, 0.0) for x in (-0.09, 0.0, 0.09) for y in (-0.07, 0.0, 0.07)])
_CARRYING = 5  # of these must have a top


@dataclass(frozen=True)
class _Field:
    """One solid over T frames, in whose own frame ``measure`` gives the distance of points (N, 3).

    ``rotation`` (T, 3, 3), ``position`` (T, 3): its rigid frames. ``present`` (T,): where it is
    more than floor. ``low``, ``high`` (3,): outside this box every distance is beyond the reach.
    """

    rotation: np.ndarray
    position: np.ndarray
    present: np.ndarray
    low: np.ndarray
    high: np.ndarray
    measure: Callable[[np.ndarray], np.ndarray]


def _fields(scene: Scene, floor: np.ndarray, reach: float) -> Iterator[_Field]:
    frames = len(floor)
    for solid in scene.solids:
        matrices = rigid_frames(solid)
        in_frames(matrices, solid.name, frames)
        matrices = np.broadcast_to(matrices, (frames, 4, 4))
        rotation, position = matrices[:, :3, :3], matrices[:, :3, 3]
        if isinstance(solid, Box):
            half = np.asarray(solid.half_size, float)
            top = position[:, 2] + np.abs(rotation[:, 2]) @ half
            present = top > floor + FLOOR
            measure = partial(box_distance, half_size=half)
            yield _Field(rotation, position, present, -half - reach, half + reach, measure)
        else:
            grid = grid_of(solid, float(np.median(floor)))
            low, high = grid.bounds(min(reach, 0.999 * grid.truncation))
            if (low < high).all():
                yield _Field(rotation, position, np.ones(frames, bool), low, high, grid.sample)


def _once_each(scene: Scene, path: RootPath) -> tuple[np.ndarray, np.ndarray]:
    """The first frame (N,) of every stretch in which the root and all solids stand still, and which
    of them each frame (T,) is in: who sits sees the same again and again.
    """
    frames = len(path)
    moving = any(rigid_frames(solid).reshape(-1, 4, 4).shape[0] > 1 for solid in scene.solids)
    changes = np.ones(frames, bool)
    if not moving:
        moved = (path.position[1:] != path.position[:-1]).any(axis=1)
        # of one frame alone, matrix products are rounded in another way than of several
        changes[2:] = moved[1:] | (path.yaw[2:] != path.yaw[1:-1])
    return np.flatnonzero(changes), np.cumsum(changes) - 1


def _at(path: RootPath, frames: np.ndarray) -> RootPath:
    return RootPath(path.position[frames], path.yaw[frames])


@stepwise
def occupancy(scene: Scene, path: RootPath) -> Generator[float, None, np.ndarray]:
    """Occupancy (T, 2640) float32 of the sensor on every frame of ``path``, the largest over all
    solids.

    Solids are static or have one matrix for each frame of the path. The sensor has the canonical
    body's size: for another body, scale scene (``distance.scaled``) and path first. Surfaces within
    5 cm of the floor are not seen (``distance.build_grid``). Yields progress. Raises InputError
    where a solid's frames are not the path's.
    """
    first, which = _once_each(scene, path)
    if len(first) < len(path):
        return (yield from occupancy.steps(scene, _at(path, first)))[which]

    out = np.zeros((len(path), len(SPHERES)), np.float32)
    centres = SPHERES.T.astype(np.float32)
    for count, field in enumerate(_fields(scene, path.position[:, 2], RADIUS)):
        inverse = transpose(field.rotation)
        turn, shift = inverse @ path.rotation, rotate(inverse, path.position - field.position)
        middle = shift + turn[:, :, 2] * (HEIGHT / 2) - (field.low + field.high) / 2
        gap = box_distance(middle, (field.high - field.low) / 2)
        seen = np.flatnonzero(field.present & (gap < np.hypot(REACH, HEIGHT / 2)))
        turn, shift = turn.astype(np.float32), shift.astype(np.float32)
        for k in range(0, len(seen), _FRAMES_AT_ONCE):
            frames = seen[k : k + _FRAMES_AT_ONCE]
            local = [turn[frames, axis] @ centres + shift[frames, axis, None] for axis in range(3)]
            sides = zip(local, field.low, field.high, strict=True)
            near = np.logical_and.reduce([(x > low) & (x < high) for x, low, high in sides])
            found = occupancy_of_distance(
                field.measure(np.stack([x[near] for x in local], axis=-1))
            )
            row, sphere = np.nonzero(near)
            at = frames[row], sphere
            out[at] = np.maximum(out[at], found)
            yield (count + k / len(seen)) / len(scene.solids)

    return out


def distance(scene: Scene, points: np.ndarray, floor: np.ndarray | float) -> np.ndarray:
    """Signed distance (T, N) of world ``points`` (T, N, 3) to the nearest solid, negative inside,
    at most ``BAND``.

    ``floor``: height of the root's plane, one number or (T,). Solids as for ``occupancy``, metres.
    """
    out = np.full(points.shape[:2], BAND)
    if not points.size:
        return out

    low, high = points.min(axis=1), points.max(axis=1)
    middle, around = (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2
    for field in _fields(scene, np.broadcast_to(np.asarray(floor, float), len(points)), BAND):
        inverse = transpose(field.rotation)
        away = rotate(inverse, middle - field.position) - (field.low + field.high) / 2
        gap = box_distance(away, (field.high - field.low) / 2)
        frames = np.flatnonzero(field.present & (gap < around + _SKIN))
        if not len(frames):
            continue
        shift = points[frames] - field.position[frames, None]
        local = rotate(inverse[frames, None], shift)
        near = ((local > field.low) & (local < field.high)).all(axis=-1)
        row, point = np.nonzero(near)
        at = frames[row], point
        out[at] = np.minimum(out[at], field.measure(local[near]))
    return out


def tops_under(scene: Scene, path: RootPath) -> np.ndarray:
    """Height (T,) in the world of what could carry a body that sits where the root is: the highest
    surface between 15 and 90 cm over the floor, under the hips in the median; NaN where there is
    none. Canonical metres, solids as for ``occupancy``.
    """
    if not scene.solids:
        return np.full(len(path), np.nan)

    first, which = _once_each(scene, path)
    if len(first) < len(path):
        return tops_under(scene, _at(path, first))[which]

    heights = np.arange(_LOWEST, _HIGHEST, _APART)
    spots = path.position[:, None] + rotate(path.rotation[:, None], _SPOTS)
    columns = spots[:, :, None] + heights[:, None] * (0.0, 0.0, 1.0)
    found = distance(scene, columns.reshape(len(path), -1, 3), path.position[:, 2]).reshape(
        len(path), len(_SPOTS), -1
    )
    # Seen from above, the first place that is near a surface is over it by its distance.
    near = found < _NEAR
    highest = near.shape[-1] - 1 - near[..., ::-1].argmax(-1)
    top = heights[highest] - np.take_along_axis(found, highest[..., None], -1)[..., 0]
    top[~near.any(-1)] = np.nan
    carried = np.isfinite(top).sum(-1) >= _CARRYING
    out = np.full(len(path), np.nan)
    out[carried] = np.nanmedian(top[carried], axis=-1) + path.position[carried, 2]
    return out
