"""Images whose pixels are numbers, in which nothing is rounded to colours."""

import struct
import zlib
from pathlib import Path

import numpy as np

from .files import whole_file

__all__ = ["save_numbers"]

_GREY = 0  # a PNG's type of colour
_BITS = 16  # of a pixel


def save_numbers(path: Path, values: np.ndarray) -> None:
    """Write whole numbers (height, width) from 0 to 65535, the top row first, as a grey PNG of 16
    bits. ``InputError`` as for ``whole_file``.
    """
    rows = np.ascontiguousarray(values, dtype=">u2")
    height, width = rows.shape
    lines = np.zeros((height, 1 + 2 * width), np.uint8)  # each begins with its filter, none
    lines[:, 1:] = rows.view(np.uint8)
    header = struct.pack(">IIBBBBB", width, height, _BITS, _GREY, 0, 0, 0)
    chunks = (b"IHDR", header), (b"IDAT", zlib.compress(lines.tobytes(), 6)), (b"IEND", b"")
    with whole_file(path) as part, part.open("wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for kind, data in chunks:
            file.write(struct.pack(">I", len(data)) + kind + data)
            file.write(struct.pack(">I", zlib.crc32(kind + data)))
