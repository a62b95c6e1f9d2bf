"""Rotation matrices and quaternions (w, x, y, z) as vectorised array functions; leading axes are
free.
"""

import numpy as np

__all__ = [
    "normalised",
    "frame_from",
    "rotation_between",
    "rotate",
    "transpose",
    "yaw_matrix",
    "quaternion_from_matrix",
    "matrix_from_quaternion",
    "matrix_from_vector",
    "continuous_signs",
    "slerp",
]


def normalised(v: np.ndarray, fallback: np.ndarray | None = None) -> np.ndarray:
    """Unit vectors along the last axis; where the length is under 1e-8, ``fallback`` (or zero) is
    given instead.
    """
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    unit = v / np.maximum(length, 1e-8)
    return unit if fallback is None else np.where(length > 1e-8, unit, fallback)


def frame_from(primary: np.ndarray, secondary: np.ndarray, axes: str) -> np.ndarray:
    """Right-handed frame (…, 3, 3), columns are axes: ``axes[0]`` exactly along ``primary``,
    ``axes[1]`` near ``secondary``.
    """
    a, b = "xyz".index(axes[0]), "xyz".index(axes[1])
    c = 3 - a - b
    first = normalised(primary)
    sign = 1.0 if (b - a) % 3 == 1 else -1.0
    third = normalised(np.cross(first, secondary)) * sign
    columns: list[np.ndarray] = [first, first, first]
    columns[c] = third
    columns[b] = np.cross(third, first) * sign
    columns[a] = first
    return np.stack(columns, axis=-1)


def rotation_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Smallest rotation (…, 3, 3) that takes direction ``a`` onto direction ``b``."""
    a, b = np.broadcast_arrays(normalised(a), normalised(b))
    (ax, ay, az), (bx, by, bz) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx  # of a × b
    cos = (a * b).sum(-1)[..., None, None]
    k = np.zeros((*a.shape, 3))
    k[..., 0, 1], k[..., 0, 2], k[..., 1, 2] = -z, y, -x
    k[..., 1, 0], k[..., 2, 0], k[..., 2, 1] = z, -y, x
    smooth = np.eye(3) + k + k @ k / np.maximum(1.0 + cos, 1e-8)
    opposite = cos < -1.0 + 1e-7
    if not opposite.any():
        return np.asarray(smooth)
    other = normalised(np.cross(a, np.where(np.abs(a[..., :1]) < 0.9, [1.0, 0, 0], [0, 1.0, 0])))
    half_turn = 2.0 * other[..., :, None] * other[..., None, :] - np.eye(3)
    return np.where(opposite, half_turn, smooth)


def rotate(matrix: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Apply (…, 3, 3) matrices to (…, 3) vectors."""
    return np.einsum("...ij,...j->...i", matrix, v)


def transpose(matrix: np.ndarray) -> np.ndarray:
    """Inverse of rotation matrices."""
    return np.swapaxes(matrix, -1, -2)


def yaw_matrix(angle: np.ndarray) -> np.ndarray:
    """Rotation about z by ``angle`` radians, counter-clockwise seen from above."""
    c, s = np.cos(angle), np.sin(angle)
    m = np.zeros((*np.shape(angle), 3, 3))
    m[..., 0, 0], m[..., 0, 1], m[..., 1, 0], m[..., 1, 1], m[..., 2, 2] = c, -s, s, c, 1.0
    return m


def quaternion_from_matrix(m: np.ndarray) -> np.ndarray:
    """Unit quaternions (…, 4), w x y z, of rotation matrices."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = (np.moveaxis(m[..., i, :], -1, 0) for i in range(3))
    # Four forms, one from each component; the longest is the one that does not divide by little.
    candidates = np.stack(
        [
            np.stack([1 + xx + yy + zz, zy - yz, xz - zx, yx - xy], -1),
            np.stack([zy - yz, 1 + xx - yy - zz, yx + xy, xz + zx], -1),
            np.stack([xz - zx, yx + xy, 1 - xx + yy - zz, zy + yz], -1),
            np.stack([yx - xy, xz + zx, zy + yz, 1 - xx - yy + zz], -1),
        ],
        axis=-2,
    )
    best = np.argmax(np.linalg.norm(candidates, axis=-1), axis=-1)
    return normalised(np.take_along_axis(candidates, best[..., None, None], axis=-2)[..., 0, :])


def matrix_from_quaternion(q: np.ndarray) -> np.ndarray:
    """Rotation matrices (…, 3, 3) of quaternions, which need not be of unit length."""
    w, x, y, z = np.moveaxis(normalised(q), -1, 0)
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        axis=-2,
    )


def matrix_from_vector(vectors: np.ndarray) -> np.ndarray:
    """Rotations (…, 3, 3) of axis-angle vectors (…, 3), by Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(normalised(vectors), -1, 0)
    zero = np.zeros_like(x)
    k = np.stack([np.stack(row, -1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))], -2)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def continuous_signs(q: np.ndarray) -> np.ndarray:
    """Flip signs along the first axis (time) so that neighbours lie on the same half of the
    sphere.
    """
    dots = (q[1:] * q[:-1]).sum(-1, keepdims=True)
    flips = np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0)
    return np.concatenate([q[:1], q[1:] * flips])


def slerp(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Shortest spherical interpolation between quaternions; ``t`` in [0, 1] broadcasts against
    their leading axes.
    """
    t = np.asarray(t, dtype=float)[..., None]
    dot = (a * b).sum(-1, keepdims=True)
    b = np.where(dot < 0, -b, b)
    dot = np.clip(np.abs(dot), 0.0, 1.0)
    angle = np.arccos(dot)
    near = angle < 1e-4
    sine = np.where(near, 1.0, np.sin(angle))
    wa = np.where(near, 1 - t, np.sin((1 - t) * angle) / sine)
    wb = np.where(near, t, np.sin(t * angle) / sine)
    return normalised(wa * a + wb * b)
