"""Reads the compact motion files: positions of the 22 joints as 16-bit millimetre differences."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.errors import InputError

__all__ = ["Clip", "read_clips"]


@dataclass(frozen=True)
class Clip:
    """``joints`` (T, 22, 3): world, metres, z up, 30 fps, in the source's own proportions; the rest says what it is."""

    name: str
    source: str
    subject: str
    description: str
    category: str
    split: str
    licence: str
    joints: np.ndarray


def read_clips(folder: Path) -> Iterator[Clip]:
    """Every clip of every ``.npz`` file in ``folder``, file by file. Raises InputError where there is none."""
    files = sorted(Path(folder).glob("*.npz"))
    if not files:
        raise InputError(f"The folder '{folder}' holds no motion files (.npz); give the folder that holds them.")
    for file in files:
        with np.load(file) as z:
            infos = json.loads(str(z["clips"]))
            first, delta, frames = z["first_mm"], z["delta_mm"], z["frames"]
        ends = np.concatenate([[0], np.cumsum(frames - 1)])
        for i, info in enumerate(infos):
            steps = delta[ends[i] : ends[i + 1]].astype(np.int32)
            millimetres = np.concatenate([first[i][None].astype(np.int32), steps]).cumsum(0)
            yield Clip(
                info["clip"], file.stem, info["subject"], info["description"], info["category"], info["split"],
                info["licence"], millimetres / 1000.0,
            )
