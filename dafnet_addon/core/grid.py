"""A signed distance grid, and how it is sampled; ``core.distance`` makes them of meshes."""

from dataclasses import dataclass, field

import numpy as np

__all__ = ["BAND", "DistanceGrid"]

BAND = 0.15
"""Distances are truncated here (metres)."""


@dataclass(frozen=True)
class DistanceGrid:
    """Signed distance (negative inside, metres) at the nodes of a regular grid in a mesh's rigid
    space.

    ``origin`` (3,): the first node. ``spacing``: metres between nodes. ``values`` (nx, ny, nz)
    float32, at most ``truncation``, which all nodes of the border have.
    """

    origin: np.ndarray
    spacing: float
    values: np.ndarray
    truncation: float = BAND
    _bounds: dict[float, tuple[np.ndarray, np.ndarray]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def sample(self, points: np.ndarray) -> np.ndarray:
        """Trilinear distance (…) float32 at ``points`` (…, 3) in the rigid space; the truncation
        outside the grid.
        """
        shape = np.array(self.values.shape)
        at = ((points - self.origin) / self.spacing).astype(np.float32)
        at = np.clip(at, 0.0, (shape - 1 - 1e-3).astype(np.float32))
        cell = at.astype(np.int32)
        f = at - cell.astype(np.float32)
        fx, fy, fz = f[..., 0], f[..., 1], f[..., 2]
        _, ny, nz = self.values.shape
        node = (cell[..., 0] * ny + cell[..., 1]) * nz + cell[..., 2]
        values = self.values.reshape(-1)

        def along_z(n: np.ndarray) -> np.ndarray:
            near = values[n]
            return near + fz * (values[n + 1] - near)

        near, far = along_z(node), along_z(node + ny * nz)
        near = near + fy * (along_z(node + nz) - near)
        far = far + fy * (along_z(node + (ny + 1) * nz) - far)
        return near + fx * (far - near)

    def bounds(self, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Corners (3,), (3,) of the box outside which samples are at least ``reach``; turned inside
        out if empty.
        """
        if reach not in self._bounds:  # a crowd asks for the same again and again
            self._bounds[reach] = self._found_bounds(reach)
        return self._bounds[reach]

    def _found_bounds(self, reach: float) -> tuple[np.ndarray, np.ndarray]:
        near = self.values < reach
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for axis in range(3):
            hit = np.flatnonzero(near.any(axis=tuple(k for k in range(3) if k != axis)))
            if len(hit):
                low[axis] = self.origin[axis] + (hit[0] - 1) * self.spacing
                high[axis] = self.origin[axis] + (hit[-1] + 1) * self.spacing
        return low, high

    def scaled(self, factor: float) -> "DistanceGrid":
        """The grid of the same mesh, ``factor`` times as large."""
        values = self.values * np.float32(factor)
        return DistanceGrid(
            self.origin * factor, self.spacing * factor, values, self.truncation * factor
        )
