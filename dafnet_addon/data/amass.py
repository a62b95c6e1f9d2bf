"""Reads AMASS archives (.npz): rotations of the SMPL, SMPL-H or SMPL-X joints, and the body's way.

The body model that belongs to them may not be given away, so none is used: joints are posed on this project's own rest
skeleton, whose bones have about SMPL's directions. Angles are kept exactly; joints lie a few centimetres off where the
model would have them, and the body's shape (``betas``, ``gender``) is not used.
"""

from pathlib import Path

import numpy as np

from ..core.errors import InputError
from ..core.rotations import matrix_from_vector
from ..core.skeleton import JOINTS, PARENTS, REST
from .recording import Recording, posed

__all__ = ["is_amass", "read_amass"]

_SIZES = {72: "SMPL", 156: "SMPL-H", 165: "SMPL-X"}
_REST = REST[:, [0, 2, 1]] * (-1, 1, 1) - (0, REST[0, 2], 0)  # SMPL at rest: x to the body's left, y up, z forward


def is_amass(names: list[str]) -> bool:
    """Whether an archive of these arrays is a motion as AMASS stores them."""
    return {"poses", "trans"} <= set(names)


def read_amass(file: Path) -> Recording:
    """The recording in an AMASS archive: our 22 joints, metres. Raises InputError where it is not what AMASS stores."""
    try:
        with np.load(file) as z:
            poses, way = np.asarray(z["poses"], dtype=float), np.asarray(z["trans"], dtype=float)
            rate = next((float(z[name]) for name in ("mocap_framerate", "mocap_frame_rate") if name in z.files), None)
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise InputError(f"The archive '{file}' cannot be read ({error}); download it again.") from None
    if poses.ndim != 2 or poses.shape[1] not in _SIZES or way.shape != (len(poses), 3) or not len(poses):
        raise InputError(
            f"The archive '{file}' holds poses of shape {poses.shape} and trans of shape {way.shape}, where AMASS has rows of "
            f"{', '.join(map(str, _SIZES))} and of 3, one for each frame; use the files as AMASS gives them."
        )
    if not np.isfinite(poses).all() or not np.isfinite(way).all():
        raise InputError(f"The archive '{file}' holds numbers that are not finite; download it again.")
    offsets = np.repeat((_REST - _REST[list(PARENTS)])[None], len(poses), axis=0)
    # SMPL's own pelvis lies a constant below ``trans``; the floor is found later, so that the constant does not matter.
    offsets[:, 0] = way
    local = matrix_from_vector(poses[:, :66].reshape(-1, 22, 3))
    return Recording(JOINTS, PARENTS, posed(PARENTS, offsets, local), REST, rate)
