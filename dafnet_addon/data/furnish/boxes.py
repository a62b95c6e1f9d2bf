"""Upright boxes as arrays, and their occupancy in the sensor: the furniture that training composes.

A piece of furniture is rows of a (B, 7) array: centre x y z, half sizes x y z, yaw (radians,
counter-clockwise). World, metres.
"""

import numpy as np

from ...core.root import RootPath
from ...core.rotations import rotate, transpose, yaw_matrix
from ...core.sensor import RADIUS, REACH, SPHERES, occupancy_of_distance

__all__ = ["NO_BOXES", "MOST", "ABSENT", "box", "placed", "distances", "near", "occupancy"]

NO_BOXES = np.zeros((0, 7))
MOST = 64
"""Boxes that a training window holds at most."""
ABSENT = np.array([0.0, 0.0, -9.0, 0.0, 0.0, 0.0, 0.0])
"""A box that no sensor sees: fills up the rows of a window."""
_LAYERS = 15
_DISC = SPHERES[: len(SPHERES) // _LAYERS, :2]
_HEIGHTS = SPHERES[:: len(_DISC), 2]


def box(
    center: tuple[float, float, float], size: tuple[float, float, float], yaw: float = 0.0
) -> np.ndarray:
    """One row: a box of full ``size`` about ``center``."""
    return np.array([*center, *(0.5 * s for s in size), yaw])


def placed(boxes: np.ndarray, position: np.ndarray, yaw: float) -> np.ndarray:
    """Boxes of a piece's own frame, turned by ``yaw`` and moved to ``position`` (2,) on the
    floor.
    """
    out = boxes.copy()
    out[:, :3] = rotate(yaw_matrix(np.array(yaw)), boxes[:, :3])
    out[:, :2] += position
    out[:, 6] += yaw
    return out


def distances(boxes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Signed distance (B, N) of world ``points`` (N, 3) to each box, negative inside."""
    local = rotate(transpose(yaw_matrix(boxes[:, 6]))[:, None], points[None] - boxes[:, None, :3])
    q = np.abs(local) - boxes[:, None, 3:6]
    return np.sqrt((np.maximum(q, 0.0) ** 2).sum(-1)) + np.minimum(q.max(-1), 0.0)


def near(boxes: np.ndarray, path: RootPath) -> np.ndarray:
    """The boxes that the sensor may see along a path, the nearest first, filled up or cut to (MOST,
    7).
    """
    gap = np.linalg.norm(path.position[None, :, :2] - boxes[:, None, :2], axis=-1).min(
        1, initial=np.inf
    )
    gap -= np.linalg.norm(boxes[:, 3:5], axis=1)
    order = np.argsort(gap)[:MOST]
    out = np.tile(ABSENT, (MOST, 1))
    kept = boxes[order[gap[order] < REACH + RADIUS]]
    out[: len(kept)] = kept
    return out


def occupancy(boxes: np.ndarray, path: RootPath) -> np.ndarray:
    """Occupancy (T, 2640) float32 of static upright boxes along a root path on the floor z = 0.

    Equal to ``core.occupancy`` of the same boxes; both being upright, the distance is one in the
    plane and one in height, which costs a hundredth of the distances in space.
    """
    out = np.zeros((len(path), _LAYERS, len(_DISC)), dtype=np.float32)
    for center, half, yaw in zip(boxes[:, :3], boxes[:, 3:6], boxes[:, 6], strict=True):
        near = np.flatnonzero(
            np.linalg.norm(path.position[:, :2] - center[:2], axis=1)
            < REACH + RADIUS + np.linalg.norm(half[:2])
        )
        above = np.abs(_HEIGHTS - center[2]) - half[2]
        layers = np.flatnonzero(above < RADIUS)
        if not len(near) or not len(layers):
            continue

        angle = path.yaw[near] - yaw
        c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
        offset = rotate(yaw_matrix(np.array(-yaw)), path.position[near] - center)
        q = np.stack(
            [
                np.abs(c * _DISC[:, 0] - s * _DISC[:, 1] + offset[:, :1]) - half[0],
                np.abs(s * _DISC[:, 0] + c * _DISC[:, 1] + offset[:, 1:2]) - half[1],
            ],
            axis=-1,
        )
        inside = np.minimum(q.max(-1), 0.0)
        outside = np.sqrt((np.maximum(q, 0.0) ** 2).sum(-1))
        frame, spot = np.nonzero(outside < RADIUS)
        plane_out, plane_in = outside[frame, spot][:, None], inside[frame, spot][:, None]
        height = above[layers]
        d = np.hypot(plane_out, np.maximum(height, 0.0))
        # Inside in both plane and height: the nearer of the two faces counts.
        d = np.where((plane_out == 0) & (height <= 0), np.maximum(plane_in, height), d)
        index = (near[frame][:, None], layers[None, :], spot[:, None])
        out[index] = np.maximum(out[index], occupancy_of_distance(d))

    return out.reshape(len(path), -1)
