"""Seated episodes of a motion: where and when its pelvis rests."""

from dataclasses import dataclass

import numpy as np

from ...core.root import RootPath
from ...core.series import MODEL_FPS, runs
from ...core.skeleton import PELVIS, joint

__all__ = ["Rest", "rest_of", "resting"]

_MIN_REST = 8  # frames
# metres: a pelvis that is lower, or, with the knees before it, on a bar stool
_SURELY_SEATED, _HIGHEST = 0.88, 1.0
_KNEES_AHEAD = 0.14  # metres; who stands has them within 0.1


@dataclass(frozen=True)
class Rest:
    """A seated episode: in frames ``start`` to ``end`` (exclusive) the pelvis rests at ``position``
    (3,), facing ``yaw``.
    """

    start: int
    end: int
    position: np.ndarray
    yaw: float


def rest_of(joints: np.ndarray, path: RootPath, start: int, end: int) -> Rest:
    """The seated episode of a clip (T, 22, 3) in these frames."""
    return Rest(
        start,
        end,
        np.median(joints[start:end, PELVIS], axis=0),
        float(np.median(path.yaw[start:end])),
    )


def resting(joints: np.ndarray, path: RootPath) -> list[Rest]:
    """Seated episodes of a clip (T, 22, 3): the pelvis low and still, the trunk upright, for a
    quarter of a second or more.
    """
    pelvis = joints[:, PELVIS]
    speed = (
        np.linalg.norm(np.gradient(pelvis, axis=0), axis=-1) * MODEL_FPS
        if len(pelvis) > 2
        else np.zeros(len(pelvis))
    )
    trunk = joints[:, joint("neck")] - pelvis
    upright = trunk[:, 2] > 0.6 * np.linalg.norm(trunk, axis=-1)
    # In a squat the heels are under the hips; on a seat the knees reach forward and the shins
    # stand.
    ankles = (joints[:, joint("left_ankle")] + joints[:, joint("right_ankle")]) / 2
    ahead = np.linalg.norm((ankles - pelvis)[:, :2], axis=-1) > 0.15
    knees = (joints[:, joint("left_knee")] + joints[:, joint("right_knee")]) / 2
    lifted = np.linalg.norm((knees - pelvis)[:, :2], axis=-1) > _KNEES_AHEAD
    low = (pelvis[:, 2] < _SURELY_SEATED) | ((pelvis[:, 2] < _HIGHEST) & lifted)
    still = low & (speed < 0.12) & upright & ahead
    return [rest_of(joints, path, start, end) for start, end in runs(still, _MIN_REST)]
