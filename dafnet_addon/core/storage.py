"""A take and what was asked for, as bytes: for a file to keep, so that it can be cleaned up again or gone on from later."""

import io
import json
import zipfile
from dataclasses import fields
from typing import Any

import numpy as np

from .errors import InputError
from .root import RootPath
from .take import Controls, Take

__all__ = ["packed", "unpacked"]

_KINDS = {"take": Take, "controls": Controls}


def packed(take: Take, controls: Controls) -> bytes:
    """Both as one compressed NPZ, arrays in single precision; nothing in it is pickled."""
    arrays: dict[str, np.ndarray] = {}
    plain: dict[str, Any] = {}
    for kind, thing in (("take", take), ("controls", controls)):
        for each in fields(thing):
            name, value = f"{kind}.{each.name}", getattr(thing, each.name)
            if isinstance(value, RootPath):
                arrays |= {f"{name}.position": value.position, f"{name}.yaw": value.yaw}
            elif isinstance(value, np.ndarray):
                arrays[name] = value
            elif value is not None:
                plain[name] = value
    out = io.BytesIO()
    text = np.frombuffer(json.dumps(plain).encode(), np.uint8)
    np.savez_compressed(out, plain=text, **{name: a.astype(np.float32) for name, a in arrays.items()})
    return out.getvalue()


def unpacked(data: bytes) -> tuple[Take, Controls]:
    """Inverse of ``packed``. Raises InputError where the bytes are no take."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        values: dict[str, Any] = json.loads(arrays.pop("plain").tobytes())
        for name, array in arrays.items():
            values[name] = array.astype(float)
        place, yaw = (values.pop(f"take.path.{part}") for part in ("position", "yaw"))
        values["take.path"] = RootPath(place, yaw)
        values["take.warnings"] = tuple(values["take.warnings"])
        made = []
        for kind, cls in _KINDS.items():
            known = {each.name for each in fields(cls)}
            given = {name.removeprefix(f"{kind}."): value for name, value in values.items() if name.startswith(f"{kind}.")}
            made.append(cls(**{name: value for name, value in given.items() if name in known}))
    except (ValueError, KeyError, TypeError, OSError, zipfile.BadZipFile) as error:
        raise InputError("The motion that the take was made of cannot be read; generate it again.") from error
    return made[0], made[1]
