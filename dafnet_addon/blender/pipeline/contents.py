"""What a file's actions say, told by content: files of the same motion differ in their bytes."""

from hashlib import sha256
from pathlib import Path

import bpy
import numpy as np

from ..compat import all_curves
from .batch import open_file

__all__ = ["key_hashes"]


def key_hashes(file: Path) -> dict[str, str]:
    """A hash of the keys of every action in a file, by its name, which is opened in place of what
    is open. Raises InputError where it cannot be opened.
    """
    open_file(file)
    found = {}
    for action in bpy.data.actions:
        digest = sha256()
        for curve in sorted(
            all_curves(action), key=lambda each: (each.data_path, each.array_index)
        ):
            keys = np.empty(2 * len(curve.keyframe_points))
            curve.keyframe_points.foreach_get("co", keys)
            digest.update(f"{curve.data_path}[{curve.array_index}]".encode())
            digest.update(keys.astype("<f4").tobytes())
        found[action.name] = digest.hexdigest()
    return found
