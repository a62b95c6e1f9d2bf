"""Motion on the canonical body: its joints, which of its frames may be used, and where it sits."""

from dataclasses import dataclass

import numpy as np

from ...core.root import root_from_joints
from ...core.series import MODEL_FPS
from ...core.skeleton import MIRROR, PELVIS, joint
from ..capture.cuts import bad_frames
from .rests import Rest, resting

__all__ = ["COMPOSED", "Motion", "mirrored", "motion_of"]

COMPOSED = "composed"
"""Source of motions that nobody did in one piece."""

_HOLD = 45  # frames that a rest at the ends of a clip is held


@dataclass(frozen=True)
class Motion:
    """A clip on the canonical body: ``joints`` (T, 22, 3), frames that may be used, and its seated
    episodes.
    """

    name: str
    source: str
    subject: str
    category: str
    joints: np.ndarray
    valid: np.ndarray
    rests: tuple[Rest, ...]


def _usable(joints: np.ndarray) -> np.ndarray:
    """False in frames of a T-pose, a flip or an impossible speed, and where an upright body has
    left the floor.
    """
    airborne = (
        np.minimum(joints[:, joint("left_foot"), 2], joints[:, joint("right_foot"), 2]) > 0.22
    )
    airborne &= joints[:, joint("neck"), 2] - joints[:, PELVIS, 2] > 0.35
    return ~np.any([airborne, *bad_frames(joints).values()], axis=0)


def _held(joints: np.ndarray, valid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The clip with its first and last pose held for a while, where it is at rest there: stillness
    is otherwise rare.
    """
    if len(joints) < 3:
        return joints, valid
    speed = np.linalg.norm(np.diff(joints, axis=0), axis=-1).max(1) * MODEL_FPS
    before = _HOLD * bool(speed[:3].max() < 0.35)
    after = _HOLD * bool(speed[-3:].max() < 0.35)
    frames = np.clip(np.arange(-before, len(joints) + after), 0, len(joints) - 1)
    return joints[frames], valid[frames]


def motion_of(name: str, source: str, subject: str, category: str, joints: np.ndarray) -> Motion:
    """A motion ready to be drawn from."""
    held, valid = _held(joints, _usable(joints))
    rests = tuple(resting(held, root_from_joints(held))) if len(held) > 2 else ()
    return Motion(name, source, subject, category, held, valid, rests)


def mirrored(joints: np.ndarray) -> np.ndarray:
    """The motion seen in a mirror (x and −x, left and right)."""
    return joints[:, MIRROR] * (-1.0, 1.0, 1.0)
