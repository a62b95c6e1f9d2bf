"""A captured skeleton as its file has it: joints by name, in the file's own units and axes; and how bones pose it."""

from dataclasses import dataclass

import numpy as np

from ..core.rotations import rotate

__all__ = ["Recording", "rotation_about", "posed"]


@dataclass(frozen=True)
class Recording:
    """``positions`` (T, J, 3): joints in the file's units and axes. ``rest`` (J, 3): the skeleton with no rotation at all.

    ``rate``: frames a second, or None where the file does not say. ``unit``: metres of one of its units, or None likewise.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: np.ndarray
    rest: np.ndarray
    rate: float | None
    unit: float | None = None

    def __len__(self) -> int:
        return len(self.positions)


def rotation_about(axis: str, angle: np.ndarray) -> np.ndarray:
    """Rotations (…, 3, 3) by ``angle`` radians about 'x', 'y' or 'z'."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    out = np.zeros((*np.shape(angle), 3, 3))
    out[..., i, i] = 1.0
    out[..., j, j] = out[..., k, k] = np.cos(angle)
    out[..., k, j] = np.sin(angle)
    out[..., j, k] = -out[..., k, j]
    return out


def posed(parents: tuple[int, ...], offsets: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Positions (T, J, 3) of joints at ``offsets`` (J, 3) or (T, J, 3) in their parents' frames, turned by ``local``.

    ``local`` (T, J, 3, 3) are rotations in the parent's frame; parents come before their children, the first joint is the
    root, whose offset is its position.
    """
    offsets = np.broadcast_to(offsets, (*local.shape[:2], 3))
    turned, positions = local.copy(), offsets.copy()
    for j, parent in enumerate(parents[1:], start=1):
        positions[:, j] = positions[:, parent] + rotate(turned[:, parent], offsets[:, j])
        turned[:, j] = turned[:, parent] @ local[:, j]
    return positions
