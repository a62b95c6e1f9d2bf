"""Weights files: a short, suspicious reader and a writer of the safetensors format, and what a file
says of itself.

Layout: 8 bytes, the header's length N (little endian); N bytes of JSON, ``{name: {"dtype", "shape",
"data_offsets": [begin, end]}, "__metadata__": {text: text}}``; then the tensors, row-major, little
endian, without a hole. Nothing is ever unpickled, and every number in the header is checked before
a byte is used.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .errors import WeightsError
from .sensor import RADIUS
from .text import printable, read_json

__all__ = [
    "FORMAT",
    "Weights",
    "load_weights",
    "read_safetensors",
    "shipped_weights",
    "write_safetensors",
    "quantised",
]

FORMAT = "dafnet-1"
"""Value of the metadata key ``format``; another one means other tensors."""

_MAX_HEADER = 1 << 20  # bytes
_MAX_FILE = 1 << 29  # bytes; the paper's model in single precision is a quarter of that
_SHOWN = 60  # characters of a name in a sentence
_DTYPES = {
    "F64": "<f8",
    "F32": "<f4",
    "F16": "<f2",
    "BF16": "<u2",
    "I64": "<i8",
    "I32": "<i4",
    "I8": "i1",
    "U8": "u1",
}
_WRITTEN = {np.dtype(code): name for name, code in _DTYPES.items() if name != "BF16"}


def read_safetensors(path: str | Path) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Tensors (read-only, BF16 widened to float32, all else as stored) and metadata of a
    ``.safetensors`` file.

    Raises WeightsError where the file is missing, truncated, over 512 MiB, or its header is not
    what the format asks for: too long, no JSON that ``read_json`` takes, an unknown type, offsets
    that leave the file, overlap, leave holes or differ from the shape.
    """
    path = Path(path)
    header, data = _parts(path)

    try:
        entries = read_json(header.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise _damaged(path, "its header is not text") from error
    except ValueError as error:
        raise _damaged(path, f"its header {error}") from error

    if not isinstance(entries, dict):
        raise _damaged(path, "its header is not an object")

    metadata = entries.pop("__metadata__", {})
    if not isinstance(metadata, dict) or not all(
        isinstance(value, str) for value in metadata.values()
    ):
        raise _damaged(path, "its metadata is not text")

    for name, entry in entries.items():
        _check_entry(path, printable(name, _SHOWN), entry)

    spans = sorted(entry["data_offsets"] for entry in entries.values())
    if [begin for begin, _ in spans] + [len(data)] != [0] + [end for _, end in spans]:
        raise _damaged(path, "its tensors overlap, leave holes or leave the file")

    tensors = {}
    for name, entry in entries.items():
        array: np.ndarray = np.ndarray(
            entry["shape"], _DTYPES[entry["dtype"]], data, entry["data_offsets"][0]
        )
        tensors[name] = (
            (array.astype(np.uint32) << 16).view(np.float32) if entry["dtype"] == "BF16" else array
        )

    return tensors, metadata


def _damaged(path: Path, what: str) -> WeightsError:
    return WeightsError(
        f"The weights file '{path.name}' is damaged ({what}); install the extension again or "
        "choose another file."
    )


def _other_version(path: Path, what: str) -> WeightsError:
    return WeightsError(
        f"The weights file '{path.name}' was made for another version ({what}); "
        "update the extension or choose another file."
    )


def _parts(path: Path) -> tuple[bytes, bytes]:
    """Header and data of a file; the length that it claims is compared with its own before it is
    believed.
    """
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            if size > _MAX_FILE:
                raise WeightsError(
                    f"The weights file '{path.name}' is larger than 512 MiB; choose another file."
                )
            file.seek(0)
            length = int.from_bytes(file.read(8), "little")
            if not 2 <= length <= min(size - 8, _MAX_HEADER):
                raise _damaged(path, "its header's length is impossible")
            header, data = file.read(length), file.read(size - 8 - length)
    except OSError as error:
        raise WeightsError(
            f"The weights file '{path}' cannot be read ({error.strerror}); "
            "install the extension again or choose another file."
        ) from error

    if 8 + len(header) + len(data) != size:
        raise _damaged(path, "it changed while it was read")

    return header, data


def _check_entry(path: Path, name: str, entry: object) -> None:
    """Raise WeightsError unless this describes one tensor whose bytes are as many as its shape asks
    for.
    """
    if not isinstance(entry, dict) or set(entry) != {"dtype", "shape", "data_offsets"}:
        raise _damaged(path, f"'{name}' is not described as it should be")

    dtype, shape, offsets = entry["dtype"], entry["shape"], entry["data_offsets"]
    if not isinstance(dtype, str) or dtype not in _DTYPES:
        raise _damaged(path, f"'{name}' has an unknown type")

    # A tensor without values may not be huge in its other directions either: NumPy makes none.
    if (
        not _are_counts(shape)
        or len(shape) > 8
        or math.prod(size or 1 for size in shape) > _MAX_FILE
    ):
        raise _damaged(path, f"'{name}' has an impossible shape")

    if not _are_counts(offsets) or len(offsets) != 2:
        raise _damaged(path, f"'{name}' has impossible offsets")
    if offsets[1] - offsets[0] != math.prod(shape) * np.dtype(_DTYPES[dtype]).itemsize:
        raise _damaged(path, f"the size of '{name}' is not that of its shape")


def _are_counts(values: Any) -> bool:
    """Whether this is a list of whole numbers from 0 to 512 MiB (JSON's true is a number to Python,
    not to us).
    """
    return isinstance(values, list) and all(
        type(value) is int and 0 <= value <= _MAX_FILE for value in values
    )


def write_safetensors(
    path: str | Path, tensors: Mapping[str, np.ndarray], metadata: Mapping[str, str]
) -> None:
    """Write tensors and text metadata; the same content gives the same bytes. Raises TypeError for
    other types.
    """
    header: dict[str, Any] = {"__metadata__": dict(sorted(metadata.items()))}
    chunks: list[bytes] = []
    offset = 0
    # Wide types first, so that every tensor lies on a multiple of its item's size.
    for name in sorted(tensors, key=lambda name: (-tensors[name].dtype.itemsize, name)):
        array = tensors[name]
        dtype = array.dtype.newbyteorder("<")
        if dtype not in _WRITTEN:
            raise TypeError(f"a weights file cannot hold {array.dtype} ('{name}')")

        chunks.append(array.astype(dtype).tobytes())
        end = offset + len(chunks[-1])
        header[name] = {
            "dtype": _WRITTEN[dtype],
            "shape": list(array.shape),
            "data_offsets": [offset, end],
        }
        offset = end

    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    Path(path).write_bytes(b"".join([len(text).to_bytes(8, "little"), text, *chunks]))


def quantised(array: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """An array in 8 bits, and a float32 scale (rows,) of its rows (first axis), from each row's
    largest magnitude.

    Stored as ``name`` and ``name.scale``; ``load_weights`` multiplies them again. The error is at
    most half a scale.
    """
    rows = array.reshape(len(array), -1)
    scale = (np.abs(rows).max(axis=1, initial=0.0) / 127.0).astype(np.float32)
    steps = np.rint(rows / np.where(scale > 0.0, scale, 1.0)[:, None])
    return np.clip(steps, -127, 127).astype(np.int8).reshape(array.shape), scale


@dataclass(frozen=True)
class Weights:
    """A model as its file gives it.

    ``tensors``: float32 arrays by name, 8-bit and half-precision ones expanded. ``config``: the
    parsed metadata key ``config`` (architecture, normalisation, frame rate, skeleton).
    ``metadata``: all of the file's own words. ``path``: where it lies.
    """

    tensors: dict[str, np.ndarray]
    config: dict[str, Any]
    metadata: dict[str, str]
    path: Path

    def require(self, name: str, shape: tuple[int, ...] | None = None) -> np.ndarray:
        """The tensor of this name; raises WeightsError where it is missing or does not have this
        shape.
        """
        tensor = self.tensors.get(name)
        if tensor is None:
            raise _other_version(self.path, f"'{name}' is missing")
        if shape is not None and tensor.shape != tuple(shape):
            raise _other_version(
                self.path, f"'{name}' has the shape {tensor.shape}, not {tuple(shape)}"
            )
        return tensor

    @property
    def sphere_radius(self) -> float:
        """Radius of the sensor's spheres that these weights were trained with (metres): a config
        that has no ``sphere_radius`` is of before these overlapped. Raises WeightsError where it is
        none.
        """
        radius = self.config.get("sphere_radius", RADIUS / 2.0)
        if isinstance(radius, bool) or not isinstance(radius, (int, float)):
            radius = 0.0
        if not 0.0 < radius <= RADIUS:
            raise _other_version(
                self.path, "its sensor's spheres are of a size that this one has not"
            )
        return float(radius)

    @property
    def heeds_legs(self) -> bool:
        """Whether training gave targets of feet and lower bodies: its words say "legs" under
        ``told``.
        """
        return "legs" in self.metadata.get("told", "").split()

    def says(self, key: str) -> Any:
        """What the metadata says under a key: parsed where it is JSON, as it stands where not, None
        where it says nothing.
        """
        said = self.metadata.get(key)
        try:
            return None if said is None else read_json(said)
        except ValueError:
            return said


def load_weights(path: str | Path | None = None) -> Weights:
    """Read a weights file, or the one that ships in ``weights_stub`` beside the package where
    ``path`` is None.

    Raises WeightsError where the file is missing, damaged (see ``read_safetensors``), or made for
    another version.
    """
    path = shipped_weights() if path is None else Path(path)
    stored, metadata = read_safetensors(path)
    if metadata.get("format") != FORMAT:
        said = printable(metadata.get("format", "unknown"), _SHOWN)
        raise _other_version(path, f"its format is '{said}', not '{FORMAT}'")

    try:
        config = read_json(metadata.get("config", ""))
    except ValueError as error:
        raise _damaged(path, f"its config {error}") from error

    if not isinstance(config, dict):
        raise _damaged(path, "its config is not an object")

    tensors = {}
    for name, array in stored.items():
        shown = printable(name, _SHOWN)
        if name.endswith(".scale") and name.removesuffix(".scale") in stored:
            continue

        with np.errstate(over="ignore", invalid="ignore"):
            tensor = array.astype(np.float32)
            if array.dtype == np.int8:
                tensor *= _row_scales(path, stored, name)

        if not np.isfinite(tensor).all():
            raise _damaged(path, f"'{shown}' holds values that are not numbers")

        tensors[name] = tensor

    return Weights(tensors, config, metadata, path)


def _row_scales(path: Path, stored: dict[str, np.ndarray], name: str) -> np.ndarray:
    """The scales of an 8-bit tensor, shaped to multiply its rows."""
    rows, scale = stored[name], stored.get(f"{name}.scale")
    if scale is None or rows.ndim == 0 or scale.shape != rows.shape[:1]:
        raise _damaged(path, f"the 8-bit tensor '{printable(name, _SHOWN)}' lacks its scales")
    return scale.astype(np.float32).reshape(-1, *[1] * (rows.ndim - 1))


def shipped_weights() -> Path:
    """The weights file that ships in ``weights_stub`` beside the package. Raises WeightsError where
    there is none.
    """
    folder = Path(__file__).parents[2] / "weights_stub"
    found = sorted(folder.glob("*.safetensors"))
    if len(found) != 1:
        what = "no weights file" if not found else "more than one weights file"
        raise WeightsError(
            f"There is {what} in '{folder}'; install the extension again or choose a weights file."
        )
    return found[0]
