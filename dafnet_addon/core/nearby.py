"""Which of a scene's solids come near a character, told by their boxes alone: only those need to be
measured.
"""

from collections.abc import Sequence

import numpy as np

from .distance import rigid_split
from .sensor import HEIGHT
from .solids import Box, Mesh, Scene

__all__ = ["REACH_OF_A_BODY", "bounds", "extent", "solids_near"]

REACH_OF_A_BODY = 2.0
"""Metres from the upright line over a root within which all of the body, what it can feel and the
sensor are.
"""

_CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def solids_near(scene: Scene, places: np.ndarray, reach: float, size: float = 1.0) -> Scene:
    """The solids that come within ``reach`` of a body that stands at ``places`` (T, 3), on the
    floor; canonical metres.

    ``size``: how many metres of the scene and of ``places`` one of them is. Solids are static or
    have a matrix for each place. A body is here an upright line of 2 m, a solid the box around it,
    so more may be found than really come near, never less.
    """
    return Scene(tuple(s for s in scene.solids if _gap(s, places, HEIGHT * size) < reach * size))


def extent(solids: Sequence[Box | Mesh]) -> float:
    """The longest side of the box around solids in the first frame, metres."""
    boxes = [
        np.stack(bounds(s)).reshape(2, -1, 3)[:, 0]
        for s in solids
        if not isinstance(s, Mesh) or len(s.triangles)
    ]
    return float((np.max(boxes, axis=(0, 1)) - np.min(boxes, axis=(0, 1))).max()) if boxes else 0.0


def _gap(solid: Box | Mesh, places: np.ndarray, height: float) -> float:
    """Metres between a solid's box and upright lines over ``places`` (T, 3) at the same time;
    infinite without triangles.
    """
    if isinstance(solid, Mesh) and not len(solid.triangles):
        return np.inf
    low, high = bounds(solid)
    beyond = np.maximum(np.maximum(low - places - (0.0, 0.0, height), places - high), 0.0)
    return float(np.sqrt((beyond**2).sum(axis=-1).min()))


def bounds(solid: Box | Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Corners (3,) or (T, 3) of the upright boxes around a solid, as large as it is in the first
    frame.
    """
    if isinstance(solid, Box):
        matrices, corners = solid.matrices(), _CORNERS * solid.half_size
    else:
        low, high = solid.span
        matrices, linear = rigid_split(solid.matrix)
        corners = (0.5 * (low + high) + 0.5 * (high - low) * _CORNERS) @ linear.reshape(-1, 3, 3)[
            0
        ].T

    world = corners @ np.swapaxes(matrices[..., :3, :3], -1, -2) + matrices[..., None, :3, 3]
    return world.min(axis=-2), world.max(axis=-2)
