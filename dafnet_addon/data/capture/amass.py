"""Reads AMASS archives (.npz): rotations of the SMPL, SMPL-H or SMPL-X joints, and the body's way.

The body model that belongs to them may not be given away, so none is used: joints are posed on this
project's own rest skeleton, whose bones have about SMPL's directions. Angles are kept exactly;
joints lie a few centimetres off where the model would have them, and the body's shape (``betas``,
``gender``) is not used.
"""

from pathlib import Path

import numpy as np

from ...core.errors import InputError
from ...core.rotations import matrix_from_vector
from ...core.skeleton import JOINTS, PARENTS, PELVIS, REST
from .archive import names_in, read_arrays
from .recording import Recording, posed_in_blocks, sound

__all__ = ["AMASS", "read_amass"]

AMASS = {"poses", "trans"}
"""Names of the arrays by which a motion as AMASS stores it is known."""

_SIZES = {72: "SMPL", 156: "SMPL-H", 165: "SMPL-X"}
_RATES = ("mocap_framerate", "mocap_frame_rate")
# SMPL at rest: x to the body's left, y up, z forward
_REST = REST[:, [0, 2, 1]] * (-1, 1, 1) - (0, REST[PELVIS, 2], 0)


def read_amass(file: Path) -> Recording:
    """The recording in an AMASS archive: our 22 joints, metres. Raises InputError where it is not
    what AMASS stores.
    """
    named = [name for name in _RATES if name in names_in(file)][:1]
    poses, way, *rates = read_arrays(file, "poses", "trans", *named)
    if (
        poses.ndim != 2
        or poses.shape[1] not in _SIZES
        or way.shape != (len(poses), 3)
        or not len(poses)
    ):
        raise InputError(
            f"The archive '{file}' holds poses of shape {poses.shape} and trans of shape "
            f"{way.shape}, where AMASS has rows of "
            f"{', '.join(map(str, _SIZES))} and of 3, one for each frame; use the files as AMASS "
            "gives them."
        )

    if not all(sound(array) for array in (poses, way)):
        raise InputError(
            f"The archive '{file}' holds numbers that no motion has; get it again from where it "
            "came."
        )

    if any(rate.size != 1 or rate.dtype.kind == "U" for rate in rates):
        raise InputError(
            f"The archive '{file}' gives no one number as {named[0]}; use the files as AMASS "
            "gives them."
        )

    turns, way = poses[:, :66].reshape(-1, 22, 3), way.astype(float)

    def pose(rows: slice) -> tuple[np.ndarray, np.ndarray]:
        offsets = np.repeat((_REST - _REST[list(PARENTS)])[None], len(way[rows]), axis=0)
        # SMPL's own pelvis lies a constant below ``trans``; the floor is found later, so that the
        # constant does not matter.
        offsets[:, 0] = way[rows]
        return offsets, matrix_from_vector(turns[rows].astype(float))

    rate = float(rates[0].item()) if rates else None
    return Recording(JOINTS, PARENTS, posed_in_blocks(PARENTS, len(way), pose), REST, rate)
