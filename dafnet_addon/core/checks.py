"""What is given is checked here before anything is computed from it: numbers, and arrays of them.

Every refusal is an ``InputError`` that names ``what`` it is about. What passes is finite, of the
shape that was asked for, and of a size that the arithmetic after it can bear.
"""

from numbers import Integral, Real

import numpy as np

from .errors import InputError
from .text import printable

__all__ = [
    "FARTHEST",
    "MAX_FRAMES",
    "MAX_SEED",
    "array",
    "corners",
    "in_frames",
    "inside",
    "number",
    "rotations",
    "shaped",
    "whole",
]

FARTHEST = 1e8
"""Metres from the world's origin (a quarter of the way to the moon); single-precision numbers mean
nothing long before.
"""
MAX_FRAMES = 100_000
"""Of one shot, at the scene's rate and at the model's: 55 minutes at 30 frames a second, a gigabyte
of what is seen.
"""
MAX_SEED = 2**31 - 1
"""The largest seed, which is the largest whole number that Blender keeps in a file."""

_UNTRUE = 0.01  # of a rotation matrix: how far its axes may be from unit length and right angles


def number(value: object, what: str, low: float, high: float, unit: str = "") -> float:
    """A finite number from ``low`` to ``high``. ``unit``: words behind the range in the refusal."""
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    if not (is_number and low <= value <= high):  # type: ignore[operator]
        of = f" {unit}" if unit else ""
        raise InputError(
            f"{what} is {printable(value, 40)}; give a number from {low:g} to {high:g}{of}."
        )
    return float(value)  # type: ignore[arg-type]


def whole(value: object, what: str, low: int, high: int) -> int:
    """A whole number from ``low`` to ``high``, of Python or NumPy."""
    if isinstance(value, bool) or not isinstance(value, Integral) or not low <= int(value) <= high:
        raise InputError(
            f"{what} is {printable(value, 40)}; give a whole number from {low} to {high}."
        )
    return int(value)


def array(value: object, what: str) -> np.ndarray:
    """An array of numbers; single and double precision stay as they are, all else becomes
    double.
    """
    found = _numbers(value, what)
    return found if found.dtype in (np.float32, np.float64) else found.astype(float)


def _numbers(value: object, what: str) -> np.ndarray:
    try:
        found = np.asarray(value)
    except (ValueError, TypeError, OverflowError) as error:
        raise InputError(
            f"{what} cannot be read as an array; give rows of the same length, of numbers only."
        ) from error

    if found.dtype.kind not in "fiub":
        raise InputError(
            f"{what} holds something other than numbers ({found.dtype.name}); give an array of "
            "numbers."
        )

    return found


def shaped(value: object, what: str, *shapes: tuple[int, ...], like: str = "") -> np.ndarray:
    """An array of one of these shapes, where -1 stands for any length; ``like``: words behind them
    in the refusal.
    """
    found = array(value, what)
    _require_shape(found, what, *shapes, like=like)
    return found


def _require_shape(found: np.ndarray, what: str, *shapes: tuple[int, ...], like: str = "") -> None:
    fits = (
        len(shape) == found.ndim
        and all(n in (-1, m) for n, m in zip(shape, found.shape, strict=True))
        for shape in shapes
    )
    if not any(fits):
        wanted = " or ".join(str(shape).replace("-1", "N") for shape in shapes)
        raise InputError(f"{what} has the shape {_brief(found.shape)}; it must be {wanted}{like}.")


def _brief(shape: tuple[int, ...]) -> str:
    return str(shape) if len(shape) < 6 else f"of {len(shape)} dimensions"


def inside(
    found: np.ndarray,
    what: str,
    upper_bound: float,
    *,
    free: bool = False,
    fix: str = "give finite numbers",
) -> np.ndarray:
    """The array, whose numbers are finite and from -``upper_bound`` to ``upper_bound``; ``free``:
    NaN is allowed, and means that.

    ``fix``: what the refusal tells to do about what is not a number.
    """
    known = found[~np.isnan(found)] if free else found
    if not np.isfinite(known).all():
        is_infinite = free or not np.isnan(known).any()
        raise InputError(
            f"{what} holds {'an infinite number' if is_infinite else 'what is not a number'}; "
            f"{fix}."
        )

    if known.size and float(np.abs(known).max()) > upper_bound:
        raise InputError(
            f"{what} holds {float(np.abs(known).max()):.3g}, which is too far off; keep within "
            f"{upper_bound:g}."
        )

    return found


def rotations(found: np.ndarray, what: str) -> np.ndarray:
    """Matrices (…, 3, 3) whose columns are three right-handed axes at right angles, those left out
    that are not all numbers.
    """
    known = found[np.isfinite(found).all(axis=(-2, -1))].astype(float)
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(np.swapaxes(known, -1, -2) @ known - np.eye(3))

    if not (off < _UNTRUE).all() or not (np.linalg.det(known) > 0).all():
        raise InputError(
            f"{what} holds a matrix that is not a rotation; give right-handed axes of length 1 at "
            "right angles."
        )

    return found


def corners(value: object, what: str, vertices: int) -> np.ndarray:
    """Triangles (F, 3) int64, some or none, as indices of so many vertices."""
    found = _numbers(value, what)
    found = found.reshape(0, 3) if found.size == 0 else found
    _require_shape(found, what, (-1, 3))
    if found.dtype.kind == "f" and not (found == np.floor(found)).all():
        raise InputError(f"{what} hold what is not a whole number; number the vertices from 0.")
    if found.size and not 0 <= found.min() <= found.max() < vertices:
        raise InputError(
            f"{what} name missing vertices; number them from 0, or clean the mesh up and try again."
        )

    return found.astype(np.int64)


def in_frames(matrices: np.ndarray, name: str, frames: int) -> None:
    """Raise InputError unless a solid's matrices (4, 4) or (T, 4, 4) are one, or one for each of
    the root's ``frames``.
    """
    if matrices.ndim == 3 and len(matrices) not in (1, frames):
        raise InputError(
            f"'{name}' has {len(matrices)} frames and the root {frames}; give it one matrix or "
            "one a frame."
        )
