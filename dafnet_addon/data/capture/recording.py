"""A captured skeleton as its file has it: joints by name, in the file's own units and axes; and how
bones pose it.
"""

import re
from array import array
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.errors import InputError
from ...core.rotations import rotate

__all__ = [
    "MAX_JOINTS",
    "Recording",
    "check_size",
    "numbers_in",
    "posed",
    "posed_in_blocks",
    "printable",
    "rotation_about",
    "sound",
    "text_of",
]

MAX_JOINTS = 4096
"""Of a skeleton that is read: faces, fingers and cloth have hundreds."""

_LARGEST = 1e9  # of a number in a file; no way in millimetres is as long
_SPARE = 50_000_000  # bytes of positions that a file may have beyond twice what its numbers take
_BLOCK = 200_000  # joints posed at once, all frames of a block together
_CHUNK = 1 << 20  # characters


@dataclass(frozen=True)
class Recording:
    """``positions`` (T, J, 3): joints in the file's units and axes. ``rest`` (J, 3): the skeleton
    with no rotation at all.

    ``rate``: frames a second, or None where the file does not say. ``unit``: metres of one of its
    units, or None likewise.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: np.ndarray
    rest: np.ndarray
    rate: float | None
    unit: float | None = None

    def __len__(self) -> int:
        return len(self.positions)


def text_of(file: Path) -> str:
    """A text file as editors and exporters leave it, with or without a byte order mark; what is not
    ASCII stands for itself.

    Raises InputError where the file cannot be opened.
    """
    try:
        data = file.read_bytes()
    except OSError as error:
        raise InputError(
            f"The file '{file}' cannot be opened ({error.strerror}); look at its permissions."
        ) from None

    if data[:2] in (BOM_UTF16_LE, BOM_UTF16_BE):
        return data.decode("utf-16", errors="replace")

    return data.removeprefix(BOM_UTF8).decode("latin-1")


def printable(name: str) -> str:
    """A joint's name as it may stand in a sentence."""
    return "".join(c for c in name if c.isprintable())[:80]


def numbers_in(text: str) -> np.ndarray:
    """The numbers (N,) of a text, separated by spaces; a comma is a decimal point where there is no
    other.

    Raises ValueError where something else is among them.
    """
    if "," in text:
        text = text.replace(",", " " if "." in text else ".")

    out, at = array("d"), 0
    while at < len(text):
        # In pieces, since a word takes eight times the memory that it takes in the file.
        gap = re.compile(r"\s").search(text, at + _CHUNK)
        end = gap.start() if gap else len(text)
        out.extend(map(float, text[at:end].split()))
        at = end

    return np.array(out)


def sound(numbers: np.ndarray) -> bool:
    """Whether all are numbers that a motion may hold."""
    if numbers.dtype.kind not in "fiu":
        return False
    return not numbers.size or bool(numbers.min() >= -_LARGEST and numbers.max() <= _LARGEST)


def check_size(file: Path, frames: int, joints: int, numbers: int) -> None:
    """Raises InputError where so many joints and frames would take far more memory than the numbers
    that move them.
    """
    if joints > MAX_JOINTS or frames * joints * 24 > _SPARE + 16 * numbers:
        raise InputError(
            f"The file '{file}' has a skeleton of {joints} joints in {frames} frames, but only "
            f"{numbers} numbers that move it, "
            "which is not a body's; export the body's skeleton alone."
        )


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
    """Positions (T, J, 3) of joints at ``offsets`` (J, 3) or (T, J, 3) in their parents' frames,
    turned by ``local``.

    ``local`` (T, J, 3, 3) are rotations in the parent's frame; parents come before their children,
    the first joint is the root, whose offset is its position.
    """
    offsets = np.broadcast_to(offsets, (*local.shape[:2], 3))
    turned, positions = local.copy(), offsets.copy()
    for j, parent in enumerate(parents[1:], start=1):
        positions[:, j] = positions[:, parent] + rotate(turned[:, parent], offsets[:, j])
        turned[:, j] = turned[:, parent] @ local[:, j]
    return positions


def posed_in_blocks(
    parents: tuple[int, ...], frames: int, pose: Callable[[slice], tuple[np.ndarray, np.ndarray]]
) -> np.ndarray:
    """``posed`` for many frames: ``pose`` gives offsets and rotations of some, which take six times
    what positions do.
    """
    out = np.empty((frames, len(parents), 3))
    step = max(1, _BLOCK // len(parents))
    for start in range(0, frames, step):
        rows = slice(start, start + step)
        out[rows] = posed(parents, *pose(rows))
    return out
