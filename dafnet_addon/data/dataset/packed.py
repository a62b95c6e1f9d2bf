"""A dataset made small enough to be carried to another machine, and made whole again there.

What the sensor sees is not carried: it is made again from furniture and root. Poses are rounded to
half a millimetre (training adds noise of three), velocities to a hundredth of a millimetre a frame,
roots to a tenth of a millimetre, the way ahead to a millimetre. Each frame is told by how it
differs from the one before it, its bytes apart from each other, compressed by LZMA.
"""

import json
import zipfile
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from ...core.errors import InputError
from ...core.files import whole_file
from ..capture.archive import names_in, read_arrays
from .prepare import FURNITURE, load_pool

__all__ = ["is_packed", "pack", "unpack"]

_RECORD, _PACKED, _HELD = "dataset.json", "packed-", "held"
_STEPS = {"poses": 5.0, "velocity": 1e-5, "ahead": 1e-3, "root": 1e-4}
"""What fields are rounded to; poses in ``prepare.POSE_UNIT``s."""
_SPARE = 0.98  # of the room that is left: windows differ a little in size


def is_packed(folder: Path) -> bool:
    """Whether a folder holds a dataset that ``pack`` made."""
    return any(folder.glob(f"{_PACKED}*.npz"))


def _told_by_changes(values: np.ndarray, step: float) -> np.ndarray:
    """Bytes (4, N, …, T) of values (N, T, …) in whole steps: the first frame, then changes."""
    whole = np.rint(values / step).astype(np.int32)
    changes = np.moveaxis(np.diff(whole, axis=1, prepend=np.zeros_like(whole[:, :1])), 1, -1)
    return np.moveaxis(np.ascontiguousarray(changes)[..., None].view(np.uint8), -1, 0)


def _from_changes(told: np.ndarray, step: float) -> np.ndarray:
    """Values (N, T, …), inverse of ``_told_by_changes``."""
    changes = np.ascontiguousarray(np.moveaxis(told, 0, -1)).view(np.int32)[..., 0]
    return step * np.moveaxis(np.cumsum(changes, axis=-1), -1, 1)


def _compressed(arrays: Mapping[str, np.ndarray]) -> bytes:
    """An ``.npz`` of these arrays that NumPy reads."""
    out = BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_LZMA) as archive:
        for name, array in arrays.items():
            member = BytesIO()
            np.lib.format.write_array(member, np.ascontiguousarray(array), allow_pickle=False)
            archive.writestr(f"{name}.npy", member.getvalue())
    return out.getvalue()


def _windows(shard: Mapping[str, np.ndarray], count: int | None = None) -> bytes:
    """The first ``count`` windows of a shard, packed."""
    return _compressed(
        {
            name: _told_by_changes(values[:count], _STEPS[name])
            if name in _STEPS
            else values[:count]
            for name, values in shard.items()
        }
    )


def _save(file: Path, data: bytes) -> int:
    with whole_file(file) as part:
        part.write_bytes(data)
    return len(data)


def pack(
    dataset: Path,
    out: Path,
    mebibytes: float = 60.0,
    progress: Callable[[float], None] = lambda share: None,
) -> int:
    """Pack a dataset into the folder ``out``: its furniture, its held-out windows, and as many of
    its training windows as go into so many MiB. How many these are.

    Raises InputError where not even one does, or ``dataset`` is none.
    """
    shards = sorted(dataset.glob("pool-????.npz"))
    if not shards or not (dataset / _RECORD).exists():
        raise InputError(f"'{dataset}' is not a dataset; make one with 'dafnet prepare'.")

    left = int(mebibytes * 2**20)
    left -= _save(out / _RECORD, (dataset / _RECORD).read_bytes())
    left -= _save(out / f"{_PACKED}{_HELD}.npz", _windows(load_pool([dataset / "held.npz"])))
    if (dataset / FURNITURE).exists():
        with np.load(dataset / FURNITURE) as furniture:
            left -= _save(out / FURNITURE, _compressed(furniture))

    for old in out.glob(f"{_PACKED}????.npz"):
        if old.stem != f"{_PACKED}{_HELD}":
            old.unlink()

    windows = 0
    for k, file in enumerate(shards):
        shard = load_pool([file])
        count = len(shard["poses"])
        data = _windows(shard)
        while count and len(data) > left:
            count = int(_SPARE * count * max(left, 0) / len(data))
            data = _windows(shard, count)

        if not count:
            break

        left -= _save(out / f"{_PACKED}{k:04d}.npz", data)
        windows += count
        progress((k + 1) / len(shards))

    if not windows:
        raise InputError(
            f"Not one window of '{dataset}' goes into {mebibytes:g} MiB beside its furniture and "
            "held-out windows; allow more."
        )

    return windows


def unpack(
    packed: Path, dataset: Path, progress: Callable[[float], None] = lambda share: None
) -> int:
    """Make a packed dataset whole again in the folder ``dataset``; what is there already is kept.
    How many training windows it has. Raises InputError where it is damaged.
    """
    windows = 0
    files = sorted(packed.glob(f"{_PACKED}*.npz"))
    for k, file in enumerate(files):
        name = file.stem.removeprefix(_PACKED)
        made = dataset / ("held.npz" if name == _HELD else f"pool-{name}.npz")
        fields = names_in(file)
        shard = dict(zip(fields, read_arrays(file, *fields), strict=True))
        if missing := [field for field in (*_STEPS, "kinds") if field not in shard]:
            raise InputError(f"'{file}' lacks {', '.join(missing)}; pack the dataset again.")

        for field, step in _STEPS.items():
            shard[field] = _from_changes(shard[field], step)

        kinds = {"poses": np.int16, "kinds": shard["kinds"].dtype}
        shard = {field: a.astype(kinds.get(field, np.float32)) for field, a in shard.items()}
        windows += len(shard["poses"]) * (name != _HELD)
        if not made.exists():
            with whole_file(made) as part, part.open("wb") as out:
                np.savez(out, **shard)

        progress((k + 1) / len(files))

    if (packed / FURNITURE).exists():
        _save(dataset / FURNITURE, (packed / FURNITURE).read_bytes())

    described = json.loads((packed / _RECORD).read_text(encoding="utf-8"))
    _save(dataset / _RECORD, json.dumps({**described, "windows": windows}, indent=1).encode())
    return windows
