"""Opens archives of arrays (.npz) that anyone may have made: nothing is unpacked before its size is known to be sound."""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from math import prod
from pathlib import Path
from tokenize import TokenError
from typing import IO
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile, ZipInfo

import numpy as np

from ..core.errors import InputError

__all__ = ["names_in", "read_arrays"]

_SPARE, _PACKED = 100_000_000, 20
"""An archive may unpack to so many bytes, and to so many times its own size; motion is packed to a half or a third."""

_KINDS = {"f": "numbers", "i": "numbers", "u": "numbers", "U": "text"}
_DAMAGE = (
    BadZipFile, EOFError, KeyError, NotImplementedError, OSError, OverflowError, RuntimeError, SyntaxError, TokenError,
    TypeError, ValueError, struct.error, zlib.error,
)
"""All that a damaged archive may raise in zipfile and in NumPy's reader of headers."""


@contextmanager
def _opened(file: Path) -> Iterator[ZipFile]:
    try:
        with ZipFile(file) as archive:
            yield archive
    except _DAMAGE as error:
        reason = " ".join(str(error).split())[:120]
        raise InputError(f"The archive '{file}' cannot be read ({reason}); get it again from where it came.") from None


def _header(member: IO[bytes]) -> tuple[tuple[int, ...], np.dtype]:
    """Shape and type that an array announces; ``member`` is left where its numbers begin. Raises ValueError."""
    version = np.lib.format.read_magic(member)
    if version == (1, 0):
        shape, _, dtype = np.lib.format.read_array_header_1_0(member)
    elif version == (2, 0):
        shape, _, dtype = np.lib.format.read_array_header_2_0(member)
    else:
        raise ValueError(f"version {version} of an array")
    return shape, dtype


def _check(archive: ZipFile, info: ZipInfo) -> None:
    """Raises ValueError where an array is not just what its header announces."""
    if info.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
        raise ValueError(f"'{info.filename}' is packed as no .npz is")
    with archive.open(info) as member:
        shape, dtype = _header(member)
        held = info.file_size - member.tell()
    if dtype.kind not in _KINDS or min(shape, default=0) < 0:
        raise ValueError(f"'{info.filename}' holds neither numbers nor text")
    if prod(shape) * max(dtype.itemsize, 1) != held:
        raise ValueError(f"'{info.filename}' announces {'×'.join(map(str, shape))} entries, but holds {held} bytes")


def names_in(file: Path) -> list[str]:
    """Names of the arrays in an archive. Raises InputError where it is none."""
    with _opened(file) as archive:
        return [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]


def read_arrays(file: Path, *names: str) -> list[np.ndarray]:
    """Arrays of numbers or text by name. Raises InputError where one is missing, damaged, or larger than the file can hold."""
    with _opened(file) as archive:
        missing = [name for name in names if f"{name}.npy" not in archive.namelist()]
        if missing:
            raise ValueError(f"it lacks {', '.join(missing)}")
        infos = [archive.getinfo(f"{name}.npy") for name in names]
        unpacked = sum(info.file_size for info in infos)
        if unpacked > _SPARE + _PACKED * file.stat().st_size:
            raise ValueError(f"it would unpack to {unpacked / 1e6:.0f} MB, which no motion of its size does")
        for info in infos:
            _check(archive, info)
        arrays = []
        for info in infos:
            with archive.open(info) as member:
                arrays.append(np.lib.format.read_array(member, allow_pickle=False))
        return arrays
