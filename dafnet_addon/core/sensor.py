"""The environment sensor: 2640 spheres in a cylinder around the root, each with its occupancy.

Paper, section 4.1, after the Neural State Machine's sensor. The cylinder stands upright on the
root's frame: 15 layers from the floor to 2 m, in each of them 7 rings out to 1 m, 176 spheres a
layer.
"""

import numpy as np

__all__ = ["RADIUS", "REACH", "HEIGHT", "SPHERES", "occupancy_of_distance"]

_SPACING = 1.0 / 7.0
RADIUS = _SPACING / 2.0
"""Radius of one sphere (metres)."""
REACH = 1.0
"""Radius of the cylinder (metres), to the outermost centres."""
HEIGHT = 2.0
"""Height of the cylinder (metres), to the highest centres."""


def _spheres() -> np.ndarray:
    rings = []
    for k in range(8):
        count = round(2.0 * np.pi * k)
        angle = 2.0 * np.pi * np.arange(count) / max(count, 1)
        rings.append(np.stack([k * _SPACING * np.cos(angle), k * _SPACING * np.sin(angle)], axis=1))

    layer = np.concatenate(rings)
    heights = np.arange(15) * _SPACING
    flat = np.broadcast_to(layer, (15, len(layer), 2))
    return np.concatenate(
        [flat, np.broadcast_to(heights[:, None, None], (15, len(layer), 1))], axis=2
    ).reshape(-1, 3)


SPHERES = _spheres()
"""(2640, 3) centres in the root's frame, layer by layer from the floor up, ring by ring from the
inside out.
"""


def occupancy_of_distance(distance: np.ndarray) -> np.ndarray:
    """Occupancy in [0, 1] of spheres whose centres have this signed distance to the nearest solid
    (negative inside).
    """
    return np.clip(1.0 - distance / RADIUS, 0.0, 1.0)
