"""The environment sensor: 2640 spheres in a cylinder around the root, each with its occupancy.

Paper, section 4.1, after the Neural State Machine's sensor. The cylinder stands upright on the
root's frame: 15 layers from the floor to 2 m, in each of them 7 rings out to 1 m, 176 spheres a
layer.

The paper does not say how large the spheres are. Where they only touch one another (a radius of
half their spacing, as its author's code has it), a solid's top between the layers k and k + 1/2
fills the one and does not reach the other: tops that lie up to 7 cm apart look alike, and what is
learnt is to sit in the middle of them. These overlap: there is no height that looks like another.
"""

import numpy as np

__all__ = ["RADIUS", "REACH", "HEIGHT", "SPHERES", "narrowed", "occupancy_of_distance"]

_SPACING = 1.0 / 7.0
RADIUS = _SPACING
"""Radius of one sphere (metres): the next layer's centre is as far away."""
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


def narrowed(occupancy: np.ndarray, radius: float) -> np.ndarray:
    """What spheres of ``radius`` (metres, at most ``RADIUS``) see, of what these see."""
    return np.clip(1.0 - (1.0 - occupancy) * (RADIUS / radius), 0.0, 1.0)
