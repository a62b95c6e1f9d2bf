"""Opens archives of arrays (.npz) that anyone may have made: nothing is unpacked before its size is
known to be sound.
"""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from lzma import LZMAError
from math import prod
from pathlib import Path
from tokenize import TokenError
from zipfile import ZIP_DEFLATED, ZIP_LZMA, ZIP_STORED, BadZipFile, ZipFile

import numpy as np

from ...core.errors import InputError

__all__ = ["mapped_arrays", "names_in", "read_arrays"]

_SPARE, _PACKED = 100_000_000, 20
"""An archive may unpack to so many bytes, and to so many times its own size; motion is packed to a
half or a third.
"""

_KINDS = "fiuU"  # numbers and text
_DAMAGE = (
    BadZipFile,
    EOFError,
    KeyError,
    LZMAError,
    NotImplementedError,
    OSError,
    OverflowError,
    RuntimeError,
    SyntaxError,
    TokenError,
    TypeError,
    ValueError,
    struct.error,
    zlib.error,
)
"""All that a damaged archive may raise in zipfile and in NumPy's reader of headers."""


@contextmanager
def _opened(file: Path) -> Iterator[ZipFile]:
    try:
        with ZipFile(file) as archive:
            yield archive
    except _DAMAGE as error:
        reason = " ".join(str(error).split())[:120]
        raise InputError(
            f"The archive '{file}' cannot be read ({reason}); get it again from where it came."
        ) from None


def _array(name: str, data: bytes) -> np.ndarray:
    """The array in a member of an archive, without a copy. Raises ValueError where it is not just
    what its header announces.
    """
    member = BytesIO(data)
    version = np.lib.format.read_magic(member)
    if version == (1, 0):
        shape, by_columns, dtype = np.lib.format.read_array_header_1_0(member)
    elif version == (2, 0):
        shape, by_columns, dtype = np.lib.format.read_array_header_2_0(member)
    else:
        raise ValueError(f"'{name}' is an array of version {version}")

    held = len(data) - member.tell()
    if dtype.kind not in _KINDS or min(shape, default=0) < 0:
        raise ValueError(f"'{name}' holds neither numbers nor text")
    if prod(shape) * max(dtype.itemsize, 1) != held:
        raise ValueError(
            f"'{name}' announces {'×'.join(map(str, shape))} entries, but holds {held} bytes"
        )

    flat = np.frombuffer(data, dtype, offset=member.tell()) if held else np.zeros(0, dtype)
    return flat.reshape(shape, order="F" if by_columns else "C")


def names_in(file: Path) -> list[str]:
    """Names of the arrays in an archive. Raises InputError where it is none."""
    with _opened(file) as archive:
        return [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]


def read_arrays(file: Path, *names: str) -> list[np.ndarray]:
    """Arrays of numbers or text by name. Raises InputError where one is missing, damaged, or larger
    than the file can hold.
    """
    with _opened(file) as archive:
        missing = [name for name in names if f"{name}.npy" not in archive.namelist()]
        if missing:
            raise ValueError(f"it lacks {', '.join(missing)}")

        infos = [archive.getinfo(f"{name}.npy") for name in names]
        unpacked = sum(info.file_size for info in infos)
        if unpacked > _SPARE + _PACKED * file.stat().st_size:
            raise ValueError(
                f"it would unpack to {unpacked / 1e6:.0f} MB, which no motion of its size does"
            )
        if any(info.compress_type not in (ZIP_STORED, ZIP_DEFLATED, ZIP_LZMA) for info in infos):
            raise ValueError("it is packed as no .npz is")

        return [_array(info.filename, archive.read(info)) for info in infos]


def mapped_arrays(file: Path) -> dict[str, np.ndarray]:
    """The arrays in an archive that is not compressed, where they lie on disk: no memory is taken
    but for what is read of them, and that is given back when others need it. What is written into
    them stays in memory. Raises InputError where it is compressed, or damaged.
    """
    arrays: dict[str, np.ndarray] = {}
    with _opened(file) as archive, file.open("rb") as data:
        for info in archive.infolist():
            if info.compress_type != ZIP_STORED:
                raise ValueError(f"'{info.filename}' is compressed")
            data.seek(info.header_offset + 26)  # where the lengths of name and extra field stand
            data.seek(sum(struct.unpack("<HH", data.read(4))), 1)
            version = np.lib.format.read_magic(data)
            if version != (1, 0):
                raise ValueError(f"'{info.filename}' is an array of version {version}")
            shape, _, dtype = np.lib.format.read_array_header_1_0(data)
            if dtype.kind not in _KINDS:
                raise ValueError(f"'{info.filename}' holds neither numbers nor text")
            name = info.filename.removesuffix(".npy")
            arrays[name] = np.memmap(file, dtype, "c", data.tell(), shape)

    return arrays
