"""A take and what was asked for, as bytes: for a file to keep, so that it can be cleaned up again
or gone on from later.

The bytes are a compressed NPZ. Files come from strangers, so none of it is believed: an array's
header is read before the array, and no more is unpacked than the take's own number of frames asks
for.
"""

import io
import json
import math
import re
import zipfile
import zlib
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from .beginning import PREROLL
from .checks import FARTHEST, MAX_FRAMES, inside, number, shaped, whole
from .draws import Draw
from .errors import InputError
from .network import MAX_ACTIONS
from .resampling import covering_frames
from .root import RootPath
from .skeleton import JOINTS, LOWER, TARGETS, UPPER
from .take import Controls, Finding, Take
from .text import printable, read_json

__all__ = ["packed", "unpacked"]

_VERSION = 1
"""Of the packing. What was packed before there were versions is packed so, too."""
_MAX_WORDS = 1 << 20  # bytes of all that is not an array
_MAX_FIGURE = 1e30
_ROWS: dict[str, tuple[int, ...]] = {
    "controls.root": (4, 4),
    "controls.upper_body": (len(UPPER), 3),
    "controls.lower_body": (len(LOWER), 3),
    **{f"controls.{name}": (3,) for name in TARGETS},
    **{f"controls.{name}_rotation": (3, 3) for name in TARGETS},
    **{f"controls.{name}_influence": () for name in TARGETS},
    "controls.look_at": (3,),
    "controls.look_at_influence": (),
    "controls.lean": (),
    "take.joints": (22, 3),
    "take.rotations": (22, 4),
    "take.root": (4, 4),
    "take.touches": (4,),
}
"""The arrays that have a row for each frame of the controls, and the shape of a row."""
_FREE = {name for name in _ROWS if name.startswith("controls.") and name != "controls.root"}
_BEFORE = {"controls.before": (len(JOINTS), 3), "controls.before_root": (4, 4)}
"""The arrays that have a row for each frame before the first one, and for it."""
_LATER = {"take.unchanged", "take.touches", *_BEFORE}
"""What takes that were packed before it was needed lack."""
_MAX_HEADER = 256  # bytes
_HEADER = re.compile(
    rb"\x93NUMPY\x01\0..\{'descr': '([^']{1,20})', 'fortran_order': (True|False), 'shape': "
    rb"\(([\d, ]{0,80})\), \} *\n",
    re.DOTALL,
)
"""Of an array in a file, as NumPy writes it: type, whether the first axis runs fastest, sizes."""
_DAMAGED = (
    ValueError,
    KeyError,
    EOFError,
    OSError,
    OverflowError,
    NotImplementedError,
    RuntimeError,
    zlib.error,
    zipfile.BadZipFile,
)
"""What Python's reader of ZIP files raises for bytes that are none."""


def packed(take: Take, controls: Controls) -> bytes:
    """Both as one compressed NPZ, arrays in single precision; nothing in it is pickled."""
    arrays: dict[str, np.ndarray] = {}
    plain: dict[str, Any] = {"version": _VERSION}
    for kind, thing in (("take", take), ("controls", controls)):
        for each in fields(thing):
            name, value = f"{kind}.{each.name}", getattr(thing, each.name)
            if isinstance(value, RootPath):
                arrays |= {f"{name}.position": value.position, f"{name}.yaw": value.yaw}
            elif isinstance(value, np.ndarray):
                if len(value) or name not in _LATER:
                    arrays[name] = value
            elif value is not None:
                plain[name] = _sayable(value)

    out = io.BytesIO()
    text = np.frombuffer(json.dumps(plain).encode(), np.uint8)
    np.savez_compressed(
        out, plain=text, **{name: a.astype(np.float32) for name, a in arrays.items()}
    )
    return out.getvalue()


def _sayable(value: Any) -> Any:
    """A number, figures by name, or what else a take says, with None for what JSON has no word
    for.
    """
    if isinstance(value, Finding | Draw):
        return asdict(value)
    if isinstance(value, tuple):
        return [_sayable(each) for each in value]
    if isinstance(value, dict):
        return {name: _sayable(each) for name, each in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def unpacked(data: bytes) -> tuple[Take, Controls]:
    """Inverse of ``packed``. Raises InputError, which names the field, where the bytes are not a
    take that can be used.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as file:
            said = _words(file)
            fps = number(said.get("controls.fps"), "'controls.fps'", 1.0, 1000.0)
            arrays = _arrays(file, fps)
        return _take(said, arrays, fps), _controls(said, arrays)
    except InputError as error:
        why = str(error).partition(";")[0].rstrip(".")
        raise InputError(
            f"The motion that the take was made of cannot be read ({why}); generate it again."
        ) from error
    except _DAMAGED as error:
        raise InputError(
            "The motion that the take was made of cannot be read (it is damaged); generate it "
            "again."
        ) from error


def _words(file: zipfile.ZipFile) -> dict[str, Any]:
    """All that is not an array."""
    text = _array(file, "plain", "|u1", _MAX_WORDS).tobytes()
    try:
        said = read_json(text.decode())
    except ValueError as error:
        raise InputError(
            f"'plain' {'is not text' if isinstance(error, UnicodeDecodeError) else error}"
        ) from error

    if not isinstance(said, dict):
        raise InputError("'plain' is not an object")

    whole(said.get("version", 1), "'version'", 1, _VERSION)
    return said


def _array(file: zipfile.ZipFile, name: str, dtype: str, upper_bound: int) -> np.ndarray:
    """An array of this type, of not more than ``upper_bound`` numbers: what claims to be larger is
    not unpacked.
    """
    try:
        info = file.getinfo(f"{name}.npy")
    except KeyError as error:
        raise InputError(f"'{name}' is missing") from error

    # others may claim gigabytes to begin with
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise InputError(f"'{name}' is compressed in another way")
    if info.file_size > upper_bound * np.dtype(dtype).itemsize + _MAX_HEADER:
        raise InputError(f"'{name}' is larger than the take's frames ask for")

    data = file.read(info)
    found = _HEADER.match(data)
    if found is None:
        raise InputError(f"'{name}' is not an array")

    kind, first_fastest, sizes = (each.decode("latin-1") for each in found.groups())
    if kind != dtype:
        raise InputError(f"'{name}' holds {printable(kind, 20)}, not {dtype}")

    shape = tuple(int(size) for size in sizes.replace(" ", "").split(",") if size)
    if math.prod(shape) * np.dtype(dtype).itemsize != len(data) - found.end():
        raise InputError(f"the size of '{name}' is not that of its shape")

    flat = np.frombuffer(data, dtype, offset=found.end())
    return flat.reshape(shape, order="F" if first_fastest == "True" else "C")


def _arrays(file: zipfile.ZipFile, fps: float) -> dict[str, np.ndarray]:
    """All arrays by name, finite, each of the shape that the number of frames, ``fps`` a second,
    asks for.
    """
    root, there = _array(file, "controls.root", "<f4", 16 * MAX_FRAMES), set(file.namelist())
    frames = whole(root.size // 16, "the number of frames in 'controls.root'", 1, MAX_FRAMES)
    made = whole(
        covering_frames(frames, fps), "the number of frames in 'take.poses'", 1, MAX_FRAMES
    )
    wanted: dict[str, tuple[int, ...]] = {name: (frames, *row) for name, row in _ROWS.items()} | {
        "take.action": (frames, -1),
        "take.poses": (PREROLL + made, 66),
        "take.path.position": (made, 3),
        "take.path.yaw": (made,),
        "take.unchanged": (-1, 66),
    }
    wanted |= {name: (-1, *row) for name, row in _BEFORE.items()}
    longest = {"take.action": MAX_ACTIONS, "take.unchanged": 2 * made}
    longest |= dict.fromkeys(_BEFORE, MAX_FRAMES)
    arrays = {}
    for name, shape in wanted.items():
        if name not in _FREE | _LATER or f"{name}.npy" in there:
            upper_bound = math.prod(longest[name] if size == -1 else size for size in shape)
            found = shaped(_array(file, name, "<f4", upper_bound), f"'{name}'", shape)
            arrays[name] = inside(found, f"'{name}'", FARTHEST, free=name in _FREE).astype(float)

    return arrays


def _controls(said: dict[str, Any], arrays: dict[str, np.ndarray]) -> Controls:
    known = {each.name for each in fields(Controls)}
    given = {name.removeprefix("controls."): value for name, value in {**said, **arrays}.items()}
    return Controls(**{name: value for name, value in given.items() if name in known})


def _take(said: dict[str, Any], arrays: dict[str, np.ndarray], fps: float) -> Take:
    def figures(name: str) -> dict[str, float | None]:
        found = said.get(name)
        if not isinstance(found, dict):
            raise InputError(f"'{name}' is {printable(found, 40)}")
        return {
            key: None if value is None else number(value, f"'{name}'", -_MAX_FIGURE, _MAX_FIGURE)
            for key, value in found.items()
        }

    for name in ("fps", "scale"):
        if said.get(f"take.{name}") != said.get(f"controls.{name}"):
            raise InputError(f"'take.{name}' is not that of the controls")

    likelihood, warnings = said.get("take.log_likelihood"), said.get("take.warnings")
    if not isinstance(warnings, list) or not all(isinstance(each, str) for each in warnings):
        raise InputError("'take.warnings' is something other than sentences")

    seconds = {key: value for key, value in figures("take.seconds").items() if value is not None}
    return Take(
        fps=fps,
        joints=arrays["take.joints"],
        rotations=arrays["take.rotations"],
        root=arrays["take.root"],
        action=arrays["take.action"],
        scale=number(said.get("take.scale"), "'take.scale'", 1e-3, 1e3),
        poses=arrays["take.poses"],
        path=RootPath(arrays["take.path.position"], arrays["take.path.yaw"]),
        unchanged=arrays.get("take.unchanged", np.zeros((0, 66))),
        touches=arrays.get("take.touches", np.zeros((0, 4))),
        log_likelihood=math.nan
        if likelihood is None
        else number(likelihood, "'take.log_likelihood'", -_MAX_FIGURE, _MAX_FIGURE),
        draw=_draw(said.get("take.draw", {})),
        raw_metrics=figures("take.raw_metrics"),
        metrics=figures("take.metrics"),
        seconds=seconds,
        warnings=tuple(printable(each, 1000) for each in warnings),
        verdict=_verdict(said.get("take.verdict", [])),
    )


def _draw(said: Any) -> Draw:
    """What a take was drawn with; those that were packed before it was noted do not say it."""
    known = {each.name for each in fields(Draw)}
    if not isinstance(said, dict) or not said.keys() <= known:
        raise InputError("'take.draw' is something other than seeds and temperatures")
    try:
        return Draw(**{**said, "held": said.get("held") is True})
    except InputError as error:
        raise InputError(f"'take.draw' cannot be used: {error}") from error


def _verdict(said: Any) -> tuple[Finding, ...]:
    def finding(each: Any) -> Finding:
        words = [each.get(name) for name in ("word", "text")] if isinstance(each, dict) else [None]
        if not all(isinstance(word, str) for word in words):
            raise InputError("'take.verdict' is something other than findings")
        word, text = (printable(word, 1000) for word in words)
        return Finding(word, text, good=each.get("good") is True)

    if not isinstance(said, list):
        raise InputError("'take.verdict' is something other than findings")
    return tuple(finding(each) for each in said)
